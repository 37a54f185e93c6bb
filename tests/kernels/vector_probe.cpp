// Compiled once per instruction set, like the kernels: CAB_ISA is its name, CAB_PROBE that of its probe.
#include "tests/kernels/vector_probe.h"

#include "kernels/isa_vector.h"
#include "kernels/transpose.h"

namespace cab::tests {
namespace {

using V = kernel::IsaVector;
using kernel::kWidth;
using L = kernel::Lanes<V>;

void evaluate(const VectorOperands& in, VectorResults* out) {
  out->less = out->both = out->either = 0;
  alignas(64) float shifted[kLanes + 1], limit[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    shifted[lane + 1] = in.a[lane];
    limit[lane] = static_cast<float>(in.by[lane]);
  }
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const V a = L::load(in.a + lane), b = L::load(in.b + lane), c = L::load(limit + lane);
    L::store(out->sum + lane, a + b);
    L::store(out->product + lane, a * b);
    L::store(out->quotient + lane, kernel::divide(a, b));
    L::store(out->root + lane, kernel::sqrt(a));
    L::store(out->magnitude + lane, kernel::abs(a));
    L::store(out->least + lane, kernel::min(a, b));
    L::store(out->most + lane, kernel::max(a, b));
    L::store(out->chosen + lane, kernel::select(a < b, a, b));
    L::store(out->unaligned + lane, L::load_unaligned(shifted + 1 + lane));
    L::store(out->difference + lane, kernel::difference(a, b, in.by + lane));
    out->less |= kernel::bits(a < b) << lane;
    out->both |= kernel::bits(kernel::both(a < b, a <= c)) << lane;
    out->either |= kernel::bits(kernel::either(a < b, a <= c)) << lane;
  }
}

void load_transposed(const float* const* rows, float* columns) {
  V out[16];
  kernel::Transpose<V>::load(rows, out);
  for (std::uint32_t k = 0; k < 16; ++k) L::store(columns + k * kWidth<V>, out[k]);
}

void store_transposed(const float* columns, float* const* rows) {
  V in[16];
  for (std::uint32_t k = 0; k < 16; ++k) in[k] = L::load(columns + k * kWidth<V>);
  kernel::Transpose<V>::store(in, rows);
}

}  // namespace

extern const VectorProbe CAB_PROBE;
const VectorProbe CAB_PROBE = {kWidth<V>,       kernel::kQuadRows<V>, evaluate,
                               load_transposed, store_transposed,     kernel::transpose_quads<V>};

}  // namespace cab::tests
