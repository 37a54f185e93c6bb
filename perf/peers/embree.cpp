// Embree: trees over user primitives, and rtcCollide of scenes with each other and themselves.
#include <embree3/rtcore.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/peers/leaf_boxes.h"
#include "perf/peers/peer.h"

namespace cab::perf {
namespace {

// A scene with one primitive per link, or per character.
class Part {
 public:
  Part(RTCDevice device, const CrowdBoxes& boxes, bool per_link, RTCBuildQuality quality)
      : boxes_(boxes), per_link_(per_link), scene_(rtcNewScene(device)) {
    geometry_ = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetSceneBuildQuality(scene_, quality);
    if (quality == RTC_BUILD_QUALITY_LOW) {  // the tree is built once, by the fast builder, and refitted from then on
      rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
      rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
    }
    rtcSetGeometryUserData(geometry_, this);
    rtcSetGeometryBoundsFunction(geometry_, bound, this);
    rtcAttachGeometry(scene_, geometry_);
  }
  ~Part() {
    rtcReleaseGeometry(geometry_);
    rtcReleaseScene(scene_);
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  void add(std::uint32_t number) { numbers_.push_back(number); }
  bool empty() const { return numbers_.empty(); }
  std::uint32_t number(unsigned primitive) const { return numbers_[primitive]; }
  RTCScene scene() const { return scene_; }

  void commit() {
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(numbers_.size()));
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
  }

 private:
  static void bound(const RTCBoundsFunctionArguments* arguments) {
    const Part& self = *static_cast<const Part*>(arguments->geometryUserPtr);
    const std::uint32_t number = self.numbers_[arguments->primID];
    const WorldBounds& bounds = self.per_link_ ? self.boxes_.bounds(number) : self.boxes_.character(number);
    RTCBounds& out = *arguments->bounds_o;
    out.lower_x = bounds.low[0];
    out.lower_y = bounds.low[1];
    out.lower_z = bounds.low[2];
    out.upper_x = bounds.high[0];
    out.upper_y = bounds.high[1];
    out.upper_z = bounds.high[2];
  }

  const CrowdBoxes& boxes_;
  bool per_link_;
  RTCScene scene_;
  RTCGeometry geometry_;
  std::vector<std::uint32_t> numbers_;  // by primitive, of its link or character
};

// Who moves is in one scene, who rests in another that is built once.
class World {
 public:
  World(const scenes::Crowd& crowd, bool per_link) : boxes_(crowd), per_link_(per_link) {
    device_ = rtcNewDevice("threads=1");
    if (device_ == nullptr) throw std::runtime_error("embree: no device");
  }
  ~World() {
    moving_.reset();
    resting_.reset();
    rtcReleaseDevice(device_);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void run(const std::vector<scenes::PosedGroup>& posed, std::vector<LeafPair>& out) {
    boxes_.pose(posed);
    if (!moving_) make_parts(posed);
    if (!moving_->empty()) moving_->commit();
    pairs_ = &out;
    collide(*moving_, *moving_);
    collide(*moving_, *resting_);
    collide(*resting_, *resting_);
    if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
      throw std::runtime_error("embree: error " + std::to_string(error));
  }

 private:
  void make_parts(const std::vector<scenes::PosedGroup>& posed) {
    moving_.emplace(device_, boxes_, per_link_, RTC_BUILD_QUALITY_LOW);
    resting_.emplace(device_, boxes_, per_link_, RTC_BUILD_QUALITY_HIGH);
    const std::uint32_t count = per_link_ ? boxes_.leaves().leaf_count() : boxes_.leaves().character_count();
    for (std::uint32_t n = 0; n < count; ++n)
      (boxes_.leaves().rests(posed, per_link_ ? boxes_.character_of(n) : n) ? *resting_ : *moving_).add(n);
    if (!resting_->empty()) resting_->commit();
  }

  void collide(const Part& a, const Part& b) {
    if (a.empty() || b.empty()) return;
    a_ = &a;
    b_ = &b;
    rtcCollide(a.scene(), b.scene(), pair_found, this);
  }

  void test(std::uint32_t a, std::uint32_t b) {
    if (boxes_overlap(boxes_.box(a), boxes_.box(b))) pairs_->push_back(ordered_pair(a, b));
  }

  // A scene against itself gives each pair in both orders. Embree runs on one thread, so nothing is locked. The bounds
  // of the leaves of Embree's tree are looser than those of its primitives, so the latter are compared first.
  static void pair_found(void* user, RTCCollision* collisions, unsigned count) {
    World& self = *static_cast<World*>(user);
    for (const RTCCollision* c = collisions; c != collisions + count; ++c) {
      const std::uint32_t a = self.a_->number(c->primID0), b = self.b_->number(c->primID1);
      if (self.a_ == self.b_ && a >= b) continue;
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
  std::optional<Part> moving_, resting_;
  const Part *a_ = nullptr, *b_ = nullptr;  // of the collisions that are reported
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
