// A frame of a character as a Wavefront OBJ file, which any viewer shows.
#pragma once

#include <array>
#include <cstdint>

#include "perf/base/output_file.h"
#include "scenes/import/import.h"

namespace cab::perf {

// Writes the skeleton's mesh in one frame, if its file's meshes were read, as object "mesh", and each body of the
// character as an object with the name of its link. Coordinates are metres in the world; `origin` is the character's
// origin. Round bodies are polytopes within them. Closes the file. Throws std::runtime_error.
void write_obj(OutputFile& file, const scenes::Skeleton& skeleton, const scenes::Character& character,
               std::uint32_t frame, const std::array<double, 3>& origin);

}  // namespace cab::perf
