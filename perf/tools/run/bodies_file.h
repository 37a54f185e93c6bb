// The bodies of a figure as a JSON file that a person can change, and as a table.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "scenes/import/import.h"

namespace cab::perf {

// Reads the changes in a file that bodies_json or a person has written, with `sandbox` in a child process. Throws
// ImportError with the file, the entry and the reason.
std::vector<scenes::BodyChange> read_bodies(const std::string& path,
                                            const std::optional<scenes::SandboxLimits>& sandbox);

// Every body of a clip with its shape and size, also segments without a body. read_bodies takes it.
nlohmann::ordered_json bodies_json(const scenes::Skeleton& skeleton, const scenes::SkeletonBodies& bodies);

// The same as a table, below a line with the stature.
void print_bodies(const scenes::Skeleton& skeleton, const scenes::SkeletonBodies& bodies, std::ostream& out);

}  // namespace cab::perf
