#include "perf/measure/kernels/exact.h"

#include "kernels/convex/convex_block.h"
#include "layout/convex_shapes.h"
#include "perf/base/statistics.h"
#include "perf/judge/oracle/convex_pairs.h"

#include <cab/cab.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>

namespace cab::perf {
namespace {

constexpr std::uint32_t kShapes = 256;  // of each side
constexpr std::uint32_t kExactPairs = 4096;

// One side of a row: a kind of part, and how many vertices its hulls have.
struct Kind {
  const char* name;
  ShapeKind kind;
  std::uint32_t vertices = 0;
};
constexpr Kind kBox = {"box", ShapeKind::kBox}, kEllipsoid = {"ellipsoid", ShapeKind::kEllipsoid},
               kCapsule = {"capsule", ShapeKind::kCapsule}, kSphere = {"sphere", ShapeKind::kSphere},
               kCylinder = {"cylinder", ShapeKind::kCylinder}, kHalfSpace = {"half space", ShapeKind::kHalfSpace};
constexpr Kind hull_of(const char* name, std::uint32_t vertices) { return {name, ShapeKind::kConvexHull, vertices}; }

// The two sides of a row. same_two: sixteen pairs in a row are of the same two shapes, as in a sequence.
struct Row {
  Kind a, b;
  bool same_two = false;

  std::string title() const {
    return std::string(a.name) + " and " + b.name + (same_two ? ", the same two in sixteen pairs" : "");
  }
};

constexpr Row kRows[kExactRows] = {
    {kEllipsoid, kEllipsoid},
    {kCapsule, kCapsule},
    {kBox, kBox},
    {hull_of("hull of 8", 8), hull_of("hull of 8", 8)},
    {hull_of("hull of 16", 16), hull_of("hull of 16", 16)},
    {hull_of("hull of 32", 32), hull_of("hull of 32", 32)},
    {hull_of("hull of 64", 64), hull_of("hull of 64", 64)},
    {hull_of("hull of 8", 8), hull_of("hull of 8", 8), true},
    {hull_of("hull of 32", 32), hull_of("hull of 32", 32), true},
    {kBox, kEllipsoid},
    {kCapsule, kBox},
    {kCapsule, kEllipsoid},
    {kEllipsoid, hull_of("hull of 32", 32)},
    {kCapsule, hull_of("hull of 32", 32)},
    {kBox, hull_of("hull of 32", 32)},
    {kSphere, kSphere},
    {kSphere, kBox},
    {kCylinder, kCylinder},
    {kCylinder, kBox},
    {hull_of("triangle", 3), hull_of("triangle", 3)},
    {hull_of("triangle", 3), kBox},
    {kCapsule, kHalfSpace},
    {hull_of("hull of 32", 32), kHalfSpace},
};

// The triangles of a hull whose vertices are all corners, as FCL takes them: for each a 3 and three indices. A triangle
// has both of its sides.
std::shared_ptr<std::vector<int>> faces_of(const std::vector<fcl::Vector3d>& vertices) {
  auto out = std::make_shared<std::vector<int>>();
  const int count = static_cast<int>(vertices.size());
  const auto at = [&vertices](int i) -> const fcl::Vector3d& { return vertices[static_cast<std::size_t>(i)]; };
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j)
      for (int k = j + 1; k < count; ++k) {
        const fcl::Vector3d normal = (at(j) - at(i)).cross(at(k) - at(i));
        int above = 0, below = 0;
        for (int v = 0; v < count; ++v) {
          if (v == i || v == j || v == k) continue;
          ++(normal.dot(at(v) - at(i)) > 0 ? above : below);
        }
        if (above == 0) out->insert(out->end(), {3, i, j, k});
        if (below == 0) out->insert(out->end(), {3, i, k, j});
      }
  return out;
}

// The shapes of one side, for cab and for FCL.
struct Side {
  Arena arena{default_allocator()};
  std::vector<std::vector<float>> vertices;
  std::vector<ConvexPart> parts;
  std::vector<std::shared_ptr<fcl::CollisionGeometryd>> fcl_shapes;
  Articulation articulation;
  ConvexShapes shapes;

  Side(Random& random, const Kind& kind) : vertices(kShapes) {
    for (std::uint32_t i = 0; i < kShapes; ++i) add(random, kind, vertices[i]);
    static constexpr std::int32_t kRoot = -1;
    std::vector<Leaf> leaves;
    for (const ConvexPart& part : parts)
      leaves.push_back({0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {&part, 1}});
    ArticulationDesc desc;
    desc.link_parents = {&kRoot, 1};
    desc.leaves = leaves;
    if (build_articulation(desc, arena, &articulation, nullptr) != Status::kOk)
      throw std::runtime_error("a random shape is refused");
    shapes = make_convex_shapes(articulation, arena);
  }

