// Articulations: what is refused and why, what is kept bit for bit, and what is mended.
#include "layout/articulation.h"

#include "layout/arena.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/random.h"
#include "tests/layout/joints_from.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace {

using namespace cab;
using oracle::Quad;
using oracle::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr Box kUnitBox = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};

// A chain of three links with a unit box each. The description is accepted; tests change it.
struct Draft {
  std::vector<std::int32_t> parents = {-1, 0, 1};
  std::vector<float> joints;
  std::vector<Leaf> leaves = {{0, kUnitBox, {}}, {1, kUnitBox, {}}, {2, kUnitBox, {}}};
  std::vector<LinkPair> ignored;

  ArticulationDesc desc() const { return {parents, joints, leaves, ignored}; }
};

constexpr std::uint32_t kUntouched = 77777;

// Builds a description that must be refused, and checks that nothing is written.
void check_refused(const ArticulationDesc& desc, Status status, std::uint32_t element) {
  Arena arena(default_allocator());
  Articulation out, before;
  std::memset(static_cast<void*>(&out), 0x5a, sizeof(out));
  std::memcpy(static_cast<void*>(&before), static_cast<const void*>(&out), sizeof(out));
  std::uint32_t bad_element = kUntouched;
  CHECK(build_articulation(desc, arena, &out, &bad_element) == status);
  CHECK(bad_element == element);
  CHECK(std::memcmp(static_cast<const void*>(&out), static_cast<const void*>(&before), sizeof(out)) == 0);
  CHECK(build_articulation(desc, arena, &out, nullptr) == status);  // the element is optional
}

Status build(const Draft& draft, Arena& arena, Articulation* out) {
  std::uint32_t bad_element = kUntouched;
  const Status status = build_articulation(draft.desc(), arena, out, &bad_element);
  CHECK((status != Status::kOk || bad_element == kUntouched));
  return status;
}

Status status_of(const Draft& draft) {
  Arena arena(default_allocator());
  Articulation out;
  return build(draft, arena, &out);
}

// The box with its axes rounded from a random rotation.
Box random_box(Random& random) {
  Box box = kUnitBox;
  double axis[3][3];
  random.rotation(axis);
  for (int k = 0; k < 3; ++k) {
    box.center[k] = static_cast<float>(random.normal());
    box.half[k] = static_cast<float>(random.log_uniform(1e-3, 10));
    for (int c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[k][c]);
  }
  return box;
}

oracle::OracleBox<float> oracle_box(const Box& box) {
  oracle::OracleBox<float> out;
  static_assert(sizeof(out) == sizeof(box));
  std::memcpy(&out, &box, sizeof(out));
  return out;
}

}  // namespace

TEST_CASE("links must be a non-empty list of parents before children, the first without a parent") {
  Draft draft;
  draft.parents.clear();
  check_refused(draft.desc(), Status::kNoLinks, 0);
  draft.parents.assign(kMaxLinks + 1, 0);
  draft.parents[0] = -1;
  check_refused(draft.desc(), Status::kTooManyLinks, kMaxLinks);
  const Draft whole;
  ArticulationDesc no_data = whole.desc();
  no_data.link_parents.data = nullptr;
  check_refused(no_data, Status::kNoLinks, 0);

  const std::vector<std::vector<std::int32_t>> wrong = {{0, 0, 1},   {-2, 0, 1}, {-1, 1, 1},
                                                        {-1, -2, 1}, {-1, 0, 2}, {-1, 0, 70000}};
  const std::uint32_t element[] = {0, 0, 1, 1, 2, 2};
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    CAPTURE(i);
    draft.parents = wrong[i];
    check_refused(draft.desc(), Status::kBadParent, element[i]);
  }
}

