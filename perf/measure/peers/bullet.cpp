// Bullet: its collision world with its own test of two boxes, its dynamic tree with our test, and its casts of rays.
#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <btBulletCollisionCommon.h>

#include <memory>
#include <string>
#include <vector>

#include "perf/measure/peers/leaf_boxes.h"
#include "perf/measure/peers/peer.h"
#include "perf/measure/peers/query_boxes.h"

namespace cab::perf {
namespace {

// ------------------------------------------------------------------------------------------- its collision world

template <class Real>
btTransform transform_of(const WorldBox<Real>& box) {
  const auto& r = box.axis;
  return btTransform(btMatrix3x3(r[0][0], r[1][0], r[2][0], r[0][1], r[1][1], r[2][1], r[0][2], r[1][2], r[2][2]),
                     btVector3(box.center[0], box.center[1], box.center[2]));
}

// Bullet has no ellipsoid, so this is one with its support function, as a user would add it. Its margin is 0: the
// support points are those of the ellipsoid itself.
class Ellipsoid : public btConvexInternalShape {
 public:
  explicit Ellipsoid(const btVector3& radii) : radii_(radii) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    btConvexInternalShape::setMargin(0);
  }
  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    const btVector3 scaled = radii_ * direction;
    const btScalar length = scaled.length();
    return length > 0 ? radii_ * scaled / length : btVector3(radii_.x(), 0, 0);
  }
  btVector3 localGetSupportingVertex(const btVector3& direction) const override {
    return localGetSupportingVertexWithoutMargin(direction);
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* vertices,
                                                         int count) const override {
    for (int i = 0; i < count; ++i) vertices[i] = localGetSupportingVertexWithoutMargin(directions[i]);
  }
  void getAabb(const btTransform& transform, btVector3& low, btVector3& high) const override {
    for (int c = 0; c < 3; ++c) {
      const btScalar reach = (transform.getBasis()[c] * radii_).length();
      low[c] = transform.getOrigin()[c] - reach;
      high[c] = transform.getOrigin()[c] + reach;
    }
  }
  void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }  // it never moves
  void setLocalScaling(const btVector3&) override {}                                              // its size is fixed
  void setMargin(btScalar) override {}                                                            // and its margin
  const char* getName() const override { return "Ellipsoid"; }

 private:
  btVector3 radii_;
};

using Shapes = std::vector<std::unique_ptr<btConvexShape>>;

// What each kind of leaf is: its shape, or its box if it has none.
template <class Real>
Shapes make_shapes(const LeafPoser<Real>& leaves) {
  Shapes out;
  for (std::uint32_t kind = 0; kind < leaves.kind_count(); ++kind) {
    const float(&half)[3] = leaves.local_box(kind).half;
    const ConvexPart* const shape = leaves.local_shape(kind);
    if (shape == nullptr)
      out.push_back(std::make_unique<btBoxShape>(btVector3(half[0], half[1], half[2])));
    else if (shape->kind == ShapeKind::kCapsule)
      out.push_back(std::make_unique<btCapsuleShapeZ>(shape->size[0], 2 * shape->size[1]));
    else
      out.push_back(std::make_unique<Ellipsoid>(btVector3(shape->size[0], shape->size[1], shape->size[2])));
  }
  return out;
}

// The number of an object: of its leaf, or of its character if it is a compound.
std::uint32_t number_of(const btCollisionObject* object) { return static_cast<std::uint32_t>(object->getUserIndex()); }

// Keeps pairs of leaves of one character out of the pair cache.
struct BetweenCharacters : btOverlapFilterCallback {
  const CrowdLeaves& leaves;

  explicit BetweenCharacters(const CrowdLeaves& of) : leaves(of) {}
  std::uint32_t character_of(const btBroadphaseProxy* proxy) const {
    return leaves.character_of(number_of(static_cast<const btCollisionObject*>(proxy->m_clientObject)));
  }
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    return character_of(a) != character_of(b);
  }
};

// Records which boxes have a contact with depth, and keeps no contact.
struct PairResult : btManifoldResult {
  std::vector<LeafPair>& pairs;
  const CrowdLeaves& leaves;

  PairResult(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, std::vector<LeafPair>& out,
             const CrowdLeaves& of)
      : btManifoldResult(a, b), pairs(out), leaves(of) {}

