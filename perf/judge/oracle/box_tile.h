// Writes boxes of the oracles to the layouts that kernels read, and reads them back.
#pragma once

#include "layout/box_aos.h"
#include "perf/judge/oracle/oracle_box.h"

namespace cab::oracle {

// Writes one lane of a tile.
inline void put(BoxTile& tile, std::uint32_t lane, const OracleBox<float>& box) {
  for (std::size_t c = 0; c < 3; ++c) {
    tile.center[c][lane] = box.center[c];
    tile.half[c][lane] = box.half[c];
    for (std::size_t k = 0; k < 3; ++k) tile.axis[k][c][lane] = box.axis[k][c];
  }
}

// Reads one lane of a tile.
inline OracleBox<float> get(const BoxTile& tile, std::uint32_t lane) {
  OracleBox<float> box{};
  for (std::size_t c = 0; c < 3; ++c) {
    box.center[c] = tile.center[c][lane];
    box.half[c] = tile.half[c][lane];
    for (std::size_t k = 0; k < 3; ++k) box.axis[k][c] = tile.axis[k][c][lane];
  }
  return box;
}

// The box as a record.
inline BoxAos to_aos(const OracleBox<float>& box) {
  BoxAos out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out.center[c] = box.center[c];
    out.half[c] = box.half[c];
    for (std::size_t k = 0; k < 3; ++k) out.axis[3 * k + c] = box.axis[k][c];
  }
  return out;
}

}  // namespace cab::oracle
