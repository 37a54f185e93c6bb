// Bullet: its collision world with its own test of two boxes, and its dynamic tree with a test from outside.
#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <btBulletCollisionCommon.h>

#include <memory>
#include <string>
#include <vector>

#include "perf/peers/leaf_boxes.h"
#include "perf/peers/peer.h"

namespace cab::perf {
namespace {

// ------------------------------------------------------------------------- the collision world, an object a link

// Links of one character are kept out of the pair cache.
struct BetweenCharacters : btOverlapFilterCallback {
  std::uint32_t leaves = 1;
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    const auto character = [this](const btBroadphaseProxy* proxy) {
      return static_cast<std::uint32_t>(static_cast<const btCollisionObject*>(proxy->m_clientObject)->getUserIndex()) /
             leaves;
    };
    return character(a) != character(b);
  }
};

class LinkWorld {
 public:
  LinkWorld(const scenes::Character& figure, std::uint32_t count)
      : poser_(figure), dispatcher_(&configuration_), world_(&dispatcher_, &broadphase_, &configuration_) {
    // Pairs are found in one pass over the trees at the end, not object by object: all objects move.
    broadphase_.m_deferedcollide = true;
    filter_.leaves = poser_.leaf_count();
    world_.getPairCache()->setOverlapFilterCallback(&filter_);
    for (std::uint32_t leaf = 0; leaf < poser_.leaf_count(); ++leaf) {
      const float(&half)[3] = poser_.local_box(leaf).half;
      shapes_.push_back(std::make_unique<btBoxShape>(btVector3(half[0], half[1], half[2])));
    }
    objects_.resize(std::size_t{count} * shapes_.size());
  }
  ~LinkWorld() {
    if (!added_) return;
    for (const auto& object : objects_) world_.removeCollisionObject(object.get());
  }
  LinkWorld(const LinkWorld&) = delete;
  LinkWorld& operator=(const LinkWorld&) = delete;

  void run(const scenes::PosedGroup& posed, std::vector<LeafPair>& out) {
    const std::uint32_t leaves = poser_.leaf_count();
    for (std::uint32_t n = 0; n < objects_.size(); ++n) {
      if (!added_) {
        objects_[n] = std::make_unique<btCollisionObject>();
        objects_[n]->setCollisionShape(shapes_[n % leaves].get());
        objects_[n]->setUserIndex(static_cast<int>(n));
      }
      const WorldBox<btScalar> box = poser_.pose(posed, n / leaves, n % leaves);
      const auto& r = box.axis;
      objects_[n]->setWorldTransform(
          btTransform(btMatrix3x3(r[0][0], r[1][0], r[2][0], r[0][1], r[1][1], r[2][1], r[0][2], r[1][2], r[2][2]),
                      btVector3(box.center[0], box.center[1], box.center[2])));
      if (!added_) world_.addCollisionObject(objects_[n].get());
    }
    added_ = true;
    world_.performDiscreteCollisionDetection();
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
      const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
      bool overlap = false;  // contacts are kept up to a distance
      for (int c = 0; c < manifold.getNumContacts(); ++c)
        overlap = overlap || manifold.getContactPoint(c).getDistance() <= 0;
      if (overlap)
        out.push_back(ordered_pair(static_cast<std::uint32_t>(manifold.getBody0()->getUserIndex()),
                                   static_cast<std::uint32_t>(manifold.getBody1()->getUserIndex())));
    }
  }

 private:
  LeafPoser<btScalar> poser_;
  BetweenCharacters filter_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_;
  std::vector<std::unique_ptr<btBoxShape>> shapes_;
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
  bool added_ = false;
};

// ------------------------------------------------------------------------------------------- its tree, and no more

class TreeWorld : btDbvt::ICollide {
 public:
  TreeWorld(const scenes::Character& figure, std::uint32_t count, bool per_link)
      : boxes_(figure, count),
        per_link_(per_link),
        leaves_(per_link ? std::size_t{count} * boxes_.leaf_count() : count) {}

  void run(const scenes::PosedGroup& posed, std::vector<LeafPair>& out) {
    boxes_.pose(posed);
    const bool built = !tree_.empty();
    for (std::uint32_t n = 0; n < leaves_.size(); ++n) {
      const WorldBounds& b = per_link_ ? boxes_.bounds(n) : boxes_.character(n);
      btDbvtVolume volume =
          btDbvtVolume::FromMM(btVector3(b.low[0], b.low[1], b.low[2]), btVector3(b.high[0], b.high[1], b.high[2]));
      if (!built)
        leaves_[n] = tree_.insert(volume, reinterpret_cast<void*>(std::uintptr_t{n}));
      else if (!leaves_[n]->volume.Contain(volume)) {
        volume.Expand(btVector3(kMargin, kMargin, kMargin));
        tree_.update(leaves_[n], volume);
      }
    }
    pairs_ = &out;
    tree_.collideTTpersistentStack(tree_.m_root, tree_.m_root, *this);
  }

 private:
  // Metres that bounds are grown by when they change, so that a leaf is put into the tree anew in a few frames only.
  static constexpr btScalar kMargin = 0.05f;

  void test(std::uint32_t a, std::uint32_t b) {
    if (boxes_overlap(boxes_.box(a), boxes_.box(b))) pairs_->push_back(ordered_pair(a, b));
  }

  void Process(const btDbvtNode* a, const btDbvtNode* b) override {
    const auto number = [](const btDbvtNode* node) {
      return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(node->data));
    };
    const std::uint32_t na = number(a), nb = number(b);
    if (na == nb) return;
    if (!per_link_)
      boxes_.for_leaves(na, nb, [this](std::uint32_t la, std::uint32_t lb) { test(la, lb); });
    else if (boxes_.character_of(na) != boxes_.character_of(nb) && bounds_meet(boxes_.bounds(na), boxes_.bounds(nb)))
      test(na, nb);
  }

  CrowdBoxes boxes_;
  bool per_link_;
  btDbvt tree_;
  std::vector<btDbvtNode*> leaves_;
  std::vector<LeafPair>* pairs_ = nullptr;
};

PeerFrame make_world(const scenes::Character& figure, std::uint32_t count) {
  const auto world = std::make_shared<LinkWorld>(figure, count);
  return [world](const scenes::PosedGroup& posed, std::vector<LeafPair>& pairs) { world->run(posed, pairs); };
}
template <bool per_link>
PeerFrame make_tree(const scenes::Character& figure, std::uint32_t count) {
  const auto world = std::make_shared<TreeWorld>(figure, count, per_link);
  return [world](const scenes::PosedGroup& posed, std::vector<LeafPair>& pairs) { world->run(posed, pairs); };
}

}  // namespace

Peer bullet_peer() {
  return {"bullet",
          "libbullet-dev",
          std::to_string(BT_BULLET_VERSION / 100) + '.' + std::to_string(BT_BULLET_VERSION % 100) +
              (sizeof(btScalar) == sizeof(double) ? " double" : " float"),
          {{"world", "an object a link in a collision world, its own test of two boxes", make_world},
           {"link", "a leaf a link in btDbvt; an overlap test from outside", make_tree<true>},
           {"character", "a leaf a character in btDbvt, then its links' bounds; all inside a character from outside",
            make_tree<false>}}};
}

}  // namespace cab::perf
