// Exact::kSurface: leaves touch where their triangles do, judged in long double by every pair of triangles.
#include "perf/harness/world.h"
#include "perf/judge/oracle/random_skins.h"
#include "perf/judge/oracle/triangle_judge.h"
#include "tests/engine/hit_links.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <tuple>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Instances of a random skin near each other.
struct Crowd {
  static constexpr std::uint32_t kCount = 6;
  SkinRig rig;
  Poses poses;
  std::vector<double> origins;
  EnginePtr engine;
  ArticulationId articulation;
  BatchId batch;

  Crowd(Random& random, SkinRegime regime, const EngineDesc& desc = {}, BatchKind kind = BatchKind::kCharacters)
      : Crowd{random, random_skin(random, regime, 0.3),
              random.chance(0.5) ? PoseFormat::kMatrix3x4Rows : PoseFormat::kQuaternionTranslation, desc, kind} {}

  Crowd(Random& random, SkinRig of, PoseFormat format, const EngineDesc& desc = {},
        BatchKind kind = BatchKind::kCharacters)
      : rig(std::move(of)),
        poses(random_skin_poses(random, rig, kCount, format, 1, 0.1, 0.5)),
        engine(make_engine(desc)) {
    require(add_articulation(*engine, rig.desc(), &articulation));
    batch = add_instances(*engine, articulation, kCount, kind);
  }

  // Moves every instance to a place of its own, and its poses back by about as much.
  void move_origins(Random& random, double far) {
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const Vec3<double> by = far * rig.size * random.unit_vector();
      for (std::size_t c = 0; c < 3; ++c) origins.push_back(by[c]);
      for (std::uint32_t link = 0; link < poses.link_count; ++link) {
        float* const pose = poses.data.data() + (std::size_t{i} * poses.link_count + link) * poses.floats_per_pose();
        for (std::size_t c = 0; c < 3; ++c)
          pose[poses.format == PoseFormat::kQuaternionTranslation ? 4 + c : 4 * c + 3] -= static_cast<float>(by[c]);
      }
    }
  }

  BatchInput input() const {
    BatchInput out = poses.input(batch);
    out.origins = origins;
    return out;
  }

  std::vector<Hit> run(FrameJob job, FrameStats* stats = nullptr) const {
    const BatchInput input = this->input();
    const PairRule rules[] = {{batch, batch, Pairing::kBetween}, {batch, batch, Pairing::kWithin}};
    job.inputs = {&input, 1};
    job.rules = rules;
    std::vector<Hit> hits(4096);
    job.hits = hits;
    require(run_frame(*engine, job));
    hits.resize(job.hit_count);
    if (stats) *stats = job.stats;
    return hits;
  }
};

// A skin whose leaves one link each moves, in its frame. A large one has one leaf, of more than sixteen patches.
SkinRig rigid_rig(Random& random, bool is_large) {
  SkinRig out;
  do {
    out = random_skin(random, SkinRegime::kRigid, 0.3, is_large ? 300 : 20);
  } while (is_large && out.triangles[0].size() <= 3 * 256);
  if (is_large) {
    out.leaves.resize(1);
    out.triangles.resize(1);
    out.triangles[0].resize(std::size_t{3} * 257);
    out.leaves[0].triangles = out.triangles[0];
  }
  out.inverse_bind.clear();
  for (auto& turn : out.bound_turn) turn = {0, 0, 0, 1};
  for (auto& at : out.bound_at) at = {};
  return out;
}

using TrianglePair = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;

// Every two links with leaves of a crowd.
std::vector<Hit> pairs_of(const Crowd& crowd) {
  std::vector<Hit> out;
  std::set<std::uint32_t> with_leaves;
  for (const Leaf& leaf : crowd.rig.leaves) with_leaves.insert(leaf.link);
  for (std::uint32_t i = 0; i < Crowd::kCount; ++i)
    for (std::uint32_t k = i; k < Crowd::kCount; ++k)
      for (const std::uint32_t a : with_leaves)
        for (const std::uint32_t b : with_leaves)
          if (i < k || a < b)
            out.push_back({slot_of(crowd.batch), i, slot_of(crowd.batch), k, static_cast<std::uint16_t>(a),
                           static_cast<std::uint16_t>(b), 0, 0});
  return out;
}

struct PlacedLeaf {
  std::uint32_t instance, link;
  std::vector<Triangle<Real>> triangles;
  Point lo, hi;
};

