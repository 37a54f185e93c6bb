// Embree: trees over user primitives, rtcCollide of scenes with each other and themselves, and queries.
#include <embree3/rtcore.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/measure/peers/leaf_boxes.h"
#include "perf/measure/peers/peer.h"
#include "perf/measure/peers/query_boxes.h"

namespace cab::perf {
namespace {

void set_bounds(const WorldBounds& bounds, RTCBounds& out) {
  out.lower_x = bounds.low[0];
  out.lower_y = bounds.low[1];
  out.lower_z = bounds.low[2];
  out.upper_x = bounds.high[0];
  out.upper_y = bounds.high[1];
  out.upper_z = bounds.high[2];
}

RTCDevice make_device() {
  const RTCDevice device = rtcNewDevice("threads=1");
  if (device == nullptr) throw std::runtime_error("embree: no device");
  return device;
}

void check(RTCDevice device) {
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
    throw std::runtime_error("embree: error " + std::to_string(error));
}

// A scene with one primitive per link, or per character.
class World {
 public:
  World(const scenes::Crowd& crowd, bool per_link)
      : boxes_(crowd),
        per_link_(per_link),
        scene_(rtcNewScene(device_)),
        geometry_(rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER)) {
    // The tree is built once, by the fast builder, and refitted from then on.
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
    rtcSetGeometryUserPrimitiveCount(geometry_,
                                     per_link ? boxes_.leaves().leaf_count() : boxes_.leaves().character_count());
    rtcSetGeometryUserData(geometry_, this);
    rtcSetGeometryBoundsFunction(geometry_, bound, nullptr);
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
    check(device_);
  }

 private:
  static void bound(const RTCBoundsFunctionArguments* arguments) {
    const World& self = *static_cast<const World*>(arguments->geometryUserPtr);
    const std::uint32_t number = arguments->primID;
    set_bounds(self.per_link_ ? self.boxes_.bounds(number) : self.boxes_.character(number), *arguments->bounds_o);
  }