  void add(Random& random, const Kind& kind, std::vector<float>& hull) {
    ConvexPart part;
    part.kind = kind.kind;
    for (float& size : part.size) size = random.uniform(0.05f, 0.3f);
    const Eigen::Vector3d size(part.size[0], part.size[1], part.size[2]);
    auto points = std::make_shared<std::vector<fcl::Vector3d>>();
    while (points->size() < kind.vertices) {
      const fcl::Vector3f at(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      if (at.norm() < 0.1f || at.norm() > 1) continue;
      for (int c = 0; c < 3; ++c) hull.push_back(at.normalized()[c] * part.size[c]);
      points->emplace_back(hull[hull.size() - 3], hull[hull.size() - 2], hull[hull.size() - 1]);
    }
    part.vertices = hull;
    parts.push_back(part);
    switch (kind.kind) {
      case ShapeKind::kBox: fcl_shapes.push_back(std::make_shared<fcl::Boxd>(2 * size)); break;
      case ShapeKind::kEllipsoid: fcl_shapes.push_back(std::make_shared<fcl::Ellipsoidd>(size)); break;
      case ShapeKind::kCapsule: fcl_shapes.push_back(std::make_shared<fcl::Capsuled>(size[0], 2 * size[1])); break;
      case ShapeKind::kSphere: fcl_shapes.push_back(std::make_shared<fcl::Sphered>(size[0])); break;
      case ShapeKind::kCylinder: fcl_shapes.push_back(std::make_shared<fcl::Cylinderd>(size[0], 2 * size[1])); break;
      case ShapeKind::kHalfSpace: fcl_shapes.push_back(std::make_shared<fcl::Halfspaced>(0, 0, 1, 0)); break;
      case ShapeKind::kConvexHull: {
        const auto faces = faces_of(*points);
        fcl_shapes.push_back(std::make_shared<fcl::Convexd>(points, static_cast<int>(faces->size() / 4), faces));
        break;
      }
    }
    fcl_shapes.back()->computeLocalAABB();
  }
};

// A pair of one row, with its poses for cab and for FCL.
struct ExactPair {
  std::uint32_t a, b;
  float pose_a[7], pose_b[7];
  fcl::Transform3d fcl_a, fcl_b;
};

void random_pose(Random& random, float place, float (&pose)[7], fcl::Transform3d& fcl_pose) {
  Eigen::Quaternionf q(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  if (q.norm() < 0.1f) q = Eigen::Quaternionf::Identity();
  q.normalize();
  const float rotation[4] = {q.x(), q.y(), q.z(), q.w()};
  std::copy_n(rotation, 4, pose);
  for (int c = 4; c < 7; ++c) pose[c] = random.uniform(-place, place);
  fcl_pose = fcl::Transform3d::Identity();
  fcl_pose.linear() = q.cast<double>().normalized().toRotationMatrix();
  fcl_pose.translation() = fcl::Vector3d(pose[4], pose[5], pose[6]);
}

struct ExactWork {
  ExactWork(Random& random, const Row& row) : side_a(random, row.a), side_b(random, row.b) {
    for (std::uint32_t i = 0; i < kExactPairs; ++i) {
      ExactPair pair;
      pair.a = static_cast<std::uint32_t>(random.next_u64() % kShapes);
      pair.b = static_cast<std::uint32_t>(random.next_u64() % kShapes);
      if (row.same_two && i % kLanes > 0) {
        pair.a = pairs.back().a;
        pair.b = pairs.back().b;
      }
      random_pose(random, 0.2f, pair.pose_a, pair.fcl_a);
      random_pose(random, 0.2f, pair.pose_b, pair.fcl_b);
      pairs.push_back(pair);
    }
    std::vector<std::uint32_t> all(kExactPairs);
    std::iota(all.begin(), all.end(), 0u);
    blocks = blocks_of(all);
  }

  // The pairs of a list in blocks of sixteen. The last block repeats its last pair.
  std::vector<kernel::ConvexBlock> blocks_of(const std::vector<std::uint32_t>& list) const {
    std::vector<kernel::ConvexBlock> out((list.size() + kLanes - 1) / kLanes);
    for (std::size_t i = 0; i < out.size() * kLanes; ++i) {
      const ExactPair& pair = pairs[list[std::min(i, list.size() - 1)]];
      kernel::ConvexBlock& block = out[i / kLanes];
      const std::uint32_t lane = i % kLanes;
      block.a.coding = block.b.coding = {PoseFormat::kQuaternionTranslation, Scaling::kNone};
      block.a.shape[lane] = &side_a.shapes.shapes[pair.a];
      block.b.shape[lane] = &side_b.shapes.shapes[pair.b];
      block.a.pose[lane] = pair.pose_a;
      block.b.pose[lane] = pair.pose_b;
      block.a.orientation[lane] = block.b.orientation[lane] = nullptr;
      for (auto& by : block.shift.by) by[lane] = 0;
      int exponent = 0;
      std::frexp(block.a.shape[lane]->reach + block.b.shape[lane]->reach, &exponent);
      block.scale[lane] = std::ldexp(1.0f, -exponent);
    }
    return out;
  }

  Side side_a, side_b;
  std::vector<ExactPair> pairs;
  std::vector<kernel::ConvexBlock> blocks;
};

// By libccd: FCL's own solver (GST_INDEP) takes 5 to 17 times as long on these pairs, and as long on boxes.
std::uint64_t fcl_touching(const ExactWork& work, std::vector<char>* touching) {
  fcl::CollisionRequestd request;
  request.num_max_contacts = 1;
  request.enable_contact = false;
  request.gjk_solver_type = fcl::GST_LIBCCD;
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < kExactPairs; ++i) {
    const ExactPair& pair = work.pairs[i];
    fcl::CollisionResultd result;
    const bool touch = fcl::collide(work.side_a.fcl_shapes[pair.a].get(), pair.fcl_a,
                                    work.side_b.fcl_shapes[pair.b].get(), pair.fcl_b, request, result) > 0;
    count += touch;
    if (touching) (*touching)[i] = touch;
  }
  return count;
}

std::uint64_t cab_touching(const ExactWork& work, const kernel::KernelTable& table) {
  std::uint64_t count = 0;
  for (const kernel::ConvexBlock& block : work.blocks)
    count += static_cast<std::uint64_t>(__builtin_popcount(table.test_convex_pairs(block).touching));
  return count;
}

// How the answers of the last table differ from FCL's.
std::string differences(const ExactWork& work, const kernel::KernelTable& table) {
  std::vector<char> touching(kExactPairs);
  fcl_touching(work, &touching);
  std::uint32_t apart = 0, touch = 0, undecided = 0;
  for (std::uint32_t i = 0; i < kExactPairs; ++i) {
    const kernel::ConvexAnswer answer = table.test_convex_pairs(work.blocks[i / kLanes]);
    const bool is_apart = answer.apart >> (i % kLanes) & 1, touches = answer.touching >> (i % kLanes) & 1;
    apart += is_apart && touching[i];
    touch += touches && !touching[i];
    undecided += !is_apart && !touches;
  }
  return std::to_string(undecided) + " undecided in float, " + std::to_string(apart) + " apart that touch by FCL, " +
         std::to_string(touch) + " touching that are apart by FCL";
}

// ------------------------------------------------------------------------------------------------------- contacts

// The depth of a pair for which FCL returns no contact.
constexpr double kNoContact = std::numeric_limits<double>::quiet_NaN();

// The most pairs of a table whose least depth is judged.
constexpr std::size_t kJudgedDepths = 256;

// The pairs that touch by cab and by FCL, and what is needed to measure their contacts.
struct ContactWork {
  ContactWork(const ExactWork& exact, const kernel::KernelTable& table) : work(exact) {
    std::vector<char> touching(kExactPairs);
    fcl_touching(work, &touching);
    for (std::uint32_t i = 0; i < kExactPairs; ++i)
      if (touching[i] && table.test_convex_pairs(work.blocks[i / kLanes]).touching >> (i % kLanes) & 1)
        list.push_back(i);
    if (!list.empty()) blocks = work.blocks_of(list);
    for (std::size_t i = 0; i < std::min(list.size(), kJudgedDepths); ++i) {
      const ExactPair& pair = work.pairs[list[i]];
      oracle::ConvexCase one = {};
      const auto place = [](const Side& side, std::uint32_t shape, const float(&pose)[7], oracle::PosedPart& out) {
        out.part = side.parts[shape];
        out.vertices = side.vertices[shape];
        std::copy_n(pose, 7, out.pose);
      };
      place(work.side_a, pair.a, pair.pose_a, one.a);
      place(work.side_b, pair.b, pair.pose_b, one.b);
      bind_vertices(one);
      least.push_back(-static_cast<double>(judge_case(one, oracle::Effort::kMeasure).verdict.gap_at_most));
    }
  }