std::vector<PlacedLeaf> placed_leaves(const Crowd& crowd) {
  std::vector<PlacedLeaf> out;
  const ArticulationDesc desc = crowd.rig.desc();
  for (std::uint32_t i = 0; i < Crowd::kCount; ++i) {
    const std::vector<ExactPose> exact = exact_poses(crowd.poses, i);
    for (std::size_t leaf = 0; leaf < crowd.rig.leaves.size(); ++leaf) {
      PlacedLeaf one = {i, crowd.rig.leaves[leaf].link, {}, {}, {}};
      for (std::size_t c = 0; c < 3; ++c) {
        one.lo[c] = HUGE_VALL;
        one.hi[c] = -HUGE_VALL;
      }
      const std::vector<std::uint32_t>& corners = crowd.rig.triangles[leaf];
      for (std::size_t t = 0; t < corners.size(); t += 3) {
        Triangle<Real> triangle;
        for (std::size_t k = 0; k < 3; ++k) {
          triangle.corner[k] = skinned_vertex(desc.skin, exact, corners[t + k]);
          for (std::size_t c = 0; c < 3 && !crowd.origins.empty(); ++c)
            triangle.corner[k][c] += crowd.origins[3 * std::size_t{i} + c];
          for (std::size_t c = 0; c < 3; ++c) {
            one.lo[c] = std::min(one.lo[c], triangle.corner[k][c]);
            one.hi[c] = std::max(one.hi[c], triangle.corner[k][c]);
          }
        }
        one.triangles.push_back(triangle);
      }
      out.push_back(one);
    }
  }
  return out;
}

// The triangles of pairs of links that meet.
std::vector<TrianglePair> touching_of(const Crowd& crowd, const std::vector<Hit>& pairs) {
  std::vector<TrianglePair> out;
  const std::vector<PlacedLeaf> leaves = placed_leaves(crowd);
  const std::size_t each = crowd.rig.leaves.size();
  for (std::uint32_t p = 0; p < pairs.size(); ++p)
    for (std::uint32_t a = 0; a < each; ++a)
      for (std::uint32_t b = 0; b < each; ++b) {
        const PlacedLeaf &of_a = leaves[pairs[p].instance_a * each + a], &of_b = leaves[pairs[p].instance_b * each + b];
        if (of_a.link != pairs[p].link_a || of_b.link != pairs[p].link_b) continue;
        for (std::uint32_t x = 0; x < of_a.triangles.size(); ++x)
          for (std::uint32_t y = 0; y < of_b.triangles.size(); ++y)
            if (meet(of_a.triangles[x], of_b.triangles[y])) out.push_back({p, a, b, x, y});
      }
  return out;
}

// What find_touching_triangles lists, which is as long as expected.
std::vector<TouchingTriangles> found_triangles(Engine& engine, const BatchInput& input, const std::vector<Hit>& pairs,
                                               std::size_t expected) {
  std::vector<TouchingTriangles> out(expected + 1);
  std::size_t size = 0;
  REQUIRE(find_touching_triangles(engine, {&input, 1}, pairs, out, &size) == Status::kOk);
  REQUIRE(size == expected);
  out.resize(size);
  return out;
}

void check_triangles(const std::vector<TouchingTriangles>& found, const std::vector<TrianglePair>& truth) {
  for (std::size_t i = 0; i < found.size(); ++i)
    CHECK(truth[i] ==
          TrianglePair(found[i].pair, found[i].leaf_a, found[i].leaf_b, found[i].triangle_a, found[i].triangle_b));
}

bool same_bytes(const std::vector<TouchingTriangles>& a, const std::vector<TouchingTriangles>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

// The least distance of the triangles of each two links, of those whose bounds are within `reach`.
std::map<HitLinks, Real> distances_of(const Crowd& crowd, Real reach) {
  std::map<HitLinks, Real> out;
  const std::vector<PlacedLeaf> leaves = placed_leaves(crowd);
  for (std::size_t x = 0; x < leaves.size(); ++x)
    for (std::size_t y = x + 1; y < leaves.size(); ++y) {
      const PlacedLeaf &a = leaves[x], &b = leaves[y];
      if (a.instance == b.instance && a.link == b.link) continue;
      bool near = true;
      for (std::size_t c = 0; c < 3; ++c) near = near && a.lo[c] <= b.hi[c] + reach && b.lo[c] <= a.hi[c] + reach;
      if (!near) continue;
      const bool swap = a.instance == b.instance && b.link < a.link;
      const HitLinks name = {a.instance, b.instance, swap ? b.link : a.link, swap ? a.link : b.link};
      for (const Triangle<Real>& s : a.triangles)
        for (const Triangle<Real>& t : b.triangles) {
          const auto found = out.emplace(name, HUGE_VALL).first;
          found->second = std::min(found->second, distance(s, t));
        }
    }
  return out;
}

// How large the numbers of a crowd are.
Real size_of(const Crowd& crowd) {
  Real out = 0;
  for (const PlacedLeaf& leaf : placed_leaves(crowd))
    for (std::size_t c = 0; c < 3; ++c) out = std::max({out, std::fabs(leaf.lo[c]), std::fabs(leaf.hi[c])});
  return out;
}

// A static body. A hull is one of a box.
struct Obstacle {
  StaticBody body;
  ConvexPart part;
  std::vector<float> vertices;

  // How far a triangle is from it.
  Real distance_to(const Triangle<Real>& triangle) const {
    Real column[3][3], q[4];
    std::copy_n(body.rotation, 4, q);
    quaternion_matrix(q, column);
    Triangle<Real> at{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          at.corner[i][k] += column[k][c] * (triangle.corner[i][c] - static_cast<Real>(body.origin[c]));
    const Point size{{part.size[0], part.size[1], part.size[2]}}, along{{0, 0, size[1]}};
    switch (part.kind) {
      case ShapeKind::kSphere: return distance(at, {{Point{}, Point{}, Point{}}}) - size[0];
      case ShapeKind::kCapsule: return distance(at, {{Real{-1} * along, along, along}}) - size[0];
      case ShapeKind::kHalfSpace: return std::min({at.corner[0][2], at.corner[1][2], at.corner[2][2]});
      default: return distance_to_box(at, size);
    }
  }
};

Obstacle random_obstacle(Random& random, unsigned kind, const Point& at, double size) {
  constexpr ShapeKind kKinds[] = {ShapeKind::kSphere, ShapeKind::kCapsule, ShapeKind::kBox, ShapeKind::kHalfSpace,
                                  ShapeKind::kConvexHull};
  Obstacle out;
  for (std::size_t c = 0; c < 3; ++c) out.body.origin[c] = static_cast<double>(at[c]);
  for (float& turn : out.body.rotation) turn = static_cast<float>(random.uniform(-1, 1));
  for (float& length : out.part.size) length = static_cast<float>(size * random.uniform(0.02, 0.2));
  const float* const lengths = out.part.size;
  std::fill_n(out.body.box.half, 3, lengths[0] + lengths[1] + lengths[2]);
  out.part.kind = kKinds[kind];
  if (out.part.kind == ShapeKind::kConvexHull)
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t c = 0; c < 3; ++c) out.vertices.push_back(i >> c & 1 ? lengths[c] : -lengths[c]);
  if (out.part.kind == ShapeKind::kHalfSpace)
    std::fill_n(out.body.box.half, 3, static_cast<float>(1000 * size));  // it counts where its box is
  return out;
}

}  // namespace

