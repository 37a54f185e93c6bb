// How much a table expands to when it is unpacked. FlatBuffers may share lists and texts, so that a small file would
// otherwise become a large one.
#pragma once

#include <recording_generated.h>

#include <cstdint>

namespace cab::record {

// Bytes of all lists and texts of a table, each as often as it is named.
std::uint64_t expanded_bytes(const format::Articulation& table);
std::uint64_t expanded_bytes(const format::Batch& table);

// What a payload may expand to.
inline std::uint64_t most_expanded_bytes(std::uint64_t payload_bytes) { return 8 * payload_bytes + 65536; }

}  // namespace cab::record
