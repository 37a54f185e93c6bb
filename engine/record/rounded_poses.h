// Poses in 16 bits per number: a quaternion times 32767, and a translation in steps of one length.
#pragma once

#include <cab/span.h>

#include <cstdint>
#include <vector>

namespace cab::record {

// 0, or a power of two of which float holds all multiples and quotients that are needed here.
bool is_step(float step);

// The steps of poses of 7 floats. A pose for which the engine masks its instance may become 7 zeros: it masks it for a
// quaternion of length 0, too. False if another pose is not exactly that of its steps.
bool to_steps(const std::vector<float>& poses, float step, std::vector<std::int16_t>& steps);

// And back.
void from_steps(Span<const std::int16_t> steps, float step, std::vector<float>& poses);

}  // namespace cab::record
