// The vector type: in each lane, each operation has the bits of the scalar operation, on every instruction set.
#include "kernels/simd.h"

#include "kernels/isa_list.h"
#include "scenes/random.h"
#include "tests/kernels/vector_probe.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace cab::tests {

#define CAB_DECLARE(enumerator, name, V, runs) extern const VectorProbe probe_##name;
CAB_BUILT_ISAS(CAB_DECLARE)
#undef CAB_DECLARE

std::vector<IsaProbe> available_probes() {
#define CAB_ENTRY(enumerator, name, V, runs) {Isa::enumerator, &probe_##name},
  constexpr IsaProbe kBuilt[] = {CAB_BUILT_ISAS(CAB_ENTRY)};
#undef CAB_ENTRY
  std::vector<IsaProbe> out;
  for (const IsaProbe& one : kBuilt)
    if (kernel::find_kernels(one.isa)) out.push_back(one);
  return out;
}

namespace {

constexpr std::uint64_t kSeed = 77;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kOdd[] = {0.0f,    -0.0f, 1.0f,     -1.0f,  kInfinity, -kInfinity, kNan, 1e-45f,
                          -1e-40f, 3e38f, -3.4e38f, 1e-38f, 0x1p-126f, 16777216,   0.1f, -3.5f};

// Bits of two floats, where every NaN counts as one.
bool same(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)); }

void check(const VectorProbe& probe, const VectorOperands& in) {
  VectorResults got;
  probe.evaluate(in, &got);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const float a = in.a[lane], b = in.b[lane], limit = static_cast<float>(in.by[lane]);
    CAPTURE(lane);
    CAPTURE(a);
    CAPTURE(b);
    CHECK(same(got.sum[lane], a + b));
    CHECK(same(got.product[lane], a * b));
    CHECK(same(got.quotient[lane], a / b));
    CHECK(same(got.root[lane], std::sqrt(a)));
    CHECK(same(got.magnitude[lane], std::fabs(a)));
    CHECK(same(got.least[lane], a < b ? a : b));
    CHECK(same(got.most[lane], b < a ? a : b));
    CHECK(same(got.chosen[lane], a < b ? a : b));
    CHECK(same(got.unaligned[lane], a));
    CHECK(same(got.difference[lane],
               static_cast<float>((static_cast<double>(a) - static_cast<double>(b)) + in.by[lane])));
    CHECK((got.less >> lane & 1) == (a < b));
    CHECK((got.both >> lane & 1) == (a < b && a <= limit));
    CHECK((got.either >> lane & 1) == (a < b || a <= limit));
  }
}

}  // namespace

TEST_CASE("there is a vector type for every table of kernels, as wide as its registers") {
  const std::vector<IsaProbe> probes = available_probes();
  std::uint32_t tables = 0;
  for (std::uint32_t isa = 1; isa < kIsaCount; ++isa) tables += kernel::find_kernels(static_cast<Isa>(isa)) != nullptr;
  CHECK(probes.size() == tables);
  CHECK(probes[0].isa == Isa::kScalar);
  for (std::size_t i = 1; i < probes.size(); ++i) CHECK(probes[i]->width >= 2 * probes[i - 1]->width);
  CHECK(probes[0]->width == 1);
  CHECK(kLanes % probes.back()->width == 0);
}

TEST_CASE("every operation on zeros, denormals, infinities and NaN has the plain operation's bits in each lane") {
  for (const IsaProbe& probe : available_probes()) {
    CAPTURE(static_cast<int>(probe.isa));
    for (std::uint32_t turn = 0; turn < kLanes; ++turn) {  // each special number with each other one, in every lane
      VectorOperands in;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        in.a[lane] = kOdd[lane];
        in.b[lane] = kOdd[(lane + turn) % kLanes];
        in.by[lane] = static_cast<double>(kOdd[(lane + 5 * turn) % kLanes]);
      }
      check(*probe.probe, in);
    }
  }
}

TEST_CASE("every operation on random numbers has the plain operation's bits in each lane") {
  scenes::Random random(kSeed);
  for (int round = 0; round < 200; ++round) {
    VectorOperands in;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      in.a[lane] = static_cast<float>(random.uniform(-1, 1));
      in.b[lane] = static_cast<float>(random.uniform(-1, 1));
      in.by[lane] = 1e3 * random.uniform(-1, 1);
    }
    for (const IsaProbe& probe : available_probes()) {
      CAPTURE(static_cast<int>(probe.isa));
      check(*probe.probe, in);
    }
  }
}

}  // namespace cab::tests
