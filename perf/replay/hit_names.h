// Names of what a recording's hits are about.
#pragma once

#include <cab/replay.h>

#include <cstdint>
#include <string>

namespace cab::perf {

// The batch of a frame that hits call by this slot: its index. Throws std::runtime_error if the frame has none.
std::uint32_t batch_of(const record::Recording& recording, const record::RecordedFrame& frame, BatchSlot slot);

// An instance: the batch's name, with the instance's name or number if the batch has several.
std::string instance_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t instance);

// A link: its name, or "link" and its number.
std::string link_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t link);

}  // namespace cab::perf