  // An object is a box, or a compound of all boxes of a character.
  std::uint32_t leaf_of(const btCollisionObjectWrapper& wrapper) const {
    const std::uint32_t number = number_of(wrapper.getCollisionObject());
    if (wrapper.m_index < 0) return number;
    return leaves.character(number).first_leaf + static_cast<std::uint32_t>(wrapper.m_index);
  }
  void addContactPoint(const btVector3&, const btVector3&, btScalar depth) override {
    if (depth > 0) return;  // the distance, below zero inside
    const LeafPair pair = ordered_pair(leaf_of(*getBody0Wrap()), leaf_of(*getBody1Wrap()));
    if (pairs.empty() || !(pairs.back() == pair)) pairs.push_back(pair);  // a pair's contacts follow each other
  }
};

struct PairDispatcher : btCollisionDispatcher {
  std::vector<LeafPair>* pairs = nullptr;
  const CrowdLeaves& leaves;

  PairDispatcher(btCollisionConfiguration* configuration, const CrowdLeaves& of)
      : btCollisionDispatcher(configuration), leaves(of) {
    setNearCallback(pair_found);
  }
  // The same as btCollisionDispatcher::defaultNearCallback, but with our result. Algorithms are kept with their pairs.
  static void pair_found(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info) {
    auto& self = static_cast<PairDispatcher&>(dispatcher);
    const auto object = [](const btBroadphaseProxy* p) { return static_cast<btCollisionObject*>(p->m_clientObject); };
    const btCollisionObject *a = object(pair.m_pProxy0), *b = object(pair.m_pProxy1);
    const btCollisionObjectWrapper wrap_a(nullptr, a->getCollisionShape(), a, a->getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper wrap_b(nullptr, b->getCollisionShape(), b, b->getWorldTransform(), -1, -1);
    if (pair.m_algorithm == nullptr)
      pair.m_algorithm = self.findAlgorithm(&wrap_a, &wrap_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    if (pair.m_algorithm == nullptr) return;
    PairResult result(&wrap_a, &wrap_b, *self.pairs, self.leaves);
    pair.m_algorithm->processCollision(&wrap_a, &wrap_b, info, &result);
  }
};

// One object per link, or one per character with a compound of its leaves as its shape.
class World {
 public:
  World(const scenes::Crowd& crowd, bool per_link)
      : leaves_(crowd),
        filter_(leaves_),
        dispatcher_(&configuration_, leaves_),
        world_(&dispatcher_, &broadphase_, &configuration_),
        shapes_(make_shapes(leaves_)) {
    gContactBreakingThreshold = 0;  // otherwise all bounds grow by it, for contacts that are kept
    // Pairs are found in one pass over the trees at the end, not object by object: all objects move.
    broadphase_.m_deferedcollide = true;
    if (per_link) {
      world_.getPairCache()->setOverlapFilterCallback(&filter_);
      objects_.resize(leaves_.leaf_count());
      return;
    }
    for (std::uint32_t i = 0; i < leaves_.character_count(); ++i) {
      const std::uint32_t children = leaves_.end_leaf(i) - leaves_.character(i).first_leaf;
      compounds_.push_back(std::make_unique<btCompoundShape>(true, static_cast<int>(children)));
    }
    objects_.resize(compounds_.size());
  }
  ~World() {
    if (!added_) return;
    for (const auto& object : objects_) world_.removeCollisionObject(object.get());
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    if (compounds_.empty())
      set_links(posed);
    else
      set_compounds(posed);
    if (!added_) add_objects();
    dispatcher_.pairs = &out;
    world_.performDiscreteCollisionDetection();
  }

 private:
  void set_links(const std::vector<scenes::PosedGroup>& posed) {
    for (std::uint32_t n = 0; n < objects_.size(); ++n) {
      if (!added_) objects_[n] = make_object(shapes_[leaves_.kind_of(n)].get(), n);
      objects_[n]->setWorldTransform(transform_of(leaves_.pose(posed, n)));
    }
  }
  // The boxes are placed in the world, and their object stays at its origin.
  void set_compounds(const std::vector<scenes::PosedGroup>& posed) {
    for (std::uint32_t i = 0; i < compounds_.size(); ++i) {
      const std::uint32_t first = leaves_.character(i).first_leaf, end = leaves_.end_leaf(i);
      for (std::uint32_t n = first; n < end; ++n) {
        const btTransform transform = transform_of(leaves_.pose(posed, n));
        if (!added_)
          compounds_[i]->addChildShape(transform, shapes_[leaves_.kind_of(n)].get());
        else
          compounds_[i]->updateChildTransform(static_cast<int>(n - first), transform, false);
      }
      compounds_[i]->recalculateLocalAabb();
      if (!added_) objects_[i] = make_object(compounds_[i].get(), i);
    }
  }
  static std::unique_ptr<btCollisionObject> make_object(btCollisionShape* shape, std::uint32_t number) {
    auto object = std::make_unique<btCollisionObject>();
    object->setCollisionShape(shape);
    object->setWorldTransform(btTransform::getIdentity());
    object->setUserIndex(static_cast<int>(number));
    return object;
  }
  void add_objects() {
    for (const auto& object : objects_) world_.addCollisionObject(object.get());
    added_ = true;
  }

  LeafPoser<btScalar> leaves_;
  BetweenCharacters filter_;
  btDefaultCollisionConfiguration configuration_;
  PairDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_;
  Shapes shapes_;
  std::vector<std::unique_ptr<btCompoundShape>> compounds_;
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
  bool added_ = false;
};

// ------------------------------------------------------------------------------------------- its tree, and no more

// How much bounds grow when they change, in metres, so that few frames have to insert a leaf into the tree again.
constexpr btScalar kMargin = 0.05f;

// Gives leaf n of a tree its bounds. node: the leaf, or null if it is not yet there.
void set_leaf(btDbvt& tree, btDbvtNode*& node, std::uint32_t n, const WorldBounds& b) {
  btDbvtVolume volume =
      btDbvtVolume::FromMM(btVector3(b.low[0], b.low[1], b.low[2]), btVector3(b.high[0], b.high[1], b.high[2]));
  if (node == nullptr) {
    node = tree.insert(volume, reinterpret_cast<void*>(std::uintptr_t{n}));
  } else if (!node->volume.Contain(volume)) {
    volume.Expand(btVector3(kMargin, kMargin, kMargin));
    tree.update(node, volume);
  }
}

class TreeWorld : btDbvt::ICollide {
 public:
  TreeWorld(const scenes::Crowd& crowd, bool per_link)
      : boxes_(crowd),
        per_link_(per_link),
        nodes_(per_link ? boxes_.leaves().leaf_count() : boxes_.leaves().character_count()) {
    if (boxes_.leaves().local_shape(0) != nullptr) shapes_ = make_shapes(boxes_.leaves());
  }

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    boxes_.pose(posed);
    for (std::uint32_t n = 0; n < nodes_.size(); ++n)
      set_leaf(tree_, nodes_[n], n, per_link_ ? boxes_.bounds(n) : boxes_.character(n));
    pairs_ = &out;
    tree_.collideTTpersistentStack(tree_.m_root, tree_.m_root, *this);
  }

 private:
  // GJK on the shapes without their margins: a capsule is a segment, and its margin is its radius.
  bool shapes_touch(std::uint32_t a, std::uint32_t b) const {
    const LeafPoser<float>& leaves = boxes_.leaves();
    const btConvexShape &shape_a = *shapes_[leaves.kind_of(a)], &shape_b = *shapes_[leaves.kind_of(b)];
    const btTransform at_a = transform_of(boxes_.box(a)), at_b = transform_of(boxes_.box(b));
    btGjkEpaSolver2::sResults results;
    return !btGjkEpaSolver2::Distance(&shape_a, at_a, &shape_b, at_b, at_b.getOrigin() - at_a.getOrigin(), results) ||
           results.distance <= shape_a.getMargin() + shape_b.getMargin();
  }
  void test(std::uint32_t a, std::uint32_t b) {
    if (boxes_overlap(boxes_.box(a), boxes_.box(b)) && (shapes_.empty() || shapes_touch(a, b)))
      pairs_->push_back(ordered_pair(a, b));
  }

  void Process(const btDbvtNode* a, const btDbvtNode* b) override {
    const auto number = [](const btDbvtNode* node) {
      return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(node->data));
    };
    const std::uint32_t na = number(a), nb = number(b);
    if (na == nb) return;
    if (!per_link_)
      boxes_.for_leaves(na, nb, [this](std::uint32_t la, std::uint32_t lb) { test(la, lb); });
    else if (boxes_.character_of(na) != boxes_.character_of(nb) && bounds_overlap(boxes_.bounds(na), boxes_.bounds(nb)))
      test(na, nb);
  }

