// Embree: a tree over user primitives, and rtcCollide of the scene with itself.
#include <embree3/rtcore.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "perf/peers/leaf_boxes.h"
#include "perf/peers/peer.h"

namespace cab::perf {
namespace {

class World {
 public:
  World(const scenes::Crowd& crowd, bool per_link) : boxes_(crowd), per_link_(per_link) {
    device_ = rtcNewDevice("threads=1");
    if (device_ == nullptr) throw std::runtime_error("embree: no device");
    scene_ = rtcNewScene(device_);
    // The tree is built once, by the fast builder, and refitted from then on.
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
    rtcSetGeometryUserPrimitiveCount(geometry_,
                                     per_link ? boxes_.leaves().leaf_count() : boxes_.leaves().character_count());
    rtcSetGeometryUserData(geometry_, this);
    rtcSetGeometryBoundsFunction(geometry_, bound, this);
    rtcAttachGeometry(scene_, geometry_);
  }
  ~World() {
    rtcReleaseGeometry(geometry_);
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    boxes_.pose(posed);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    pairs_ = &out;
    rtcCollide(scene_, scene_, pair_found, this);
    if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
      throw std::runtime_error("embree: error " + std::to_string(error));
  }

 private:
  static void bound(const RTCBoundsFunctionArguments* arguments) {
    const World& self = *static_cast<const World*>(arguments->geometryUserPtr);
    const WorldBounds& bounds =
        self.per_link_ ? self.boxes_.bounds(arguments->primID) : self.boxes_.character(arguments->primID);
    RTCBounds& out = *arguments->bounds_o;
    out.lower_x = bounds.low[0];
    out.lower_y = bounds.low[1];
    out.lower_z = bounds.low[2];
    out.upper_x = bounds.high[0];
    out.upper_y = bounds.high[1];
    out.upper_z = bounds.high[2];
  }

  void test(std::uint32_t a, std::uint32_t b) {
    if (boxes_overlap(boxes_.box(a), boxes_.box(b))) pairs_->push_back({a, b});
  }

  // A scene against itself gives each pair in both orders. Embree runs on one thread, so nothing is locked. The bounds
  // of the leaves of Embree's tree are looser than those of its primitives, so the latter are compared first.
  static void pair_found(void* user, RTCCollision* collisions, unsigned count) {
    World& self = *static_cast<World*>(user);
    for (const RTCCollision* c = collisions; c != collisions + count; ++c) {
      const std::uint32_t a = c->primID0, b = c->primID1;
      if (a >= b) continue;
      if (!self.per_link_) {
        self.boxes_.for_leaves(a, b, [&self](std::uint32_t la, std::uint32_t lb) { self.test(la, lb); });
      } else if (self.boxes_.character_of(a) != self.boxes_.character_of(b) &&
                 bounds_overlap(self.boxes_.bounds(a), self.boxes_.bounds(b))) {
        self.test(a, b);
      }
    }
  }

  CrowdBoxes boxes_;
  bool per_link_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
  std::vector<LeafPair>* pairs_ = nullptr;
};

template <bool per_link>
PeerFrame make(const scenes::Crowd& crowd) {
  return frame_of<World>(crowd, per_link);
}

}  // namespace

Peer embree_peer() {
  return {
      "embree",
      "libembree-dev",
      RTC_VERSION_STRING " float",
      {{"link", false, "one primitive per link, tree refitted, rtcCollide; an overlap test from outside", make<true>},
       {"character", false, "one primitive per character, then its links' bounds; all inside a character from outside",
        make<false>}}};
}

}  // namespace cab::perf