  void test(std::uint32_t a, std::uint32_t b) {
    if (boxes_overlap(boxes_.box(a), boxes_.box(b))) pairs_->push_back(ordered_pair(a, b));
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
  RTCDevice device_ = make_device();
  RTCScene scene_;
  RTCGeometry geometry_;
  std::vector<LeafPair>* pairs_ = nullptr;
};

template <bool per_link>
PeerFrame make(const scenes::Crowd& crowd) {
  return frame_of<World>(crowd, per_link);
}

// ----------------------------------------------------------------------------------------------------------- queries

// What a primitive is, and what the callback tests: a leaf, or a character with sixteen of its boxes at a time.
enum class Primitives : std::uint8_t { kLeaves, kBlocks };
enum class Build : std::uint8_t { kRefit, kMedium };

// How rays are given: as they come or sorted, and how many at a time.
struct RayMode {
  const char* name;
  unsigned width;
  bool is_sorted;
};
constexpr RayMode kRayModes[] = {
    {"1", 1, false}, {"1 sorted", 1, true}, {"8 sorted", 8, true}, {"16 sorted", 16, true}};

template <unsigned n>
struct RayTypes;
template <>
struct RayTypes<1> {
  using RayHit = RTCRayHit;
};
template <>
struct RayTypes<8> {
  using RayHit = RTCRayHit8;
};
template <>
struct RayTypes<16> {
  using RayHit = RTCRayHit16;
};

// What callbacks read, and what point queries write.
struct Asked {
  const PosedBoxes* posed = nullptr;
  const BoxBounds* bounds = nullptr;
  const BoxBlocks* blocks = nullptr;
  Primitives primitives = Primitives::kLeaves;
};
struct AskedPoint {
  const Asked* world;
  bool is_closest;
  std::uint32_t query;
  std::uint32_t leaf;
  float square;  // of the least distance so far, or of the radius
  std::vector<Overlap>* overlaps;
};

// The first box of a character that a ray enters before `most`, which becomes its distance. Returns whether there is
// one.
CAB_PEER_INLINE bool meet_character(const Asked& world, std::uint32_t character, const float (&at)[3],
                                    const float (&along)[3], float& most, unsigned& leaf) {
  std::uint32_t first = world.posed->leaves.character(character).first_leaf;
  bool is_met = false;
  for (std::uint32_t b = world.blocks->begin(character); b < world.blocks->end(character); ++b) {
    float distance[BoxBlock::kBoxes];
    ray_meets_block((*world.blocks)[b], at, along, most, distance);
    for (std::uint32_t i = 0; i < BoxBlock::kBoxes; ++i)
      if (distance[i] < most) {
        most = distance[i];
        leaf = first + i;
        is_met = true;
      }
    first += BoxBlock::kBoxes;
  }
  return is_met;
}

CAB_PEER_INLINE void intersect_one(const RTCIntersectFunctionNArguments& arguments) {
  if (arguments.valid[0] == 0) return;
  const Asked& world = *static_cast<const Asked*>(arguments.geometryUserPtr);
  auto& [ray, hit] = *reinterpret_cast<RTCRayHit*>(arguments.rayhit);
  const float at[3] = {ray.org_x, ray.org_y, ray.org_z}, along[3] = {ray.dir_x, ray.dir_y, ray.dir_z};
  unsigned leaf = arguments.primID;
  if (world.primitives == Primitives::kLeaves) {
    const float distance = ray_meets(world.posed->boxes[leaf], at, along, ray.tfar);
    if (!(distance < ray.tfar)) return;
    ray.tfar = distance;
  } else if (!meet_character(world, arguments.primID, at, along, ray.tfar, leaf)) {
    return;
  }
  hit.primID = leaf;
  hit.geomID = arguments.geomID;
  hit.instID[0] = arguments.context->instID[0];
}

// Of a leaf all rays at a time, of a character ray by ray.
template <unsigned n>
CAB_PEER_INLINE void intersect_packet(const RTCIntersectFunctionNArguments& arguments) {
  const Asked& world = *static_cast<const Asked*>(arguments.geometryUserPtr);
  auto& [ray, hit] = *reinterpret_cast<typename RayTypes<n>::RayHit*>(arguments.rayhit);
  if (world.primitives != Primitives::kLeaves) {
    for (unsigned i = 0; i < n; ++i) {
      if (arguments.valid[i] == 0) continue;
      const float at[3] = {ray.org_x[i], ray.org_y[i], ray.org_z[i]};
      const float along[3] = {ray.dir_x[i], ray.dir_y[i], ray.dir_z[i]};
      unsigned leaf = 0;
      if (!meet_character(world, arguments.primID, at, along, ray.tfar[i], leaf)) continue;
      hit.primID[i] = leaf;
      hit.geomID[i] = arguments.geomID;
    }
    return;
  }
  const WorldBox<float>& box = world.posed->boxes[arguments.primID];
  float met[n];
  for (unsigned i = 0; i < n; ++i) {
    const float x = ray.org_x[i] - box.center[0], y = ray.org_y[i] - box.center[1], z = ray.org_z[i] - box.center[2];
    float near = 0, far = ray.tfar[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const float(&a)[3] = box.axis[k];
      narrow(a[0] * x + a[1] * y + a[2] * z, a[0] * ray.dir_x[i] + a[1] * ray.dir_y[i] + a[2] * ray.dir_z[i],
             box.half[k], near, far);
    }
    met[i] = near > far ? kNoHit : near;
  }
  for (unsigned i = 0; i < n; ++i) {
    const bool is_met = arguments.valid[i] != 0 && met[i] < ray.tfar[i];
    ray.tfar[i] = is_met ? met[i] : ray.tfar[i];
    hit.primID[i] = is_met ? arguments.primID : hit.primID[i];
    hit.geomID[i] = is_met ? arguments.geomID : hit.geomID[i];
  }
}

CAB_PEER_INLINE void intersect(const RTCIntersectFunctionNArguments& arguments) {
  switch (arguments.N) {
    case 1: return intersect_one(arguments);
    case 8: return intersect_packet<8>(arguments);
    case 16: return intersect_packet<16>(arguments);
    default: return;  // no other width is asked for
  }
}

// Returns whether the query's radius has changed.
CAB_PEER_INLINE bool meet_square(AskedPoint& asked, float square, std::uint32_t leaf) {
  if (!asked.is_closest) {
    if (square <= asked.square) asked.overlaps->push_back({asked.query, leaf});
    return false;
  }
  if (!(square < asked.square)) return false;
  asked.square = square;
  asked.leaf = leaf;
  return true;
}

CAB_PEER_INLINE bool meet_point(RTCPointQueryFunctionArguments& arguments) {
  AskedPoint& asked = *static_cast<AskedPoint*>(arguments.userPtr);
  const Asked& world = *asked.world;
  const float at[3] = {arguments.query->x, arguments.query->y, arguments.query->z};
  bool is_nearer = false;
  if (world.primitives == Primitives::kLeaves) {
    is_nearer = meet_square(asked, square_distance(world.posed->boxes[arguments.primID], at), arguments.primID);
  } else {
    std::uint32_t first = world.posed->leaves.character(arguments.primID).first_leaf;
    for (std::uint32_t b = world.blocks->begin(arguments.primID); b < world.blocks->end(arguments.primID); ++b) {
      float square[BoxBlock::kBoxes];
      square_distances((*world.blocks)[b], at, square);
      for (std::uint32_t i = 0; i < BoxBlock::kBoxes; ++i) is_nearer |= meet_square(asked, square[i], first + i);
      first += BoxBlock::kBoxes;
    }
  }
  if (is_nearer) arguments.query->radius = std::sqrt(asked.square);
  return is_nearer;
}

// The callbacks for the instruction sets of the machine, since Embree chooses its own too.
struct Callbacks {
  RTCIntersectFunctionN intersect;
  RTCPointQueryFunction meet_point;
};
void intersect_plain(const RTCIntersectFunctionNArguments* arguments) { intersect(*arguments); }
bool meet_point_plain(RTCPointQueryFunctionArguments* arguments) { return meet_point(*arguments); }
#ifdef __x86_64__
#define CAB_PEER_AVX2 __attribute__((target("avx2,fma")))
#ifdef __clang__
#define CAB_PEER_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")))
#else
#define CAB_PEER_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,avx512bw,avx2,fma,prefer-vector-width=512")))
#endif
CAB_PEER_AVX2 void intersect_avx2(const RTCIntersectFunctionNArguments* arguments) { intersect(*arguments); }
CAB_PEER_AVX2 bool meet_point_avx2(RTCPointQueryFunctionArguments* arguments) { return meet_point(*arguments); }
CAB_PEER_AVX512 void intersect_avx512(const RTCIntersectFunctionNArguments* arguments) { intersect(*arguments); }
CAB_PEER_AVX512 bool meet_point_avx512(RTCPointQueryFunctionArguments* arguments) { return meet_point(*arguments); }
#endif

Callbacks choose_callbacks() {
#ifdef __x86_64__
  const bool is_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (is_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    return {intersect_avx512, meet_point_avx512};
  if (is_avx2) return {intersect_avx2, meet_point_avx2};
#endif
  return {intersect_plain, meet_point_plain};
}

class Queries : public CrowdQueries {
 public:
  Queries(const PosedBoxes& posed, Primitives primitives, Build build)
      : callbacks_(choose_callbacks()), device_(make_device()) {
    asked_ = {&posed, &bounds_, &blocks_, primitives};
    scene_ = rtcNewScene(device_);
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    const RTCBuildQuality quality = build == Build::kMedium ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_LOW;
    rtcSetSceneBuildQuality(scene_, quality);
    if (build != Build::kMedium) rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetGeometryBuildQuality(geometry_, build == Build::kRefit ? RTC_BUILD_QUALITY_REFIT : quality);
    rtcSetGeometryUserPrimitiveCount(
        geometry_, primitives == Primitives::kLeaves ? posed.leaves.leaf_count() : posed.leaves.character_count());
    rtcSetGeometryUserData(geometry_, &asked_);
    rtcSetGeometryBoundsFunction(geometry_, bound, nullptr);
    rtcSetGeometryIntersectFunction(geometry_, callbacks_.intersect);
    rtcAttachGeometry(scene_, geometry_);
  }
  ~Queries() override {
    rtcReleaseGeometry(geometry_);
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Queries(const Queries&) = delete;
  Queries& operator=(const Queries&) = delete;

  void update(const PosedBoxes& posed) override {
    bounds_.set(posed, asked_.primitives != Primitives::kLeaves);
    if (asked_.primitives == Primitives::kBlocks) blocks_.set(posed);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    check(device_);
  }

  // The ray modes, then spheres, then points as they come and sorted.
  void answer(std::size_t mode, const QuestionSet& asked, Answers& out) override {
    const bool is_ray = mode < std::size(kRayModes);
    const std::vector<std::uint32_t>& order = begin(
        asked, is_ray ? kRayModes[mode].is_sorted : asked.kind == QueryKind::kSphere || mode > std::size(kRayModes) + 1,
        out);
    switch (is_ray ? kRayModes[mode].width : 0) {
      case 0: answer_points(asked, order, out); break;
      case 1: cast<1>(asked, order, out); break;
      case 8: cast<8>(asked, order, out); break;
      default: cast<16>(asked, order, out); break;
    }
    check(device_);
  }

 private:
  static void bound(const RTCBoundsFunctionArguments* arguments) {
    const Asked& self = *static_cast<const Asked*>(arguments->geometryUserPtr);
    const bool is_leaf = self.primitives == Primitives::kLeaves;
    set_bounds((is_leaf ? self.bounds->leaves : self.bounds->characters)[arguments->primID], *arguments->bounds_o);
  }

  template <unsigned n>
  void cast(const QuestionSet& asked, const std::vector<std::uint32_t>& order, Answers& out) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const std::size_t count = order.size();
    for (std::size_t first = 0; first < count; first += n) {
      alignas(64) typename RayTypes<n>::RayHit packet;
      alignas(64) int valid[n];
      auto* const ray = reinterpret_cast<RTCRayN*>(&packet.ray);
      auto* const hit = reinterpret_cast<RTCHitN*>(&packet.hit);
      for (unsigned i = 0; i < n; ++i) {
        const PeerQuery& query = asked.peers[order[first + i < count ? first + i : first]];
        valid[i] = first + i < count ? -1 : 0;
        RTCRayN_org_x(ray, n, i) = query.at[0];
        RTCRayN_org_y(ray, n, i) = query.at[1];
        RTCRayN_org_z(ray, n, i) = query.at[2];
        RTCRayN_dir_x(ray, n, i) = query.direction[0];
        RTCRayN_dir_y(ray, n, i) = query.direction[1];
        RTCRayN_dir_z(ray, n, i) = query.direction[2];
        RTCRayN_tnear(ray, n, i) = RTCRayN_time(ray, n, i) = 0;
        RTCRayN_tfar(ray, n, i) = query.reach;
        RTCRayN_mask(ray, n, i) = 0xffffffff;
        RTCRayN_id(ray, n, i) = RTCRayN_flags(ray, n, i) = 0;
        RTCHitN_geomID(hit, n, i) = RTC_INVALID_GEOMETRY_ID;
        RTCHitN_instID(hit, n, i, 0) = RTC_INVALID_GEOMETRY_ID;
      }
      if constexpr (n == 1)
        rtcIntersect1(scene_, &context, &packet);
      else if constexpr (n == 8)
        rtcIntersect8(valid, scene_, &context, &packet);
      else
        rtcIntersect16(valid, scene_, &context, &packet);
      for (unsigned i = 0; i < n && first + i < count; ++i) {
        if (RTCHitN_geomID(hit, n, i) == RTC_INVALID_GEOMETRY_ID) continue;
        out.distances[order[first + i]] = RTCRayN_tfar(ray, n, i);
        out.leaves[order[first + i]] = RTCHitN_primID(hit, n, i);
      }
    }
  }

  void answer_points(const QuestionSet& asked, const std::vector<std::uint32_t>& order, Answers& out) {
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    const bool is_closest = asked.kind == QueryKind::kPoint;
    for (const std::uint32_t number : order) {
      const PeerQuery& query = asked.peers[number];
      RTCPointQuery point;
      point.x = query.at[0];
      point.y = query.at[1];
      point.z = query.at[2];
      point.time = 0;
      point.radius = is_closest ? kNoHit : query.reach;
      AskedPoint state = {&asked_,      is_closest, number, 0, is_closest ? kNoHit : query.reach * query.reach,
                          &out.overlaps};
      rtcPointQuery(scene_, &point, &context, callbacks_.meet_point, &state);
      if (!is_closest || !(state.square < kNoHit)) continue;
      out.distances[number] = std::sqrt(state.square);
      out.leaves[number] = state.leaf;
    }
  }

  Callbacks callbacks_;
  RTCDevice device_;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
  Asked asked_;
  BoxBounds bounds_;
  BoxBlocks blocks_;
};

std::vector<QuerySetup> query_setups() {
  std::vector<QuerySetup> out;
  const auto add = [&out](const char* name, const char* meaning, Primitives primitives, Build build) {
    QuerySetup& setup = out.emplace_back();
    setup.name = name;
    setup.alone = false;
    setup.meaning = meaning;
    for (const RayMode& mode : kRayModes)
      setup.modes.push_back(
          {QueryKind::kRay, mode.name,
           "rtcIntersect" + std::to_string(mode.width) + (mode.is_sorted ? ", rays sorted" : ", rays as they come")});
    setup.modes.push_back({QueryKind::kSphere, "sorted", "rtcPointQuery with the radius, spheres sorted"});
    setup.modes.push_back({QueryKind::kPoint, "", "rtcPointQuery, points as they come"});
    setup.modes.push_back({QueryKind::kPoint, "sorted", "rtcPointQuery, points sorted"});
    setup.make = [primitives, build](const PosedBoxes& posed) {
      return std::make_unique<Queries>(posed, primitives, build);
    };
  };
  add("leaf refit", "one primitive per leaf; tree built once and refitted", Primitives::kLeaves, Build::kRefit);
  add("character blocks refit",
      "one primitive per character, then its boxes, sixteen at a time; tree built once and refitted",
      Primitives::kBlocks, Build::kRefit);
  add("character blocks medium",
      "one primitive per character, then its boxes, sixteen at a time; tree rebuilt at medium quality",
      Primitives::kBlocks, Build::kMedium);
  return out;
}

}  // namespace

Peer embree_peer() {
  return {
      "embree",
      "libembree-dev",
      RTC_VERSION_STRING " float",
      {{"link", false, "one primitive per link, tree refitted, rtcCollide; an overlap test from outside", make<true>},
       {"character", false, "one primitive per character, then its links' bounds; all inside a character from outside",
        make<false>}},
      query_setups()};
}

}  // namespace cab::perf