  CrowdBoxes boxes_;
  Shapes shapes_;  // of each kind of leaf; empty: leaves are boxes
  bool per_link_;
  btDbvt tree_;
  std::vector<btDbvtNode*> nodes_;
  std::vector<LeafPair>* pairs_ = nullptr;
};

template <bool per_link>
PeerFrame make_world(const scenes::Crowd& crowd) {
  return frame_of<World>(crowd, per_link);
}
template <bool per_link>
PeerFrame make_tree(const scenes::Crowd& crowd) {
  return frame_of<TreeWorld>(crowd, per_link);
}

// ----------------------------------------------------------------------------------------------------------- queries

// What an object of the world is.
enum class Objects : std::uint8_t { kLeaves, kCompounds, kPlainCompounds };

// The closest hit, with the child of a compound that it is of.
struct ClosestHit : btCollisionWorld::ClosestRayResultCallback {
  using ClosestRayResultCallback::ClosestRayResultCallback;
  int child = 0;

  btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool in_world) override {
    child = result.m_localShapeInfo != nullptr ? result.m_localShapeInfo->m_triangleIndex : 0;
    return ClosestRayResultCallback::addSingleResult(result, in_world);
  }
};

// Rays through a collision world.
class RayWorld : public CrowdQueries {
 public:
  RayWorld(const PosedBoxes& posed, Objects objects)
      : posed_(posed),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &configuration_),
        is_per_leaf_(objects == Objects::kLeaves) {
    gContactBreakingThreshold = 0;  // otherwise all bounds grow by it
    const std::uint32_t count = is_per_leaf_ ? posed.leaves.leaf_count() : posed.leaves.character_count();
    for (std::uint32_t i = 0; i < count; ++i) {
      auto object = std::make_unique<btCollisionObject>();
      if (is_per_leaf_) {
        object->setCollisionShape(add_shape(i));
      } else {
        const std::uint32_t first = posed.leaves.character(i).first_leaf, end = posed.leaves.end_leaf(i);
        compounds_.push_back(
            std::make_unique<btCompoundShape>(objects == Objects::kCompounds, static_cast<int>(end - first)));
        for (std::uint32_t n = first; n < end; ++n)
          compounds_.back()->addChildShape(transform_of(posed.boxes[n]), add_shape(n));
        object->setCollisionShape(compounds_.back().get());
      }
      object->setUserIndex(static_cast<int>(i));
      objects_.push_back(std::move(object));
    }
    place(posed);
    // Pairs are not asked for, so none is looked for when objects are added.
    for (const auto& object : objects_) world_.addCollisionObject(object.get(), 1, 2);
  }
  ~RayWorld() override {
    for (const auto& object : objects_) world_.removeCollisionObject(object.get());
  }
  RayWorld(const RayWorld&) = delete;
  RayWorld& operator=(const RayWorld&) = delete;

  void update(const PosedBoxes& posed) override {
    place(posed);
    world_.updateAabbs();
  }

  // Rays sorted, sorted by GJK in place of the sub-simplex cast, and as they come.
  void answer(std::size_t mode, const QuestionSet& asked, Answers& out) override {
    for (const std::uint32_t i : begin(asked, mode < 2, out)) {
      const PeerQuery& query = asked.peers[i];
      const btVector3 from(query.at[0], query.at[1], query.at[2]);
      const btVector3 to = from + query.reach * btVector3(query.direction[0], query.direction[1], query.direction[2]);
      ClosestHit hit(from, to);
      if (mode == 1) hit.m_flags |= btTriangleRaycastCallback::kF_UseGjkConvexCastRaytest;
      hit.m_collisionFilterGroup = 2;
      hit.m_collisionFilterMask = 1;
      world_.rayTest(from, to, hit);
      if (!hit.hasHit()) continue;
      const std::uint32_t number = number_of(hit.m_collisionObject);
      out.distances[i] = static_cast<float>(hit.m_closestHitFraction) * query.reach;
      out.leaves[i] =
          is_per_leaf_ ? number : posed_.leaves.character(number).first_leaf + static_cast<std::uint32_t>(hit.child);
    }
  }

 private:
  btCollisionShape* add_shape(std::uint32_t leaf) {
    const float(&half)[3] = posed_.boxes[leaf].half;
    shapes_.push_back(std::make_unique<btBoxShape>(btVector3(half[0], half[1], half[2])));
    return shapes_.back().get();
  }

  // Boxes are placed in the world, and the objects of compounds stay at its origin.
  void place(const PosedBoxes& posed) {
    for (std::uint32_t i = 0; i < objects_.size(); ++i) {
      if (is_per_leaf_) {
        objects_[i]->setWorldTransform(transform_of(posed.boxes[i]));
        continue;
      }
      const std::uint32_t first = posed.leaves.character(i).first_leaf, end = posed.leaves.end_leaf(i);
      for (std::uint32_t n = first; n < end; ++n)
        compounds_[i]->updateChildTransform(static_cast<int>(n - first), transform_of(posed.boxes[n]), false);
      compounds_[i]->recalculateLocalAabb();
    }
  }

  const PosedBoxes& posed_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_;
  bool is_per_leaf_;
  std::vector<std::unique_ptr<btBoxShape>> shapes_;
  std::vector<std::unique_ptr<btCompoundShape>> compounds_;
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
};

