// FCL in float: its dynamic AABB tree, refitted from frame to frame, and its queries.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/config.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBB.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>
#include <fcl/narrowphase/distance.h>

#include <memory>
#include <vector>

#include "perf/measure/peers/leaf_boxes.h"
#include "perf/measure/peers/peer.h"
#include "perf/measure/peers/query_boxes.h"

namespace cab::perf {
namespace {

// An object whose bounds the caller may set. FCL's own bounds are those of the bounding sphere if an object is rotated.
class Object : public fcl::CollisionObjectf {
 public:
  using fcl::CollisionObjectf::CollisionObjectf;
  void set_bounds(const WorldBounds& bounds) {
    aabb.min_ = fcl::Vector3f(bounds.low[0], bounds.low[1], bounds.low[2]);
    aabb.max_ = fcl::Vector3f(bounds.high[0], bounds.high[1], bounds.high[2]);
  }
  std::uint32_t number() const { return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(user_data)); }
};

std::uint32_t number_of(const fcl::CollisionObjectf* object) { return static_cast<const Object*>(object)->number(); }

using Geometry = std::shared_ptr<fcl::CollisionGeometryf>;

// FCL's collide() and distance() with the solver that a request has by default. Calls that leave the choice to the
// request compile FCL's other solver, too, which takes another minute.
using Solver = fcl::detail::GJKSolver_libccd<float>;

template <class... Shapes>
bool touch(const fcl::CollisionRequestf& request, const Shapes&... shapes) {
  Solver solver;
  solver.collision_tolerance = request.gjk_tolerance;
  fcl::CollisionResultf result;
  return fcl::collide(shapes..., &solver, request, result) > 0;
}

float distance_of(const fcl::DistanceRequestf& request, const fcl::CollisionObjectf* a,
                  const fcl::CollisionObjectf* b) {
  Solver solver;
  solver.distance_tolerance = request.distance_tolerance;
  fcl::DistanceResultf result;
  return fcl::distance(a, b, &solver, request, result);
}

// The geometry of each kind of leaf: its shape, or its box if it has none.
std::vector<Geometry> make_geometries(const LeafPoser<float>& leaves) {
  std::vector<Geometry> out;
  for (std::uint32_t kind = 0; kind < leaves.kind_count(); ++kind) {
    const float(&half)[3] = leaves.local_box(kind).half;
    const ConvexPart* const shape = leaves.local_shape(kind);
    if (shape == nullptr)
      out.push_back(std::make_shared<fcl::Boxf>(2 * half[0], 2 * half[1], 2 * half[2]));
    else if (shape->kind == ShapeKind::kCapsule)
      out.push_back(std::make_shared<fcl::Capsulef>(shape->size[0], 2 * shape->size[1]));
    else
      out.push_back(std::make_shared<fcl::Ellipsoidf>(shape->size[0], shape->size[1], shape->size[2]));
  }
  return out;
}

// Objects in a tree that is refitted.
struct Tree {
  std::vector<Object> objects;
  fcl::DynamicAABBTreeCollisionManagerf manager;

  void add(const Geometry& geometry) {
    objects.emplace_back(geometry);
    objects.back().setUserData(reinterpret_cast<void*>(std::uintptr_t{objects.size() - 1}));
  }

  // Places every object by set(object, number). The first call builds the tree.
  template <class Set>
  void update(Set&& set) {
    for (std::uint32_t n = 0; n < objects.size(); ++n) set(objects[n], n);
    if (!manager.empty()) return manager.update();
    std::vector<fcl::CollisionObjectf*> all;
    for (Object& object : objects) all.push_back(&object);
    manager.registerObjects(all);
    manager.setup();
  }
};

fcl::Transform3f transform_of(const WorldBox<float>& box) {
  fcl::Transform3f out = fcl::Transform3f::Identity();
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) out.linear()(c, k) = box.axis[k][c];
  out.translation() = fcl::Vector3f(box.center[0], box.center[1], box.center[2]);
  return out;
}

fcl::OBBf obb_of(const WorldBox<float>& box) {
  fcl::OBBf obb;
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) obb.axis(c, k) = box.axis[k][c];
  obb.To = fcl::Vector3f(box.center[0], box.center[1], box.center[2]);
  obb.extent = fcl::Vector3f(box.half[0], box.half[1], box.half[2]);
  return obb;
}

// --------------------------------------------------------------------------------- one object per link, and collide()

struct LinkWorld {
  LeafPoser<float> leaves;
  Tree tree;
  fcl::CollisionRequestf request;  // by default: one contact, no contact information, no cost
  std::vector<LeafPair>* pairs = nullptr;

  explicit LinkWorld(const scenes::Crowd& crowd) : leaves(crowd) {
    const std::vector<Geometry> geometries = make_geometries(leaves);
    tree.objects.reserve(leaves.leaf_count());
    for (std::uint32_t n = 0; n < leaves.leaf_count(); ++n) tree.add(geometries[leaves.kind_of(n)]);
  }