TEST_CASE("joints must be empty, or one finite point per link") {
  for (const std::size_t count : {1u, 8u, 10u}) {
    Draft draft;
    draft.joints.assign(count, 0.0f);
    check_refused(draft.desc(), Status::kBadJoint, 0);
  }
  for (const float bad : {kNan, kInfinity, -kInfinity, 2 * kMaxCoordinate}) {
    Draft draft;
    draft.joints.assign(9, 0.0f);
    draft.joints[5] = bad;
    check_refused(draft.desc(), Status::kBadJoint, 1);
  }
  const Draft whole;
  ArticulationDesc no_data = whole.desc();
  no_data.link_joints = {nullptr, 9};
  check_refused(no_data, Status::kBadJoint, 0);
}

TEST_CASE("leaves must be 1 to 1024, each on a link that exists") {
  Draft draft;
  draft.leaves.clear();
  check_refused(draft.desc(), Status::kNoLeaves, 0);
  draft.leaves.assign(kMaxLeaves + 1, {0, kUnitBox, {}});
  check_refused(draft.desc(), Status::kTooManyLeaves, kMaxLeaves);
  draft.leaves.pop_back();
  CHECK(status_of(draft) == Status::kOk);
  for (const std::uint32_t link : {3u, 65536u, 0xffffffffu}) {
    draft = Draft();
    draft.leaves[2].link = link;
    check_refused(draft.desc(), Status::kBadLeafLink, 2);
  }
  const Draft whole;
  ArticulationDesc no_data = whole.desc();
  no_data.leaves.data = nullptr;
  check_refused(no_data, Status::kNoLeaves, 0);
}

TEST_CASE("a leaf box must be finite, within range, and have no negative half extent") {
  for (const float bad : {kNan, kInfinity, -kInfinity, 2 * kMaxCoordinate}) {
    for (int c = 0; c < 3; ++c) {
      CAPTURE(bad);
      Draft draft;
      draft.leaves[1].box.center[c] = bad;
      check_refused(draft.desc(), Status::kBadLeafBox, 1);
      draft = Draft();
      draft.leaves[1].box.half[c] = bad;
      check_refused(draft.desc(), Status::kBadLeafBox, 1);
    }
  }
  Draft draft;
  draft.leaves[2].box.half[0] = -1e-30f;
  check_refused(draft.desc(), Status::kBadLeafBox, 2);
}

TEST_CASE("boxes without thickness and with a half extent of minus zero are accepted, and no sign is kept") {
  Draft draft;
  draft.leaves[0].box.half[0] = -0.0f;
  for (float& half : draft.leaves[1].box.half) half = 0;
  Arena arena(default_allocator());
  Articulation out;
  REQUIRE(build(draft, arena, &out) == Status::kOk);
  CHECK_FALSE(std::signbit(out.leaf_box[0].half[0]));
}

TEST_CASE("axes that are mirrored, scaled, skewed by more than 1e-5 or not finite are refused") {
  const auto refuse = [](void (*spoil)(Box&)) {
    Draft draft;
    Random random(3);
    draft.leaves[1].box = random_box(random);
    spoil(draft.leaves[1].box);
    check_refused(draft.desc(), Status::kBadLeafAxes, 1);
  };
  refuse([](Box& box) {
    for (float& v : box.axis[2]) v = -v;
  });                                                             // mirrored
  refuse([](Box& box) { std::swap(box.axis[0], box.axis[1]); });  // left-handed
  refuse([](Box& box) {
    for (float& v : box.axis[0]) v *= 1.0001f;
  });  // scaled
  refuse([](Box& box) {
    for (int c = 0; c < 3; ++c) box.axis[0][c] += 2e-5f * box.axis[1][c];
  });  // skewed
  refuse([](Box& box) {
    for (float& v : box.axis[1]) v = 0;
  });
  refuse([](Box& box) { box.axis[1][1] = kNan; });
  refuse([](Box& box) { box.axis[0][2] = kInfinity; });
}

TEST_CASE("axes orthonormal to rounding are kept bit for bit") {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Draft draft;
    draft.leaves[0].box = random_box(random);
    Arena arena(default_allocator());
    Articulation out;
    REQUIRE(build(draft, arena, &out) == Status::kOk);
    CHECK(std::memcmp(&out.leaf_box[0], &draft.leaves[0].box, sizeof(Box)) == 0);
  }
}