TEST_CASE("links of skins touch where their triangles do, with and without a margin") {
  Random random(170);
  std::size_t touching = 0, apart = 0;
  const std::uint64_t count = rounds(60);
  for (std::uint64_t round = 0; round < count; ++round) {
    Crowd crowd(random, static_cast<SkinRegime>(round % kSkinRegimeCount));
    // Two frames on one engine: what was skinned for the first is nothing to the second.
    for (int frame = 0; frame < 2; ++frame) {
      if (frame == 1) {
        crowd.poses = random_skin_poses(random, crowd.rig, Crowd::kCount, PoseFormat::kMatrix3x4Rows, 1, 0.1, 0.5);
        // With orientations or scales the poses that are moved back would be turned and scaled too.
        if (crowd.poses.orientations.empty() && crowd.poses.scales.empty()) crowd.move_origins(random, 10);
      }
      const Real size = size_of(crowd);
      FrameJob job;
      job.policies.exact = Exact::kSurface;
      if (round % 2 == 1) job.margin = static_cast<float>(size * Real{0.02});
      const std::map<HitLinks, Real> distances = distances_of(crowd, 2 * Real{job.margin} + size / 1000);
      const std::set<HitLinks> hits = links_of(crowd.run(job));
      const Real slack = size * 1e-9L;
      for (const auto& [name, distance] : distances) {
        if (distance <= Real{job.margin} - (job.margin > 0 ? slack : 0)) CHECK(hits.count(name) == 1);
        if (distance > Real{job.margin} + slack) CHECK(hits.count(name) == 0);
        ++(distance <= Real{job.margin} ? touching : apart);
      }
      for (const HitLinks& hit : hits) CHECK(distances.count(hit) == 1);
    }
  }
  CHECK(touching >= least_count(600, 60));
  CHECK(apart >= least_count(600, 60));
}

TEST_CASE("leaves that one link moves are not skinned, and their triangles touch where they are given") {
  Random random(190);
  std::size_t touching = 0, triangles = 0;
  const std::uint64_t count = rounds(24);
  for (std::uint64_t round = 0; round < count; ++round) {
    const bool is_large = round % 12 == 0;
    Crowd crowd(random, rigid_rig(random, is_large), PoseFormat::kQuaternionTranslation);
    if (crowd.poses.orientations.empty() && crowd.poses.scales.empty()) crowd.move_origins(random, 10);
    const Real size = size_of(crowd);
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    if (round % 2 == 1) job.margin = static_cast<float>(size * Real{0.02});
    FrameStats stats;
    const std::set<HitLinks> hits = links_of(crowd.run(job, &stats));
    CHECK(stats.leaves_skinned == 0);
    touching += hits.size();
    const Real slack = size * 1e-9L;
    // Of large leaves only triangles are looked at, which takes less.
    if (!is_large)
      for (const auto& [name, distance] : distances_of(crowd, 2 * Real{job.margin} + size / 1000)) {
        if (distance <= Real{job.margin} - (job.margin > 0 ? slack : 0)) CHECK(hits.count(name) == 1);
        if (distance > Real{job.margin} + slack) CHECK(hits.count(name) == 0);
      }
    const std::vector<Hit> pairs = pairs_of(crowd);
    const std::vector<TrianglePair> truth = touching_of(crowd, pairs);
    const BatchInput input = crowd.input();
    const std::vector<TouchingTriangles> found = found_triangles(*crowd.engine, input, pairs, truth.size());
    check_triangles(found, truth);
    triangles += found.size();
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      const EnginePtr engine = make_engine(desc);
      ArticulationId articulation;
      require(add_articulation(*engine, crowd.rig.desc(), &articulation));
      BatchInput other = input;
      other.batch = add_instances(*engine, articulation, Crowd::kCount);
      REQUIRE(slot_of(other.batch) == slot_of(crowd.batch));
      CHECK(same_bytes(found_triangles(*engine, other, pairs, found.size()), found));
    }
  }
  CHECK(touching >= least_count(50, 24));
  CHECK(triangles >= least_count(5000, 24));
}