// Spheres and points against the tree by itself: volumes that meet a sphere's bounds, then our test.
class TreeQueries : public CrowdQueries, btDbvt::ICollide {
 public:
  TreeQueries(const PosedBoxes& posed, bool per_leaf)
      : posed_(posed),
        is_per_leaf_(per_leaf),
        nodes_(per_leaf ? posed.leaves.leaf_count() : posed.leaves.character_count()) {}

  void update(const PosedBoxes& posed) override {
    bounds_.set(posed, !is_per_leaf_);
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      set_leaf(tree_, nodes_[n], n, is_per_leaf_ ? bounds_.leaves[n] : bounds_.characters[n]);
    }
  }

  void answer(std::size_t, const QuestionSet& asked, Answers& out) override {
    overlaps_ = &out.overlaps;
    for (const std::uint32_t i : begin(asked, true, out)) {
      asked_ = &asked.peers[i];
      number_ = i;
      const btVector3 at(asked_->at[0], asked_->at[1], asked_->at[2]);
      tree_.collideTV(tree_.m_root, btDbvtVolume::FromCR(at, asked_->reach), *this);
    }
  }

 private:
  void test(std::uint32_t leaf) {
    if (square_distance(posed_.boxes[leaf], asked_->at) <= asked_->reach * asked_->reach)
      overlaps_->push_back({number_, leaf});
  }
  void Process(const btDbvtNode* node) override {
    const auto n = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(node->data));
    if (is_per_leaf_) return test(n);
    const std::uint32_t end = posed_.leaves.end_leaf(n);
    for (std::uint32_t leaf = posed_.leaves.character(n).first_leaf; leaf < end; ++leaf) test(leaf);
  }

  const PosedBoxes& posed_;
  bool is_per_leaf_;
  btDbvt tree_;
  std::vector<btDbvtNode*> nodes_;
  BoxBounds bounds_;
  const PeerQuery* asked_ = nullptr;
  std::uint32_t number_ = 0;
  std::vector<Overlap>* overlaps_ = nullptr;
};