  static bool pair_found(fcl::CollisionObjectf* a, fcl::CollisionObjectf* b, void* user) {
    auto& self = *static_cast<LinkWorld*>(user);
    const std::uint32_t na = number_of(a), nb = number_of(b);
    if (self.leaves.character_of(na) == self.leaves.character_of(nb)) return false;
    if (touch(self.request, a, b)) self.pairs->push_back(ordered_pair(na, nb));
    return false;  // go on
  }

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    tree.update([&](Object& object, std::uint32_t n) {
      object.setTransform(transform_of(leaves.pose(posed, n)));
      object.computeAABB();
    });
    pairs = &out;
    tree.manager.collide(this, pair_found);
  }
};

// ---------------------------- bounds from outside, and FCL's overlap test of oriented boxes, then collide() of shapes

struct BoundsWorld {
  CrowdBoxes boxes;
  std::vector<fcl::OBBf> obbs;
  Tree tree;
  bool link_objects;             // one object per link, else one per character
  std::vector<Geometry> shapes;  // of each kind of leaf; empty: leaves are boxes
  fcl::CollisionRequestf request;
  std::vector<LeafPair>* pairs = nullptr;

  BoundsWorld(const scenes::Crowd& crowd, bool per_link)
      : boxes(crowd), obbs(boxes.leaves().leaf_count()), link_objects(per_link) {
    const auto any = std::make_shared<fcl::Boxf>(1.f, 1.f, 1.f);  // only the bounds count
    const std::size_t objects = per_link ? obbs.size() : boxes.leaves().character_count();
    tree.objects.reserve(objects);
    for (std::size_t n = 0; n < objects; ++n) tree.add(any);
    if (boxes.leaves().local_shape(0) != nullptr) shapes = make_geometries(boxes.leaves());
  }

  bool shapes_touch(std::uint32_t a, std::uint32_t b) const {
    const LeafPoser<float>& leaves = boxes.leaves();
    return touch(request, shapes[leaves.kind_of(a)].get(), transform_of(boxes.box(a)), shapes[leaves.kind_of(b)].get(),
                 transform_of(boxes.box(b)));
  }
  void test(std::uint32_t a, std::uint32_t b) {
    if (obbs[a].overlap(obbs[b]) && (shapes.empty() || shapes_touch(a, b))) pairs->push_back(ordered_pair(a, b));
  }

  static bool test_links_overlap(fcl::CollisionObjectf* a, fcl::CollisionObjectf* b, void* user) {
    auto& self = *static_cast<BoundsWorld*>(user);
    const std::uint32_t na = number_of(a), nb = number_of(b);
    if (self.boxes.character_of(na) != self.boxes.character_of(nb)) self.test(na, nb);
    return false;
  }
  static bool pair_characters_overlap(fcl::CollisionObjectf* a, fcl::CollisionObjectf* b, void* user) {
    auto& self = *static_cast<BoundsWorld*>(user);
    self.boxes.for_leaves(number_of(a), number_of(b), [&](std::uint32_t la, std::uint32_t lb) { self.test(la, lb); });
    return false;
  }

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    boxes.pose(posed);
    for (std::uint32_t n = 0; n < obbs.size(); ++n) obbs[n] = obb_of(boxes.box(n));
    tree.update([&](Object& object, std::uint32_t n) {
      object.set_bounds(link_objects ? boxes.bounds(n) : boxes.character(n));
    });
    pairs = &out;
    tree.manager.collide(this, link_objects ? test_links_overlap : pair_characters_overlap);
  }
};

PeerFrame make_link(const scenes::Crowd& crowd) { return frame_of<LinkWorld>(crowd); }
template <bool per_link>
PeerFrame make_bounds(const scenes::Crowd& crowd) {
  return frame_of<BoundsWorld>(crowd, per_link);
}

// ----------------------------------------------------------------------------------------------------------- queries

// One object per leaf. is_alone: bounds and tests are FCL's, else ours.
class Queries : public CrowdQueries {
 public:
  Queries(const PosedBoxes& posed, bool is_alone) : posed_(posed), is_alone_(is_alone) {
    tree_.objects.reserve(posed.boxes.size());
    for (const WorldBox<float>& box : posed.boxes)
      tree_.add(std::make_shared<fcl::Boxf>(2 * box.half[0], 2 * box.half[1], 2 * box.half[2]));
    distances_.enable_nearest_points = false;
  }

  void update(const PosedBoxes& posed) override {
    tree_.update([&](Object& object, std::uint32_t n) {
      object.setTransform(transform_of(posed.boxes[n]));
      if (is_alone_)
        object.computeAABB();
      else
        object.set_bounds(bounds_of(posed.boxes[n]));
    });
  }

