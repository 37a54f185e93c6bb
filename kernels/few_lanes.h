// How few lanes of a tile are read one by one: a transpose moves all sixteen.
#pragma once

#include <cstdint>

namespace cab::kernel {

inline constexpr std::uint32_t kFewLanes = 2;

}  // namespace cab::kernel