// A corner of one triangle is a corner of another by exact numbers, and the two are on different sides of a plane of
// the second link's frame: bounds along its axes meet in one number, which rounding moves.
TEST_CASE("triangles of leaves that one link each moves touch in a corner, however far from their links") {
  Random random(191);
  const std::uint64_t count = rounds(400);
  for (std::uint64_t round = 0; round < count; ++round) {
    // In sixteenths, so that the sum of two is exact.
    const auto exact = [&](double most) { return std::round(16 * random.uniform(-most, most)) / 16; };
    const double far = random.chance(0.5) ? 8 : 4096;
    const Vec3<double> at_a = {exact(far), exact(far), exact(far)}, corner = {exact(far), exact(far), exact(far)};
    const double angle = random.uniform(0.5, 3);
    const Vec3<double> axis = std::sin(angle) * random.unit_vector();
    const auto turned = [&](const Vec3<double>& v) {
      const Vec3<double> across = 2.0 * cross(axis, v);
      return v + std::cos(angle) * across + cross(axis, across);
    };
    std::vector<float> vertices(18);
    for (std::size_t k = 0; k < 3; ++k) {
      // The corner of b is its link's origin, and the rest on one side of it; a is on the other side.
      const auto beyond = [&](double side) {
        return k == 0 ? Vec3<double>{} : Vec3<double>{side * random.uniform(0.1, 1), random.normal(), random.normal()};
      };
      const Vec3<double> a = corner + turned(beyond(-1)), b = beyond(1);
      for (std::size_t c = 0; c < 3; ++c) {
        vertices[3 * k + c] = static_cast<float>(a[c]);
        vertices[9 + 3 * k + c] = static_cast<float>(b[c]);
      }
    }
    const std::uint32_t indices[] = {0, 1, 2, 3, 4, 5}, links[] = {0, 0, 0, 1, 1, 1};
    const float weights[] = {1, 1, 1, 1, 1, 1};
    const std::int32_t parents[] = {-1, -1};
    Leaf leaves[2];
    leaves[1].link = 1;
    leaves[0].triangles = {indices, 3}, leaves[1].triangles = {indices + 3, 3};
    ArticulationDesc desc;
    desc.link_parents = parents, desc.leaves = leaves;
    desc.skin.vertices = vertices, desc.skin.influence_count = 1;
    desc.skin.influence_links = links, desc.skin.influence_weights = weights;
    std::vector<float> poses = {0, 0, 0, 1};
    for (std::size_t c = 0; c < 3; ++c) poses.push_back(static_cast<float>(at_a[c]));
    for (std::size_t c = 0; c < 3; ++c) poses.push_back(static_cast<float>(axis[c]));
    poses.push_back(static_cast<float>(std::cos(angle)));
    for (std::size_t c = 0; c < 3; ++c) poses.push_back(static_cast<float>(at_a[c] + corner[c]));
    const EnginePtr engine = make_engine({});
    ArticulationId articulation;
    require(add_articulation(*engine, desc, &articulation));
    BatchInput input;
    input.batch = add_instances(*engine, articulation, 1);
    input.poses.data = poses.data();
    const PairRule rule = {input.batch, input.batch, Pairing::kWithin};
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    Hit hit;
    job.hits = {&hit, 1};
    REQUIRE(run_frame(*engine, job) == Status::kOk);
    CHECK(job.hit_count == 1);
    CHECK(job.stats.leaves_skinned == 0);
  }
}

TEST_CASE("surfaces that coincide touch, wherever their origins are") {
  Random random(178);
  std::size_t hits_seen = 0;
  const std::uint64_t count = rounds(40);
  for (std::uint64_t round = 0; round < count; ++round) {
    // The same pose twice, and origins whose difference is that of the poses: bit for bit one place.
    Crowd crowd(random, SkinRegime::kRigid);
    if (!crowd.poses.scales.empty() || !crowd.poses.orientations.empty()) continue;
    crowd.poses = random_skin_poses(random, crowd.rig, Crowd::kCount, PoseFormat::kMatrix3x4Rows, 1, 0, 0);
    crowd.poses.orientations.clear();
    crowd.poses.scales.clear();
    crowd.origins.assign(3 * Crowd::kCount, 0);
    const std::size_t each = std::size_t{crowd.poses.link_count} * crowd.poses.floats_per_pose();
    for (std::uint32_t i = 1; i < Crowd::kCount; ++i)
      std::copy_n(crowd.poses.data.begin(), each, crowd.poses.data.begin() + static_cast<std::ptrdiff_t>(i * each));
    for (std::uint32_t i = 0; i < Crowd::kCount; ++i) {
      const double by =
          std::ldexp(static_cast<double>(random.index(64)), -3) * std::exp2(std::round(std::log2(crowd.rig.size)));
      crowd.origins[3 * i] = by;
      for (std::uint32_t link = 0; link < crowd.poses.link_count; ++link) {
        float& x = crowd.poses.data[i * each + link * crowd.poses.floats_per_pose() + 3];
        x = static_cast<float>(static_cast<double>(x) - by);
      }
    }
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    const std::map<HitLinks, Real> distances = distances_of(crowd, size_of(crowd) / 1000);
    const std::set<HitLinks> hits = links_of(crowd.run(job));
    for (const auto& [name, distance] : distances)
      if (distance == 0) CHECK(hits.count(name) == 1);
    hits_seen += hits.size();
  }
  CHECK(hits_seen >= least_count(50, 40));
}

