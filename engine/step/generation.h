// Tables that are emptied at once: an entry counts only in the generation that it names.
#pragma once

#include <cab/span.h>

#include <cstdint>

namespace cab {

// Empties a table by starting its next generation. Only when the number wraps, once in 2^32 calls, are the entries
// written.
template <class Entry>
void begin_generation(std::uint32_t& generation, Span<Entry> entries) {
  if (++generation != 0) return;
  for (Entry& entry : entries) entry = {};
  generation = 1;
}

}  // namespace cab
