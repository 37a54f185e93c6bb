// What the tests of the vector type and of the transposes compute with each instruction set.
#pragma once

#include "kernels/find_kernels.h"
#include "layout/tile.h"

#include <cstdint>
#include <vector>

namespace cab::tests {

// Sixteen lanes of each operand. All vectors of one instruction set take them in kLanes / width steps.
struct alignas(64) VectorOperands {
  float a[kLanes], b[kLanes];
  double by[kLanes];
};

struct alignas(64) VectorResults {
  float sum[kLanes], product[kLanes], quotient[kLanes], root[kLanes], magnitude[kLanes];
  float least[kLanes], most[kLanes];  // min(a, b), max(a, b)
  float chosen[kLanes];               // select(a < b, a, b)
  float unaligned[kLanes];            // a, stored and loaded again at an unaligned address
  float difference[kLanes];           // of a and b by `by`
  std::uint32_t less, both, either;   // bits of a < b, and of that with a <= by rounded to float
};

// The functions of kernels/simd.h and kernels/transpose.h, compiled for one instruction set.
struct VectorProbe {
  std::uint32_t width;
  std::uint32_t quad_rows;
  void (*evaluate)(const VectorOperands&, VectorResults*);
  // width rows of 16 floats to 16 columns of width floats, one after the other, and back; all aligned.
  void (*load_transposed)(const float* const* rows, float* columns);
  void (*store_transposed)(const float* columns, float* const* rows);
  void (*transpose_quads)(const float* const* rows, float* const (&out)[4]);
};

struct IsaProbe {
  Isa isa;
  const VectorProbe* probe;
  const VectorProbe* operator->() const { return probe; }
};

// The probes of every instruction set of this build that this CPU runs. Scalar comes first.
std::vector<IsaProbe> available_probes();

}  // namespace cab::tests