TEST_CASE("hits on surfaces are the same by every strategy, instruction set and number of threads, and in sequences") {
  Random random(171);
  std::size_t seen = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    const auto regime = static_cast<SkinRegime>(round % kSkinRegimeCount);
    const Random again = random;
    const Crowd crowd(random, regime);
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    const std::vector<Hit> first = crowd.run(job);
    seen += first.size();
    for (const Strategy strategy : {Strategy::kBrute, Strategy::kRows, Strategy::kLinks, Strategy::kTree}) {
      FrameJob other = job;
      other.policies.strategy = strategy;
      CHECK(links_of(crowd.run(other)) == links_of(first));
    }
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 3u}) {
        EngineDesc desc;
        desc.isa = isa;
        desc.thread_count = threads;
        Random same = again;
        const std::vector<Hit> hits = Crowd(same, regime, desc).run(job);
        REQUIRE(hits.size() == first.size());
        CHECK((hits.empty() || std::memcmp(hits.data(), first.data(), hits.size() * sizeof(Hit)) == 0));
      }
    // Any instance in contact is one that has a hit.
    std::vector<std::uint8_t> in_contact(Crowd::kCount);
    BatchInput input = crowd.poses.input(crowd.batch);
    input.in_contact = in_contact;
    const PairRule rules[] = {{crowd.batch, crowd.batch, Pairing::kBetween}};
    FrameJob contact = job;
    contact.inputs = {&input, 1};
    contact.rules = rules;
    contact.report = Report::kInContact;
    REQUIRE(run_frame(*crowd.engine, contact) == Status::kOk);
    for (std::uint32_t i = 0; i < Crowd::kCount; ++i)
      CHECK((in_contact[i] != 0) == std::any_of(first.begin(), first.end(), [i](const Hit& hit) {
              return hit.instance_a != hit.instance_b && (hit.instance_a == i || hit.instance_b == i);
            }));
    Random same = again;
    const Crowd sequence(same, regime, {}, BatchKind::kSequence);
    BatchInput frames = sequence.poses.input(sequence.batch);
    const PairRule rule = {sequence.batch, sequence.batch, Pairing::kWithin};
    FrameJob within = job;
    within.inputs = {&frames, 1};
    within.rules = {&rule, 1};
    std::vector<Hit> hits(4096);
    within.hits = hits;
    REQUIRE(run_frame(*sequence.engine, within) == Status::kOk);
    hits.resize(within.hit_count);
    std::vector<Hit> own;
    std::copy_if(first.begin(), first.end(), std::back_inserter(own),
                 [](const Hit& hit) { return hit.instance_a == hit.instance_b; });
    CHECK(links_of(hits) == links_of(own));
  }
  CHECK(seen >= least_count(200, 20));
}