std::vector<QuerySetup> query_setups() {
  const QueryMode sorted = {QueryKind::kRay, "sorted", "rayTest, rays sorted"};
  const std::vector<QueryMode> rays = {sorted,
                                       {QueryKind::kRay, "gjk sorted", "rayTest by GJK, rays sorted"},
                                       {QueryKind::kRay, "", "rayTest, rays as they come"}};
  const std::vector<QueryMode> spheres = {{QueryKind::kSphere, "", "collideTV, spheres sorted; a test from outside"}};
  const auto world = [](Objects objects) {
    return [objects](const PosedBoxes& posed) { return std::make_unique<RayWorld>(posed, objects); };
  };
  const auto tree = [](bool per_leaf) {
    return [per_leaf](const PosedBoxes& posed) { return std::make_unique<TreeQueries>(posed, per_leaf); };
  };
  return {{"world", true, "one object per leaf in a collision world", rays, world(Objects::kLeaves)},
          {"compound", true, "one compound per character with an inner tree", rays, world(Objects::kCompounds)},
          {"compound plain", true, "one compound per character without", {sorted}, world(Objects::kPlainCompounds)},
          {"link", false, "one leaf per link in btDbvt", spheres, tree(true)},
          {"character", false, "one leaf per character in btDbvt, then its boxes", spheres, tree(false)}};
}

}  // namespace

Peer bullet_peer() {
  return {
      "bullet",
      "libbullet-dev",
      std::to_string(BT_BULLET_VERSION / 100) + '.' + std::to_string(BT_BULLET_VERSION % 100) +
          (sizeof(btScalar) == sizeof(double) ? " double" : " float"),
      {{"world", true, "one object per link in a collision world, its own test of two boxes", make_world<true>},
       {"compound", true, "one compound of boxes per character in a collision world, its own tests", make_world<false>},
       {"link", false, "one leaf per link in btDbvt; an overlap test from outside", make_tree<true>},
       {"character", false,
        "one leaf per character in btDbvt, then its links' bounds; all inside a character from outside",
        make_tree<false>},
       {"shapes", true, "one object per link in a collision world, its own tests of shapes", make_world<true>,
        Leaves::kShapes},
       {"compound shapes", true, "one compound of shapes per character in a collision world, its own tests",
        make_world<false>, Leaves::kShapes},
       {"character shapes", false,
        "one leaf per character in btDbvt, then its links' bounds and boxes from outside, btGjkEpaSolver2::Distance",
        make_tree<false>, Leaves::kShapes}},
      query_setups()};
}

}  // namespace cab::perf
