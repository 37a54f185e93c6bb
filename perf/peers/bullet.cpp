// Bullet: its collision world with its own test of two boxes, and its dynamic tree with our test.
#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>
#include <btBulletCollisionCommon.h>

#include <memory>
#include <string>
#include <vector>

#include "perf/peers/leaf_boxes.h"
#include "perf/peers/peer.h"

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
      if (added_ && leaves_.rests(posed, leaves_.character_of(n))) continue;
      if (!added_) objects_[n] = make_object(shapes_[leaves_.kind_of(n)].get(), n);
      objects_[n]->setWorldTransform(transform_of(leaves_.pose(posed, n)));
    }
  }
  // The boxes are placed in the world, and their object stays at its origin.
  void set_compounds(const std::vector<scenes::PosedGroup>& posed) {
    for (std::uint32_t i = 0; i < compounds_.size(); ++i) {
      if (added_ && leaves_.rests(posed, i)) continue;
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
    const bool built = !tree_.empty();
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      if (built && boxes_.leaves().rests(posed, per_link_ ? boxes_.character_of(n) : n)) continue;
      const WorldBounds& b = per_link_ ? boxes_.bounds(n) : boxes_.character(n);
      btDbvtVolume volume =
          btDbvtVolume::FromMM(btVector3(b.low[0], b.low[1], b.low[2]), btVector3(b.high[0], b.high[1], b.high[2]));
      if (!built)
        nodes_[n] = tree_.insert(volume, reinterpret_cast<void*>(std::uintptr_t{n}));
      else if (!nodes_[n]->volume.Contain(volume)) {
        volume.Expand(btVector3(kMargin, kMargin, kMargin));
        tree_.update(nodes_[n], volume);
      }
    }
    pairs_ = &out;
    tree_.collideTTpersistentStack(tree_.m_root, tree_.m_root, *this);
  }

 private:
  // How much bounds grow when they change, in metres, so that few frames have to insert a leaf into the tree again.
  static constexpr btScalar kMargin = 0.05f;

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
        make_tree<false>, Leaves::kShapes}}};
}

}  // namespace cab::perf