TEST_CASE("triangles touch balls, capsules, boxes, hulls, half spaces and static triangles where they are") {
  Random random(172);
  std::size_t touching = 0, apart = 0;
  const std::uint64_t count = rounds(60);
  for (std::uint64_t round = 0; round < count; ++round) {
    const Crowd crowd(random, static_cast<SkinRegime>(round % kSkinRegimeCount));
    const std::vector<PlacedLeaf> leaves = placed_leaves(crowd);
    // For shapes that are no triangles, triangles are rounded to floats.
    const Real size = size_of(crowd), slack = size * 1e-4L, slack_of_triangles = size * 1e-9L;
    const auto near_point = [&] {
      const PlacedLeaf& leaf = leaves[random.index(static_cast<unsigned>(leaves.size()))];
      const Point at = leaf.triangles[random.index(static_cast<unsigned>(leaf.triangles.size()))].corner[0];
      const Vec3<double> by = random.uniform(0, 0.2) * static_cast<double>(size) * random.unit_vector();
      return at + Point{{by[0], by[1], by[2]}};
    };
    std::vector<Obstacle> obstacles;
    for (unsigned i = 0; i < 15; ++i)
      obstacles.push_back(random_obstacle(random, i % 5, near_point(), static_cast<double>(size)));
    std::vector<StaticBody> bodies;
    for (Obstacle& one : obstacles) {
      one.part.vertices = one.vertices;
      one.body.parts = {&one.part, 1};
      bodies.push_back(one.body);
    }
    std::vector<float> vertices;
    std::vector<std::uint32_t> corners;
    std::vector<Triangle<Real>> triangles;
    for (std::uint32_t t = 0; t < 6; ++t) {
      Triangle<Real> triangle;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const Point at = near_point();
        for (std::size_t c = 0; c < 3; ++c) {
          vertices.push_back(static_cast<float>(at[c]));
          triangle.corner[k][c] = vertices.back();
        }
        corners.push_back(3 * t + k);
      }
      triangles.push_back(triangle);
    }
    StaticDesc level;
    level.bodies = bodies;
    level.vertices = vertices;
    level.triangles = corners;
    BatchId around;
    std::uint32_t bad = 0;
    REQUIRE(add_static_batch(*crowd.engine, level, &around, &bad) == Status::kOk);
    BatchInput inputs[2] = {crowd.poses.input(crowd.batch), {}};
    inputs[1].batch = around;
    const PairRule rule = {crowd.batch, around, Pairing::kBetween};
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    if (round % 2 == 1) job.margin = static_cast<float>(size * Real{0.02});
    job.inputs = inputs;
    job.rules = {&rule, 1};
    std::vector<Hit> hits(4096);
    job.hits = hits;
    REQUIRE(run_frame(*crowd.engine, job) == Status::kOk);
    hits.resize(job.hit_count);
    for (std::uint32_t i = 0; i < Crowd::kCount; ++i)
      for (std::uint32_t link = 0; link < crowd.rig.link_count(); ++link)
        for (std::uint32_t body = 0; body < bodies.size() + triangles.size(); ++body) {
          Real least = HUGE_VALL;
          for (const PlacedLeaf& leaf : leaves)
            if (leaf.instance == i && leaf.link == link)
              for (const Triangle<Real>& triangle : leaf.triangles)
                least = std::min(least, body < bodies.size() ? obstacles[body].distance_to(triangle)
                                                             : distance(triangle, triangles[body - bodies.size()]));
          const bool is_hit = std::any_of(hits.begin(), hits.end(), [&](const Hit& hit) {
            return hit.instance_a == i && hit.link_a == link && hit.instance_b == body;
          });
          const Real margin = job.margin, within = body < bodies.size() ? slack : slack_of_triangles;
          if (least <= margin - (margin > 0 ? within : 0)) CHECK(is_hit);
          if (least > margin + within) CHECK_FALSE(is_hit);
          ++(least <= margin ? touching : apart);
        }
  }
  CHECK(touching >= least_count(300, 60));
  CHECK(apart >= least_count(300, 60));
}

TEST_CASE("triangles touch hulls, cylinders and ellipsoids of scaled instances where these are") {
  const float corners[] = {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1, 0, 0, 1};
  for (const ShapeKind kind : {ShapeKind::kConvexHull, ShapeKind::kCylinder, ShapeKind::kEllipsoid}) {
    CAPTURE(static_cast<int>(kind));
    ConvexPart part;
    part.kind = kind;
    std::fill_n(part.size, 3, 1.0f);
    if (kind == ShapeKind::kConvexHull) part.vertices = corners;
    Leaf leaf;
    leaf.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};
    leaf.parts = {&part, 1};
    const std::int32_t root = -1;
    ArticulationDesc body;
    body.link_parents = {&root, 1};
    body.leaves = {&leaf, 1};
    SkinRig rig;
    rig.parents = {-1};
    rig.influence_count = 1;
    rig.vertices = {-0.1f, -0.1f, 0, 0.1f, -0.1f, 0, 0, 0.1f, 0};
    rig.links = {0, 0, 0};
    rig.weights = {1, 1, 1};
    rig.leaves.resize(1);
    rig.triangles = {{0, 1, 2}};
    rig.leaves[0].triangles = rig.triangles[0];
    const EnginePtr engine = make_engine();
    ArticulationId skin, convex;
    require(add_articulation(*engine, rig.desc(), &skin));
    require(add_articulation(*engine, body, &convex));
    const float scale = 3;
    BatchInput inputs[2];
    inputs[0].batch = add_instances(*engine, skin, 1);
    inputs[1].batch = add_instances(*engine, convex, 1);
    inputs[1].scales = {&scale, 1};
    const float pose[] = {0, 0, 0, 1, 0, 0, 0};
    for (BatchInput& input : inputs) input.poses.data = pose;
    const PairRule rule = {inputs[0].batch, inputs[1].batch, Pairing::kBetween};
    const auto touch = [&](double height) {
      const double origin[3] = {0, 0, height};
      inputs[0].origins = origin;
      FrameJob job;
      job.policies.exact = Exact::kSurface;
      job.inputs = inputs;
      job.rules = {&rule, 1};
      Hit hit;
      job.hits = {&hit, 1};
      require(run_frame(*engine, job));
      return job.hit_count == 1;
    };
    CHECK(touch(2.9));
    CHECK_FALSE(touch(3.1));
  }
}

