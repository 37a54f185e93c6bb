// Names of what a recording's hits are about.
#pragma once

#include <cab/replay.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace cab::perf {

// The batch of a frame that hits call by this slot: its index. Throws std::runtime_error if the frame has none.
std::uint32_t batch_of(const record::Recording& recording, const record::RecordedFrame& frame, BatchSlot slot);

// An instance by what is known of it: its batch's name, or "batch" and its index; if the batch has several instances,
// with its own name or its number.
std::string instance_name(std::string_view batch_name, std::uint32_t batch, std::uint32_t instance_count,
                          std::string_view own_name, std::uint32_t instance);
std::string instance_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t instance);

// A link by its own name, or as "link" and its number. That of a static body is "body".
std::string link_name(bool is_static, std::string_view own_name, std::uint32_t link);
std::string link_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t link);

// The names of an articulation's links: one per link, or none. A level of detail without names has those of what it is
// a level of.
Span<const char* const> link_names(const record::Recording& recording, std::uint32_t articulation);

}  // namespace cab::perf