TEST_CASE("axes that drifted by 4 u to 1e-5 are made orthonormal, and the box grows over its former corners") {
  int mended = 0;
  double worst = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Draft draft;
    Box& box = draft.leaves[1].box;
    box = random_box(random);
    const double drift = random.log_uniform(2e-7, 4e-6);
    for (auto& axis : box.axis)
      for (float& v : axis) v = static_cast<float>(static_cast<double>(v) + drift * random.uniform(-1, 1));
    const double error = oracle::orthonormality_error(oracle_box(box));
    if (!(error > 4 * oracle::kFloatRoundoff && error < 9.9e-6)) continue;
    ++mended;
    Arena arena(default_allocator());
    Articulation out;
    REQUIRE(build(draft, arena, &out) == Status::kOk);
    const oracle::OracleBox<float> got = oracle_box(out.leaf_box[1]);
    CHECK(oracle::orthonormality_error(got) <= 2 * oracle::kFloatRoundoff);
    const auto verdict = oracle::judge_containment_exactly(got, oracle::convert<Quad>(oracle_box(box)));
    CHECK(verdict.inside);
    for (int k = 0; k < 3; ++k)  // and the box grows by little
      worst = std::max(
          worst, (static_cast<double>(got.half[k]) * (1 - oracle::kFloatRoundoff) - static_cast<double>(box.half[k])) /
                     (error * oracle::half_sum(oracle::convert<double>(got))));
  }
  CHECK(mended > 500);
  CHECK(worst < 4.1);  // 4 times the drift, and the rounding of the half extent itself
}

TEST_CASE("ignored pairs must name links that exist, and hold whatever their order") {
  for (const LinkPair pair : {LinkPair{3, 0}, LinkPair{0, 3}, LinkPair{0xffffffffu, 1}}) {
    Draft draft;
    draft.ignored = {{0, 1}, pair};
    check_refused(draft.desc(), Status::kBadIgnoredPair, 1);
  }
  const Draft whole;
  ArticulationDesc no_data = whole.desc();
  no_data.ignored_pairs = {nullptr, 1};
  check_refused(no_data, Status::kBadIgnoredPair, 0);

  Draft draft;
  draft.ignored = {{2, 0}, {2, 0}};
  Arena arena(default_allocator());
  Articulation out;
  REQUIRE(build(draft, arena, &out) == Status::kOk);
  for (std::uint32_t a = 0; a < 3; ++a)
    for (std::uint32_t b = 0; b < 3; ++b) CHECK(is_ignored(out, a, b) == (a == b || a + b == 2));
}