TEST_CASE("triangles of one instance that share a vertex do not touch, and others do") {
  SkinRig rig;
  rig.parents = {-1, 0};
  rig.influence_count = 1;
  rig.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  rig.links = {0, 0, 0, 1, 1};
  rig.weights = {1, 1, 1, 1, 1};
  rig.leaves.resize(2);
  rig.leaves[1].link = 1;
  rig.triangles = {{0, 1, 2}, {2, 3, 4}};
  const auto run = [&](float lowered) {
    for (std::size_t leaf = 0; leaf < 2; ++leaf) rig.leaves[leaf].triangles = rig.triangles[leaf];
    const EnginePtr engine = make_engine();
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    const BatchId batch = add_instances(*engine, articulation, 1);
    const float poses[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, -lowered};
    BatchInput input;
    input.batch = batch;
    input.poses.data = poses;
    const PairRule rule = {batch, batch, Pairing::kWithin};
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    Hit hit;
    job.hits = {&hit, 1};
    require(run_frame(*engine, job));
    return job.hit_count;
  };
  CHECK(run(0) == 0);
  CHECK(run(1) == 0);  // through the other triangle, but from a vertex of it
  // The same place, with a vertex of its own.
  rig.vertices.insert(rig.vertices.end(), {0, 1, 0});
  rig.links.push_back(1);
  rig.weights.push_back(1);
  rig.triangles[1][0] = 5;
  CHECK(run(0) == 1);
}

TEST_CASE("a small cache of skins changes no hit, and says that leaves were skinned again") {
  // One leaf of 40 000 triangles makes places large, so that there are few.
  Random random(173);
  SkinRig rig;
  rig.influence_count = 1;
  std::vector<std::vector<std::uint32_t>> triangles(8);
  for (std::uint32_t link = 0; link < 8; ++link) {
    rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
    const std::uint32_t many = link == 0 ? 40000 : 4;
    for (std::uint32_t t = 0; t < many; ++t) {
      const Vec3<double> at = 0.2 * random.unit_vector();
      for (std::uint32_t k = 0; k < 3; ++k) {
        triangles[link].push_back(static_cast<std::uint32_t>(rig.vertices.size() / 3));
        const Vec3<double> by = 0.2 * random.unit_vector();
        for (std::size_t c = 0; c < 3; ++c) rig.vertices.push_back(static_cast<float>(at[c] + by[c]));
        rig.links.push_back(link);
        rig.weights.push_back(1);
      }
    }
  }
  rig.leaves.resize(8);
  const auto run = [&](bool with_large, FrameStats& stats) {
    for (std::uint32_t link = 0; link < 8; ++link) {
      rig.leaves[link].link = link;
      rig.leaves[link].triangles = {triangles[link].data(), link == 0 && !with_large ? 12 : triangles[link].size()};
    }
    const EnginePtr engine = make_engine();
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    const BatchId batch = add_instances(*engine, articulation, 4);
    std::vector<float> poses;
    // As matrices, since leaves that one link moves by a quaternion are not skinned.
    for (int i = 0; i < 4; ++i)
      for (int link = 0; link < 8; ++link)
        poses.insert(poses.end(), {1, 0, 0, 0.05f * static_cast<float>(i), 0, 1, 0, 0, 0, 0, 1, 0});
    BatchInput input;
    input.batch = batch;
    input.poses.format = PoseFormat::kMatrix3x4Rows;
    input.poses.data = poses.data();
    const PairRule rule = {batch, batch, Pairing::kBetween};
    FrameJob job;
    job.policies.exact = Exact::kSurface;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    std::vector<Hit> hits(4096);
    job.hits = hits;
    require(run_frame(*engine, job));
    stats = job.stats;
    std::set<HitLinks> out;
    for (std::size_t i = 0; i < job.hit_count; ++i)
      if (hits[i].link_a != 0 && hits[i].link_b != 0)
        out.insert({hits[i].instance_a, hits[i].instance_b, hits[i].link_a, hits[i].link_b});
    return out;
  };
  FrameStats small, large;
  const std::set<HitLinks> first = run(false, small);
  CHECK(first.size() > 20);
  CHECK(run(true, large) == first);
  CHECK(small.leaves_skinned == 32);
  CHECK(small.leaves_replaced < 8);
  CHECK(large.leaves_skinned > 32);
  CHECK(large.leaves_replaced > 8);
}

TEST_CASE("triangles that touch are listed for every pair of links, in order, on every instruction set and thread") {
  Random random(177);
  std::size_t seen = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    const auto regime = static_cast<SkinRegime>(round % kSkinRegimeCount);
    const Random again = random;
    const Crowd crowd(random, regime);
    const std::vector<Hit> pairs = pairs_of(crowd);  // those that touch, and others
    const std::vector<TrianglePair> truth = touching_of(crowd, pairs);
    const BatchInput input = crowd.poses.input(crowd.batch);
    std::vector<TouchingTriangles> found = found_triangles(*crowd.engine, input, pairs, truth.size());
    check_triangles(found, truth);
    const std::size_t size = found.size();
    seen += size;
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      desc.thread_count = 3;
      Random same = again;
      const Crowd other(same, regime, desc);
      const BatchInput same_input = other.poses.input(other.batch);
      std::vector<TouchingTriangles> more = found_triangles(*other.engine, same_input, pairs, size);
      CHECK(same_bytes(more, found));
      if (size == 0) continue;
      std::size_t needed = 0;
      more.resize(size - 1);
      CHECK(find_touching_triangles(*other.engine, {&same_input, 1}, pairs, more, &needed) == Status::kHitsOverflow);
      CHECK(needed == size);
    }
    CHECK(find_touching_triangles(*crowd.engine, {&input, 1}, pairs, found, nullptr) == Status::kBadOutput);
    const Hit nobody = {{9}, 0, {1}, 0, 0, 0, 0, 0};
    std::size_t kept = 12345;
    CHECK(find_touching_triangles(*crowd.engine, {&input, 1}, {&nobody, 1}, found, &kept) == Status::kBadPairs);
    CHECK(kept == 12345);
  }
  CHECK(seen >= least_count(1000, 20));
}

