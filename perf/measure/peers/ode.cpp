// ODE: its spaces, with its own test of two boxes and with our test.
#include <ode/ode.h>

#include <stdexcept>
#include <vector>

#include "perf/measure/peers/leaf_boxes.h"
#include "perf/measure/peers/peer.h"

namespace cab::perf {
namespace {

void require_ode() {
  static const bool ready = dInitODE2(0) != 0;
  if (!ready) throw std::runtime_error("ode: cannot be initialised");
}

// One geom per link, in one space per character, in one outer space.
class World {
 public:
  World(const scenes::Crowd& crowd, dSpaceID outer, bool own_test)
      : leaves_(crowd), boxes_(leaves_.leaf_count()), own_test_(own_test), outer_(outer) {
    geoms_.reserve(boxes_.size());
    for (std::uint32_t i = 0; i < leaves_.character_count(); ++i) {
      const dSpaceID inner = dSimpleSpaceCreate(outer_);
      dSpaceSetSublevel(inner, 1);
      for (std::uint32_t n = leaves_.character(i).first_leaf; n < leaves_.end_leaf(i); ++n) {
        const float(&half)[3] = leaves_.local_box(leaves_.kind_of(n)).half;
        geoms_.push_back(dCreateBox(inner, 2 * half[0], 2 * half[1], 2 * half[2]));
        dGeomSetData(geoms_.back(), reinterpret_cast<void*>(std::uintptr_t{n}));
      }
    }
  }
  ~World() { dSpaceDestroy(outer_); }  // and all in it
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    for (std::uint32_t n = 0; n < geoms_.size(); ++n) {
      const WorldBox<float>& box = boxes_[n] = leaves_.pose(posed, n);
      dMatrix3 rotation = {};  // three rows of four
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c) rotation[4 * c + k] = box.axis[k][c];
      dGeomSetPosition(geoms_[n], box.center[0], box.center[1], box.center[2]);
      dGeomSetRotation(geoms_[n], rotation);
    }
    pairs_ = &out;
    dSpaceCollide(outer_, this, pair_found);
  }

 private:
  // ODE calls this for two spaces, and then for two geoms, whose bounds overlap.
  static void pair_found(void* user, dGeomID a, dGeomID b) {
    World& self = *static_cast<World*>(user);
    if (dGeomIsSpace(a)) {
      dSpaceCollide2(a, b, user, pair_found);
      return;
    }
    const auto number = [](dGeomID geom) {
      return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(dGeomGetData(geom)));
    };
    const std::uint32_t na = number(a), nb = number(b);
    // One contact, without CONTACTS_UNIMPORTANT: that flag loses a sixth of the pairs (docs/peers.md).
    dContactGeom contact;
    if (self.own_test_ ? dCollide(a, b, 1, &contact, sizeof contact) > 0
                       : boxes_overlap(self.boxes_[na], self.boxes_[nb]))
      self.pairs_->push_back(ordered_pair(na, nb));
  }

  LeafPoser<float> leaves_;
  std::vector<WorldBox<float>> boxes_;
  bool own_test_;
  std::vector<dGeomID> geoms_;
  dSpaceID outer_;
  std::vector<LeafPair>* pairs_ = nullptr;
};

template <bool own_test>
PeerFrame make_sweep(const scenes::Crowd& crowd) {
  require_ode();
  return frame_of<World>(crowd, dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ), own_test);
}

// Cells of 1 to 4 m: a character is about 2 m high.
PeerFrame make_hash(const scenes::Crowd& crowd) {
  require_ode();
  const dSpaceID outer = dHashSpaceCreate(nullptr);
  dHashSpaceSetLevels(outer, 0, 2);
  return frame_of<World>(crowd, outer, false);
}

}  // namespace

Peer ode_peer() {
  return {"ode",
          "libode-dev",
          dODE_VERSION " double",
          {{"own", true, "one simple space per character in a sweep-and-prune space; its own test of two boxes",
            make_sweep<true>},
           {"sweep", false, "the same spaces; an overlap test from outside", make_sweep<false>},
           {"hash", false, "one simple space per character in a hash space; an overlap test from outside", make_hash}}};
}

}  // namespace cab::perf
