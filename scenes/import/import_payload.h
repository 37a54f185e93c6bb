// What import reads as bytes, from a child process.
#pragma once

#include "scenes/import/import.h"
#include "scenes/import/trajectories.h"
#include "scenes/sandbox/payload.h"

#include <string>
#include <vector>

namespace cab::scenes {

// The texts that are next in a payload, each printable. Throws PayloadError.
std::vector<std::string> printable_texts(PayloadReader& reader);

std::string skeleton_payload(const Skeleton& skeleton);

// The skeleton in the bytes, which may be anything. Its arrays have the sizes that its joints and frames call for,
// joints come after their parents, and names and notes are printable. Throws PayloadError.
Skeleton read_skeleton_payload(const std::string& bytes);

std::string trajectories_payload(const Trajectories& trajectories);

// The same for trajectories: each track has one place and one heading per sample. Throws PayloadError.
Trajectories read_trajectories_payload(const std::string& bytes);

}  // namespace cab::scenes