TEST_CASE("leaves that a link moves whose pose is invalid have no triangles in a list") {
  SkinRig rig;
  rig.parents = {-1, 0, 1};
  rig.influence_count = 1;
  rig.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 0, .2f, .2f, -1, .2f, .2f, 1, .3f, .2f, 1};
  rig.links = {1, 1, 1, 0, 2, 2, 2};
  rig.weights = {1, 1, 1, 1, 1, 1, 1};
  rig.leaves.resize(2);
  rig.leaves[0].link = 1;
  rig.leaves[1].link = 2;
  rig.triangles = {{0, 1, 2, 3, 1, 2}, {4, 5, 6}};
  for (std::size_t leaf = 0; leaf < 2; ++leaf) rig.leaves[leaf].triangles = rig.triangles[leaf];
  const EnginePtr engine = make_engine();
  ArticulationId articulation;
  require(add_articulation(*engine, rig.desc(), &articulation));
  const BatchId batch = add_instances(*engine, articulation, 1);
  float poses[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  BatchInput input;
  input.batch = batch;
  input.poses.data = poses;
  const Hit pair = {slot_of(batch), 0, slot_of(batch), 0, 1, 2, 0, 0};
  TouchingTriangles found;
  std::size_t count = 0;
  REQUIRE(find_touching_triangles(*engine, {&input, 1}, {&pair, 1}, {&found, 1}, &count) == Status::kOk);
  CHECK(count == 1);
  poses[4] = std::numeric_limits<float>::quiet_NaN();  // link 0 moves a corner of the other triangle of the leaf
  REQUIRE(find_touching_triangles(*engine, {&input, 1}, {&pair, 1}, {&found, 1}, &count) == Status::kOk);
  CHECK(count == 0);
  poses[4] = 0;
  poses[3] = 0;  // no rotation
  REQUIRE(find_touching_triangles(*engine, {&input, 1}, {&pair, 1}, {&found, 1}, &count) == Status::kOk);
  CHECK(count == 0);
}

TEST_CASE("bodies without triangles are counted and hit as with convex") {
  Random random(179);
  for (const Isa isa : available_isas()) {
    const Rig rig = random_rig(random, Topology::kChain, 6, 2);
    EngineDesc desc;
    desc.isa = isa;
    const EnginePtr engine = make_engine(desc);
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    constexpr std::uint32_t kMany = 60;
    const BatchId batch = add_instances(*engine, articulation, kMany);
    const Poses poses = random_poses(random, rig, kMany, PoseFormat::kQuaternionTranslation, PoseRange{});
    const BatchInput input = poses.input(batch);
    const PairRule rules[] = {{batch, batch, Pairing::kBetween}, {batch, batch, Pairing::kWithin}};
    std::vector<Hit> hits[2];
    FrameStats stats[2];
    for (const bool surface : {false, true}) {
      FrameJob job;
      job.policies.exact = surface ? Exact::kSurface : Exact::kConvex;
      job.inputs = {&input, 1};
      job.rules = rules;
      hits[surface].resize(100000);
      job.hits = hits[surface];
      require(run_frame(*engine, job));
      hits[surface].resize(job.hit_count);
      stats[surface] = job.stats;
    }
    CHECK(links_of(hits[0]) == links_of(hits[1]));
    CHECK(stats[0].exact_tests == stats[1].exact_tests);
    CHECK(stats[0].false_positives == stats[1].false_positives);
  }
}

TEST_CASE("what surfaces do not answer is refused") {
  Random random(174);
  const Crowd crowd(random, SkinRegime::kSmooth);
  const BatchInput input = crowd.poses.input(crowd.batch);
  FrameJob job;
  job.policies.exact = Exact::kSurface;
  job.inputs = {&input, 1};
  std::vector<Hit> hits(8);
  std::vector<Contact> contacts(8);
  job.hits = hits;
  CHECK(run_frame(*crowd.engine, job) == Status::kOk);
  job.min_depth = 0.1f;
  CHECK(run_frame(*crowd.engine, job) == Status::kSkinNotTaken);
  job.min_depth = 0;
  job.contacts = contacts;
  CHECK(run_frame(*crowd.engine, job) == Status::kSkinNotTaken);
  job.report = Report::kDistances;
  CHECK(run_frame(*crowd.engine, job) == Status::kSkinNotTaken);
  job = {};
  job.inputs = {&input, 1};
  for (const Exact exact : {Exact::kConvex, Exact::kFcl}) {
    job.policies.exact = exact;
    const Status status = run_frame(*crowd.engine, job);
    CHECK((status == Status::kSkinNotTaken || status == Status::kExactNotBuilt));
  }
}

}  // namespace cab::tests
