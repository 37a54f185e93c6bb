// Structs of the public API as the words of a recording: their memory, since they have no padding and machines are
// little-endian.
#pragma once

#include <cab/types.h>

#include <cstddef>

namespace cab::record {

inline constexpr std::size_t kHitWords = 6;
inline constexpr std::size_t kContactWords = 11;
inline constexpr std::size_t kBoxFloats = 15;
inline constexpr std::size_t kPlaceFloats = 10;  // of a part: position, rotation, size

static_assert(sizeof(Hit) == kHitWords * 4 && offsetof(Hit, batch_b) == 8 && offsetof(Hit, link_a) == 16);
static_assert(sizeof(Contact) == kContactWords * 4 && offsetof(Contact, point_a) == 16);
static_assert(offsetof(Contact, leaf_a) == 40);
static_assert(sizeof(Box) == kBoxFloats * 4 && offsetof(Box, axis) == 12 && offsetof(Box, half) == 48);
static_assert(sizeof(LinkPair) == 8);

}  // namespace cab::record
