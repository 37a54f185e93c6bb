// Embree: trees over the triangles of skins as user primitives, and rtcCollide of two scenes.
#include <embree3/rtcore.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/measure/peers/surface_rivals.h"

namespace cab::perf {
namespace {

class EmbreeTrees {
 public:
  EmbreeTrees(const SurfaceWorld& world, Isa isa, bool refits)
      : skinned_(world, isa),
        device_(rtcNewDevice("threads=1")),
        parts_(world.instances.size()),
        pairs_(skinned_.kernels()) {
    if (device_ == nullptr) throw std::runtime_error("embree: no device");
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      Part& part = parts_[i];
      part.corners = skinned_.corners(i).data();
      part.scene = rtcNewScene(device_);
      part.geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
      rtcSetSceneBuildQuality(part.scene, RTC_BUILD_QUALITY_LOW);
      if (refits) {
        rtcSetSceneFlags(part.scene, RTC_SCENE_FLAG_DYNAMIC);
        rtcSetGeometryBuildQuality(part.geometry, RTC_BUILD_QUALITY_REFIT);
      }
      rtcSetGeometryUserPrimitiveCount(part.geometry, static_cast<unsigned>(skinned_.corners(i).size() / 3));
      rtcSetGeometryUserData(part.geometry, &part);
      rtcSetGeometryBoundsFunction(part.geometry, bound, nullptr);
      rtcAttachGeometry(part.scene, part.geometry);
    }
  }
  ~EmbreeTrees() {
    for (const Part& part : parts_) {
      rtcReleaseGeometry(part.geometry);
      rtcReleaseScene(part.scene);
    }
    rtcReleaseDevice(device_);
  }
  EmbreeTrees(const EmbreeTrees&) = delete;
  EmbreeTrees& operator=(const EmbreeTrees&) = delete;

  void run(std::uint32_t frame, std::vector<InstanceTriangles>& out) {
    out_ = &out;
    skinned_.skin(frame);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      skinned_.write_vertices(i, parts_[i].vertices);
      rtcCommitGeometry(parts_[i].geometry);
      rtcCommitScene(parts_[i].scene);
    }
    for (a_ = 0; a_ < parts_.size(); ++a_)
      for (b_ = a_ + 1; b_ < parts_.size(); ++b_) {
        if (!skinned_.are_near(a_, b_)) continue;
        rtcCollide(parts_[a_].scene, parts_[b_].scene, found, this);
        pairs_.finish(*out_);
      }
    if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
      throw std::runtime_error("embree: error " + std::to_string(error));
  }

 private:
  struct Part {
    RTCScene scene = nullptr;
    RTCGeometry geometry = nullptr;
    const std::uint32_t* corners = nullptr;
    std::vector<float> vertices;  // in the world

    const float* corner(unsigned triangle, std::size_t k) const {
      return vertices.data() + 3 * std::size_t{corners[3 * std::size_t{triangle} + k]};
    }
    void bounds(unsigned triangle, float (&lo)[3], float (&hi)[3]) const {
      const float *const p = corner(triangle, 0), *const q = corner(triangle, 1), *const r = corner(triangle, 2);
      for (std::size_t c = 0; c < 3; ++c) {
        lo[c] = std::min({p[c], q[c], r[c]});
        hi[c] = std::max({p[c], q[c], r[c]});
      }
    }
  };

  static void bound(const RTCBoundsFunctionArguments* arguments) {
    float lo[3], hi[3];
    static_cast<const Part*>(arguments->geometryUserPtr)->bounds(arguments->primID, lo, hi);
    RTCBounds& out = *arguments->bounds_o;
    out.lower_x = lo[0];
    out.lower_y = lo[1];
    out.lower_z = lo[2];
    out.upper_x = hi[0];
    out.upper_y = hi[1];
    out.upper_z = hi[2];
  }

  // The leaves of Embree's tree hold several primitives, whose own bounds are compared first.
  static void found(void* user, RTCCollision* collisions, unsigned count) {
    EmbreeTrees& self = *static_cast<EmbreeTrees*>(user);
    const Part &a = self.parts_[self.a_], &b = self.parts_[self.b_];
    for (const RTCCollision* one = collisions; one != collisions + count; ++one) {
      float lo_a[3], hi_a[3], lo_b[3], hi_b[3];
      a.bounds(one->primID0, lo_a, hi_a);
      b.bounds(one->primID1, lo_b, hi_b);
      bool overlap = true;
      for (int c = 0; c < 3; ++c) overlap = overlap & (lo_a[c] <= hi_b[c]) & (lo_b[c] <= hi_a[c]);
      if (!overlap) continue;
      self.pairs_.add({a.corner(one->primID0, 0), a.corner(one->primID0, 1), a.corner(one->primID0, 2)},
                      {b.corner(one->primID1, 0), b.corner(one->primID1, 1), b.corner(one->primID1, 2)},
                      {self.a_, one->primID0, self.b_, one->primID1}, *self.out_);
    }
  }

  SkinnedWorld skinned_;
  RTCDevice device_;
  std::vector<Part> parts_;
  std::uint32_t a_ = 0, b_ = 0;
  TrianglePairs pairs_;
  std::vector<InstanceTriangles>* out_ = nullptr;
};

}  // namespace

std::vector<SurfaceRival> embree_trees(const SurfaceWorld& world, Isa isa) {
  std::vector<SurfaceRival> out;
  for (const bool refits : {true, false}) {
    const auto trees = std::make_shared<EmbreeTrees>(world, isa, refits);
    const std::string how = refits ? "refitted" : "built anew in each frame";
    out.push_back({refits ? "embree refit" : "embree rebuild",
                   "all skinned likewise, trees of triangles " + how + ", rtcCollide, this engine's triangle kernel",
                   [trees](std::uint32_t frame, std::vector<InstanceTriangles>& pairs) { trees->run(frame, pairs); }});
  }
  return out;
}

}  // namespace cab::perf