  // Spheres: tested, then candidates alone if the set-up has them; then points.
  void answer(std::size_t mode, const QuestionSet& asked, Answers& out) override {
    const std::vector<std::uint32_t>& order = begin(asked, true, out);
    const bool is_point = asked.kind == QueryKind::kPoint;
    constexpr float kPointRadius = 1e-6f;
    is_tested_ = mode == 0;
    out_ = &out;
    for (const std::uint32_t i : order) {
      query_ = &asked.peers[i];
      number_ = i;
      const float radius = is_point ? kPointRadius : query_->reach;
      if (radius != radius_) sphere_ = std::make_shared<fcl::Spheref>(radius_ = radius);
      Object object(sphere_);
      object.setTranslation(fcl::Vector3f(query_->at[0], query_->at[1], query_->at[2]));
      object.computeAABB();
      if (!is_point) {
        tree_.manager.collide(&object, this, meets_sphere);
        continue;
      }
      tree_.manager.distance(&object, this, meets_point);
      if (out.distances[i] > 0 && is_alone_) out.distances[i] += kPointRadius;
    }
  }

 private:
  // The object of the tree, which callbacks get as either of the two.
  std::uint32_t leaf_of(const fcl::CollisionObjectf* a, const fcl::CollisionObjectf* b) const {
    return number_of(a->collisionGeometry() == sphere_ ? b : a);
  }

  static bool meets_sphere(fcl::CollisionObjectf* a, fcl::CollisionObjectf* b, void* user) {
    auto& self = *static_cast<Queries*>(user);
    const std::uint32_t leaf = self.leaf_of(a, b);
    if (self.is_tested_ && self.is_alone_) {
      if (!touch(self.request_, a, b)) return false;
    } else if (self.is_tested_) {
      const float reach = self.query_->reach;
      if (!(square_distance(self.posed_.boxes[leaf], self.query_->at) <= reach * reach)) return false;
    }
    self.out_->overlaps.push_back({self.number_, leaf});
    return false;  // go on
  }

  static bool meets_point(fcl::CollisionObjectf* a, fcl::CollisionObjectf* b, void* user, float& least) {
    auto& self = *static_cast<Queries*>(user);
    const std::uint32_t leaf = self.leaf_of(a, b);
    float distance = 0;
    if (self.is_alone_) {
      distance = most_of(distance_of(self.distances_, a, b), 0);
    } else {
      distance = std::sqrt(square_distance(self.posed_.boxes[leaf], self.query_->at));
    }
    if (distance < self.out_->distances[self.number_]) {
      self.out_->distances[self.number_] = least = distance;
      self.out_->leaves[self.number_] = leaf;
    }
    return distance == 0;  // nothing is nearer
  }

  const PosedBoxes& posed_;
  bool is_alone_;
  Tree tree_;
  fcl::CollisionRequestf request_;
  fcl::DistanceRequestf distances_;
  Geometry sphere_;
  float radius_ = -1;
  bool is_tested_ = false;
  Answers* out_ = nullptr;
  const PeerQuery* query_ = nullptr;
  std::uint32_t number_ = 0;
};

std::vector<QuerySetup> query_setups() {
  const auto make = [](bool is_alone) {
    return [is_alone](const PosedBoxes& posed) { return std::make_unique<Queries>(posed, is_alone); };
  };
  return {{"own",
           true,
           "one object per leaf in the dynamic AABB tree, computeAABB",
           {{QueryKind::kSphere, "", "collide(), spheres sorted"},
            {QueryKind::kPoint, "", "distance() of a sphere of 1e-6 m, points sorted"}},
           make(true)},
          {"bounds",
           false,
           "the same with bounds from outside, which are tighter",
           {{QueryKind::kSphere, "", "a test from outside, spheres sorted"},
            {QueryKind::kSphere, "candidates", "no test, spheres sorted", true},
            {QueryKind::kPoint, "", "a distance from outside, points sorted"}},
           make(false)}};
}

}  // namespace

Peer fcl_peer() {
  return {
      "fcl",
      "libfcl-dev",
      FCL_VERSION " float",
      {{"collide", true, "one object per link in the dynamic AABB tree, collide()", make_link},
       {"obb", false, "the same with bounds from outside, which are tighter, OBB::overlap", make_bounds<true>},
       {"character", false, "one object per character in the tree, then its links' bounds from outside, OBB::overlap",
        make_bounds<false>},
       {"shapes", true, "one object per link in the dynamic AABB tree, collide()", make_link, Leaves::kShapes},
       {"character shapes", false,
        "one object per character in the tree, then its links' bounds from outside, OBB::overlap, collide()",
        make_bounds<false>, Leaves::kShapes}},
      query_setups()};
}

}  // namespace cab::perf