TEST_CASE("every ignored pair has its two bits and no other pair has any, whatever the reason") {
  std::size_t ignored = 0, left = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Draft draft;
    const std::uint32_t links = 1 + random.index(70);
    draft.parents.clear();
    draft.leaves.clear();
    for (std::uint32_t link = 0; link < links; ++link) {
      draft.parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(random.index(link)));
      draft.leaves.push_back({link, kUnitBox, {}});
    }
    const auto some_pairs = [&] {
      std::vector<LinkPair> pairs(random.index(links + 1));
      for (LinkPair& pair : pairs) pair = {random.index(links), random.index(links)};
      return pairs;
    };
    draft.ignored = some_pairs();
    ArticulationDesc desc = draft.desc();
    desc.ignored_hops = random.index(4);
    const std::vector<LinkPair> at_rest = some_pairs();
    Arena arena(default_allocator());
    Articulation out;
    REQUIRE(build_articulation(desc, arena, &out, nullptr) == Status::kOk);
    ignore_at_rest(at_rest, arena, out);

    std::vector<unsigned> reasons(links * links, 0);
    const auto note = [&](std::uint32_t a, std::uint32_t b, unsigned reason) {
      if (a != b) reasons[a * links + b] |= reason, reasons[b * links + a] |= reason;
    };
    for (const LinkPair& pair : draft.ignored) note(pair.a, pair.b, kIgnoredExplicitly);
    for (const LinkPair& pair : at_rest) note(pair.a, pair.b, kIgnoredAtRest);
    for (std::uint32_t a = 0; a < links; ++a) {
      const std::vector<std::uint32_t> joints = oracle::joints_from(draft.parents, a);
      for (std::uint32_t b = 0; b < links; ++b)
        if (joints[b] <= desc.ignored_hops) note(a, b, kIgnoredByHops);
    }
    std::size_t listed = 0;
    for (std::uint32_t a = 0; a < links; ++a)
      for (std::uint32_t b = 0; b < links; ++b) {
        CHECK(is_ignored(out, a, b) == (a == b || reasons[a * links + b] != 0));
        if (a >= b) continue;
        ++(reasons[a * links + b] ? ignored : left);
        if (reasons[a * links + b] == 0) continue;
        REQUIRE(listed < out.ignored_pairs.size);
        const IgnoredPair& pair = out.ignored_pairs[listed++];
        CHECK(pair.a == a);
        CHECK(pair.b == b);
        CHECK(pair.reasons == reasons[a * links + b]);
      }
    CHECK(listed == out.ignored_pairs.size);
  }
  CHECK(ignored > 1000);
  CHECK(left > 1000);
}

TEST_CASE("an articulation owns copies of all it was given") {
  Draft draft;
  draft.joints.assign(9, 0.5f);
  const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::vector<float> passed = vertices;
  ConvexPart part;
  part.kind = ShapeKind::kConvexHull;
  part.vertices = passed;
  std::vector<ConvexPart> parts = {part};
  draft.leaves[1].parts = parts;
  Arena arena(default_allocator());
  Articulation out;
  REQUIRE(build(draft, arena, &out) == Status::kOk);
  std::fill(passed.begin(), passed.end(), 9.0f);
  parts[0].kind = ShapeKind::kBox;
  draft.parents.assign(3, 7);
  draft.joints.assign(9, 7.0f);
  draft.leaves.assign(3, {});
  CHECK(out.link_parent[2] == 1);
  CHECK(out.link_joint[8] == 0.5f);
  CHECK(out.leaf_link[2] == 2);
  CHECK(out.leaf_box[2].half[0] == 1);
  REQUIRE(out.leaf_part_begin.size == 4);
  CHECK(out.leaf_part_begin[1] == 0);
  CHECK(out.leaf_part_begin[2] == 1);
  REQUIRE(out.parts.size == 1);
  CHECK(out.parts[0].kind == ShapeKind::kConvexHull);
  REQUIRE(out.parts[0].vertices.size == vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) CHECK(out.parts[0].vertices[i] == vertices[i]);
}

TEST_CASE("links are posed when leaves ride on them or a merge needs their joint, and leaves are grouped by link") {
  Draft draft;
  draft.parents = {-1, 0, 1, 2, 3, 0};
  draft.leaves = {{4, kUnitBox, {}}, {1, kUnitBox, {}}, {4, kUnitBox, {}}};  // merged at link 2's joint
  Arena arena(default_allocator());
  Articulation out;
  REQUIRE(build(draft, arena, &out) == Status::kOk);
  CHECK(out.node_count == 5);
  REQUIRE(out.posed_links.size == 3);
  CHECK(out.posed_links[0].link == 1);
  CHECK_FALSE(out.posed_links[0].needs_joint);
  CHECK(out.posed_links[1].link == 2);
  CHECK(out.posed_links[1].needs_joint);
  CHECK(out.posed_links[1].leaf_begin == out.posed_links[1].leaf_end);
  CHECK(out.posed_links[2].link == 4);
  REQUIRE(out.leaf_order.size == 3);
  CHECK(out.leaf_order[0] == 1);
  CHECK(out.leaf_order[1] == 0);
  CHECK(out.leaf_order[2] == 2);
}