  const ExactWork& work;
  std::vector<std::uint32_t> list;
  std::vector<kernel::ConvexBlock> blocks;
  std::vector<double> least;  // of the first pairs of the list
};

// The depths by FCL; returns how many contacts there are.
std::uint64_t fcl_contacts(const ContactWork& contacts, std::vector<double>& depths) {
  fcl::CollisionRequestd request;
  request.num_max_contacts = 1;
  request.enable_contact = true;
  request.gjk_solver_type = fcl::GST_LIBCCD;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < contacts.list.size(); ++i) {
    const ExactPair& pair = contacts.work.pairs[contacts.list[i]];
    fcl::CollisionResultd result;
    fcl::collide(contacts.work.side_a.fcl_shapes[pair.a].get(), pair.fcl_a,
                 contacts.work.side_b.fcl_shapes[pair.b].get(), pair.fcl_b, request, result);
    count += result.numContacts() > 0;
    depths[i] = result.numContacts() > 0 ? result.getContact(0).penetration_depth : kNoContact;
  }
  return count;
}

std::uint64_t cab_contacts(const ContactWork& contacts, const kernel::KernelTable& table, std::vector<double>& depths) {
  kernel::ConvexContacts found;
  for (std::size_t block = 0; block < contacts.blocks.size(); ++block) {
    table.contact_pairs(contacts.blocks[block], found);
    for (std::size_t lane = 0; lane < kLanes && block * kLanes + lane < depths.size(); ++lane)
      depths[block * kLanes + lane] = found.depth[lane];
  }
  return contacts.list.size();
}

// The share of depths that are over `above` times the least one, of the contacts that were judged, in per cent; and how
// many of these pairs have none.
std::string share_above(const std::vector<double>& depths, const std::vector<double>& least, double above) {
  std::size_t count = 0, without = 0;
  for (std::size_t i = 0; i < least.size(); ++i) {
    without += std::isnan(depths[i]);
    count += depths[i] > above * least[i];
  }
  if (without == least.size()) return "no contact";
  return fixed(100 * static_cast<double>(count) / static_cast<double>(least.size() - without), 1) +
         (without > 0 ? ", " + std::to_string(without) + " without contact" : "");
}

void measure_contacts(const ExactWork& work, const std::string& title,
                      const std::vector<const kernel::KernelTable*>& tables, std::uint32_t rounds, ProgressBar& bar) {
  const ContactWork contacts(work, *tables.back());
  const std::uint64_t count = contacts.list.size();
  std::vector<Contender> contenders;
  std::vector<std::vector<double>> depths(tables.size() + 1, std::vector<double>(count));
  for (const kernel::KernelTable* table : tables) {
    std::vector<double>& own = depths[contenders.size()];
    contenders.push_back({std::string("cab ") + to_string(table->isa), std::max<std::uint64_t>(count, 1),
                          [&contacts, &own, table] { return cab_contacts(contacts, *table, own); }});
  }
  contenders.push_back({"FCL collide", std::max<std::uint64_t>(count, 1),
                        [&contacts, &depths] { return fcl_contacts(contacts, depths.back()); }});
  race(contenders, rounds, bar);
  if (count == 0) {
    std::cout << "\ncontacts, " << title << ": skipped, no pair touches\n";
    return;
  }
  TextTable out;
  out.add_row({"contacts, " + title + ", " + std::to_string(count) + " pairs", "ns", "FCL / this",
               "% over 1 % above the least depth", "% over 10 %"});
  for (std::size_t i = 0; i < contenders.size(); ++i)
    out.add_row({contenders[i].name, fixed(median(contenders[i].nanoseconds), 1),
                 fixed(times_faster(contenders[i], contenders.back()), 1), share_above(depths[i], contacts.least, 1.01),
                 share_above(depths[i], contacts.least, 1.1)});
  std::cout << '\n';
  out.print(std::cout);
}

}  // namespace

void measure_exact(const std::vector<const kernel::KernelTable*>& tables, std::uint32_t rounds, ProgressBar& bar) {
  Random random(4);
  for (const Row& row : kRows) {
    const ExactWork work(random, row);
    std::vector<Contender> contenders;
    for (const kernel::KernelTable* table : tables)
      contenders.push_back({std::string("cab ") + to_string(table->isa), kExactPairs,
                            [&work, table] { return cab_touching(work, *table); }});
    contenders.push_back({"FCL collide", kExactPairs, [&work] { return fcl_touching(work, nullptr); }});
    race(contenders, rounds, bar);
    TextTable out;
    out.add_row(
        {"exact test, " + row.title() + ", " + std::to_string(kExactPairs) + " pairs", "ns", "FCL / this", "touching"});
    for (const Contender& contender : contenders)
      out.add_row({contender.name, fixed(median(contender.nanoseconds), 1),
                   fixed(times_faster(contender, contenders.back()), 1), std::to_string(contender.answer)});
    std::cout << '\n';
    out.print(std::cout);
    std::cout << differences(work, *tables.back()) << '\n';
    measure_contacts(work, row.title(), tables, rounds, bar);
  }
}

}  // namespace cab::perf
