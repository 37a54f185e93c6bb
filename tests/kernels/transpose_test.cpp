// Transposes: rows to columns and back, for every vector type.
#include "kernels/transpose.h"

#include "tests/kernels/vector_probe.h"

#include <doctest/doctest.h>

namespace cab::tests {
namespace {

// A number for float k of row r. All are different.
float at(std::uint32_t r, std::uint32_t k) { return static_cast<float>(100 * r + k + 1); }

}  // namespace

TEST_CASE("rows of sixteen floats become sixteen vectors, and vectors rows, on every instruction set") {
  for (const IsaProbe& probe : available_probes()) {
    CAPTURE(static_cast<int>(probe.isa));
    alignas(64) float rows[kLanes][16], back[kLanes][16], columns[16 * kLanes];
    const float* from[kLanes];
    float* to[kLanes];
    for (std::uint32_t r = 0; r < probe->width; ++r) {
      const std::uint32_t place = probe->width - 1 - r;  // rows may begin at any float
      from[r] = rows[place];
      to[r] = back[place];
      for (std::uint32_t k = 0; k < 16; ++k) rows[place][k] = at(r, k);
    }
    probe->load_transposed(from, columns);
    for (std::uint32_t k = 0; k < 16; ++k)
      for (std::uint32_t r = 0; r < probe->width; ++r) CHECK(columns[k * probe->width + r] == at(r, k));
    probe->store_transposed(columns, to);
    for (std::uint32_t r = 0; r < probe->width; ++r)
      for (std::uint32_t k = 0; k < 16; ++k) CHECK(to[r][k] == at(r, k));
  }
}

TEST_CASE("four floats of unaligned rows become four arrays in the rows' order, on every instruction set") {
  for (const IsaProbe& probe : available_probes()) {
    CAPTURE(static_cast<int>(probe.isa));
    alignas(64) float rows[kLanes][5], out[4][kLanes];
    const float* from[kLanes];
    for (std::uint32_t r = 0; r < probe->quad_rows; ++r) {
      from[r] = rows[r] + 1;
      for (std::uint32_t k = 0; k < 4; ++k) rows[r][1 + k] = at(r, k);
    }
    float* const to[4] = {out[0], out[1], out[2], out[3]};
    probe->transpose_quads(from, to);
    for (std::uint32_t r = 0; r < probe->quad_rows; ++r)
      for (std::uint32_t k = 0; k < 4; ++k) CHECK(out[k][r] == at(r, k));
  }
}

}  // namespace cab::tests
