// Verifies the exact test of surfaces: random skins, posed and put so that triangles touch. Every instruction set must
// skin them alike and find the same pairs. What the function of a frame then says, in double where floats leave pairs
// open, is judged for every two triangles whose bounds overlap, from vertices that long double puts in place.
#include <algorithm>
#include <cstring>
#include <iterator>
#include <tuple>

#include "engine/exact/surface.h"
#include "kernels/surface/test_surfaces.h"
#include "layout/arena.h"
#include "layout/articulation.h"
#include "layout/rounded_up.h"
#include "perf/base/report.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/quad.h"
#include "perf/judge/oracle/random_surfaces.h"
#include "perf/judge/oracle/triangle_certificate.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

using oracle::Point;
using oracle::Real;
using oracle::Triangle;

// Skins of each regime per round. Each is posed kPoses times, in each of which two leaves are put together kCases times
// by every method but the last. That takes a pose of its own, once.
constexpr std::uint32_t kSkins = 4, kPoses = 2, kCases = 2;

// The most triangles of a leaf: of most skins, and of one in kLarge, which has leaves of more than sixteen patches.
constexpr unsigned kMostTriangles = 40, kMostOfLarge = 400, kLarge = 32;

// docs/exact.md: triangles that are reported are at most this far apart, in parts of the numbers that place them.
constexpr Real kWidestGap = 0x1p-40L;

// What long double cannot tell from touching, in the same parts: its rounding is some hundred times 2^-64.
constexpr Real kUnclear = 1e-15L;

// How two leaves are put together.
enum Method : std::size_t {
  kNear,    // their middles, with a shift
  kCorner,  // a corner of the one at a point of the other, with a gap of any size
  kSame,    // two instances with one pose at one place
  kAlong,   // the same, shifted along the plane of a triangle
  kWithin,  // two leaves of one instance
  kMargin,  // as the first two, with a margin
  kFar      // likewise without, by instances that are 1 to 1e7 sizes from their origins
};
constexpr const char* kMethods[] = {"near", "corner", "same place", "along a plane", "one instance", "margin", "far"};

// The triangles of a leaf of an instance about its origin.
struct Surface {
  std::vector<Triangle<Real>> at;
  std::vector<Real> numbers;  // how large those are that place each triangle
  Point lo, hi;               // bounds of all

  Point middle() const { return Real{0.5} * (lo + hi); }
  double extent() const { return static_cast<double>(norm_max(hi - lo)); }
};

Surface placed(const oracle::SkinRig& rig, const SkinDesc& skin, const std::vector<oracle::ExactPose>& poses,
               std::size_t leaf) {
  Surface out;
  const std::vector<std::uint32_t>& corners = rig.triangles[leaf];
  for (std::size_t t = 0; t < corners.size(); t += 3) {
    Triangle<Real> one;
    Real numbers = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Point at = one.corner[k] = skinned_vertex(skin, poses, corners[t + k]);
      numbers = std::max(numbers, numbers_of_vertex(skin, poses, corners[t + k]));
      if (t + k == 0) out.lo = out.hi = at;
      for (std::size_t c = 0; c < 3; ++c) {
        out.lo[c] = std::min(out.lo[c], at[c]);
        out.hi[c] = std::max(out.hi[c], at[c]);
      }
    }
    out.at.push_back(one);
    out.numbers.push_back(numbers);
  }
  return out;
}

// A skin as one instruction set places it.
struct Skinning {
  const kernel::KernelTable& kernels;
  SkinCache cache = {};
  FrameStats stats = {};

  SkinCounts counts() { return {stats.leaves_skinned, stats.leaves_replaced}; }
};

// Three instances of a skin (oracle::random_surface_poses), as the engine has them and as the judge does.
class Posed {
 public:
  Posed(const oracle::SkinRig& rig, const Articulation& articulation, oracle::Poses poses)
      : rig_(rig), poses_(std::move(poses)) {
    const ArticulationDesc desc = rig.desc();
    for (std::uint32_t i = 0; i < 2; ++i) {
      const std::vector<oracle::ExactPose> exact = exact_poses(poses_, i);
      for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf)
        surfaces_.push_back(placed(rig, desc.skin, exact, leaf));
    }
    input_ = poses_.input({});
    batch_.articulation = batch_.active = &articulation;
    batch_.input = &input_;
    batch_.instance_count = poses_.instance_count;
    batch_.link_stride = link_bytes(input_.poses);
    batch_.instance_stride = instance_bytes(input_.poses, poses_.link_count);
  }
  Posed(const Posed&) = delete;
  Posed& operator=(const Posed&) = delete;

  const oracle::SkinRig& rig() const { return rig_; }
  const Surface& surface(std::uint32_t instance, std::uint32_t leaf) const {
    return surfaces_[instance % 2 * rig_.leaves.size() + leaf];
  }
  ExactLeaf leaf(std::uint32_t instance, std::uint32_t index) const {
    ExactLeaf out = {};
    out.batch = &batch_;
    out.instance = instance;
    out.leaf = out.shape = index;
    return out;
  }
  void put(std::uint32_t instance, const oracle::Vec3<double>& origin) {
    std::copy_n(origin.v, 3, poses_.origins.begin() + 3 * std::ptrdiff_t{instance});
  }
  Point origin(std::uint32_t instance) const { return exact_origin(poses_, instance); }

 private:
  const oracle::SkinRig& rig_;
  oracle::Poses poses_;
  BatchInput input_;
  InstanceBatch batch_;
  std::vector<Surface> surfaces_;  // of the first two instances
};

// Two leaves that are put together.
struct Case {
  std::size_t method;
  std::uint32_t instance[2], leaf[2];
  float margin;
};

// ---------------------------------------------------------------------------------------------------- instruction sets

// A pair of triangles as test_surfaces names it, and whether it touches or is undecided.
struct FoundPair {
  std::uint32_t a, b;
  bool touches;
  bool operator<(const FoundPair& other) const {
    return std::tie(a, b, touches) < std::tie(other.a, other.b, other.touches);
  }
};

const PairedBatches kNotPaired = {};

FrameContext frame_of(const kernel::KernelTable& kernels) { return {kernels, {}, kNotPaired, {}}; }

// What the kernels of an instruction set find, in order.
std::vector<FoundPair> found_by(Skinning& by, const ExactLeaf& a, const ExactLeaf& b, float margin) {
  const FrameContext frame = frame_of(by.kernels);
  const SurfaceLeaves& surface = a.batch->articulation->surface;
  const SurfaceLeaf &of_a = surface.leaves[a.leaf], &of_b = surface.leaves[b.leaf];
  const kernel::SkinnedLeaf &skin_a = skinned(frame, a, nullptr, by.cache, by.counts()),
                            &skin_b = skinned(frame, b, &skin_a, by.cache, by.counts());
  kernel::SurfacePair pair = {skin_a,
                              skin_b,
                              surface.patches.data + of_a.patch_begin,
                              surface.patches.data + of_b.patch_begin,
                              of_a.patch_count,
                              of_b.patch_count,
                              {},
                              0,
                              margin,
                              0};
  double shift[3];
  origin_difference(a, b, shift);
  float size = skin_a.size + skin_b.size;
  for (std::uint32_t c = 0; c < 3; ++c) {
    pair.shift[c] = static_cast<float>(shift[c]);
    size += std::fabs(pair.shift[c]);
  }
  pair.error = kSurfaceError * size;
  pair.reach = rounded_up(double{pair.error} + double{margin});
  std::vector<FoundPair> out;
  by.kernels.test_surfaces(pair, &out, [](void* taker, const kernel::TrianglePairs& pairs) {
    for (std::uint32_t lane = 0; lane < pairs.count; ++lane)
      if ((pairs.touching | pairs.undecided) >> lane & 1)
        static_cast<std::vector<FoundPair>*>(taker)->push_back(
            {pairs.a[lane], pairs.b[lane], (pairs.touching >> lane & 1) != 0});
    return true;
  });
  std::sort(out.begin(), out.end());
  return out;
}

// Whether two instruction sets have the same bits for a leaf.
bool same_skin(const ExactLeaf& leaf, Skinning& by, Skinning& other) {
  const SurfaceLeaf& of = leaf.batch->articulation->surface.leaves[leaf.leaf];
  const kernel::SkinnedLeaf &x = skinned(frame_of(by.kernels), leaf, nullptr, by.cache, by.counts()),
                            &y = skinned(frame_of(other.kernels), leaf, nullptr, other.cache, other.counts());
  return std::memcmp(x.vertices, y.vertices, sizeof(float) * 4 * kLanes * of.block_count) == 0 &&
         std::memcmp(x.bounds, y.bounds, sizeof(AabbTile) * kernel::bounds_tiles(of.patch_count)) == 0 &&
         x.size == y.size;
}

// Compares the others with the first of them, and counts what floats leave undecided.
void compare(Task& task, const Case& made, const ExactLeaf& a, const ExactLeaf& b, std::vector<Skinning>& skinnings) {
  Tally& tally = task.tallies[made.method];
  const std::vector<FoundPair> found = found_by(skinnings.front(), a, b, made.margin);
  for (const FoundPair& pair : found) tally.undecided += !pair.touches;
  for (Skinning& other : skinnings) {
    if (&other == &skinnings.front()) continue;
    const std::vector<FoundPair> by_other = found_by(other, a, b, made.margin);
    std::vector<FoundPair> differing;
    std::set_symmetric_difference(found.begin(), found.end(), by_other.begin(), by_other.end(),
                                  std::back_inserter(differing));
    tally.differing += differing.size();
    const bool skins_differ = !same_skin(a, skinnings.front(), other) || !same_skin(b, skinnings.front(), other);
    if (!differing.empty() || skins_differ)
      task.violation(made.method, "instruction sets differ: leaves " + std::to_string(a.leaf) + " and " +
                                      std::to_string(b.leaf) + ", " + std::to_string(differing.size()) + " pairs");
  }
}

// --------------------------------------------------------------------------------------------------------------- judge

std::string to_text(const Triangle<Real>& triangle) {
  std::string out;
  for (const Point& corner : triangle.corner) {
    out += " (";
    for (std::size_t c = 0; c < 3; ++c) out += (c == 0 ? "" : " ") + shortest(static_cast<double>(corner[c]));
    out += ")";
  }
  return out;
}

Triangle<oracle::Quad> widened(const Triangle<Real>& triangle) {
  Triangle<oracle::Quad> out;
  for (std::size_t k = 0; k < 3; ++k) out.corner[k] = oracle::convert<oracle::Quad>(triangle.corner[k]);
  return out;
}

// The triangles of a leaf next to those of another: true ones, and in double about a point near both, with bounds.
struct NearSurface {
  struct Quick {
    Triangle<double> at;
    double lo[3], hi[3];
    oracle::Vec3<double> normal;  // over the square of the longest edge
  };
  std::vector<Triangle<Real>> exact;
  std::vector<Quick> quick;
  double reach = 0;  // no coordinate of `quick` is larger

  NearSurface(const Surface& surface, const Point& shift, const Point& origin) : exact(surface.at) {
    for (Triangle<Real>& triangle : exact) {
      Quick one;
      for (std::size_t k = 0; k < 3; ++k) {
        triangle.corner[k] = triangle.corner[k] + shift;
        one.at.corner[k] = oracle::convert<double>(triangle.corner[k] - origin);
        reach = std::max(reach, norm_max(one.at.corner[k]));
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const double x = one.at.corner[0][c], y = one.at.corner[1][c], z = one.at.corner[2][c];
        one.lo[c] = std::min({x, y, z});
        one.hi[c] = std::max({x, y, z});
      }
      const auto& c = one.at.corner;
      const oracle::Vec3<double> edge[3] = {c[1] - c[0], c[2] - c[1], c[0] - c[2]};
      const double longest_sq = std::max({dot(edge[0], edge[0]), dot(edge[1], edge[1]), dot(edge[2], edge[2])});
      one.normal = (longest_sq > 0 ? 1 / longest_sq : 0.0) * cross(edge[0], edge[1]);
      quick.push_back(one);
    }
  }
};

// Whether bounds overlap, or come within a margin.
bool bounds_overlap(const NearSurface::Quick& a, const NearSurface::Quick& b, double margin) {
  bool out = true;
  for (std::size_t c = 0; c < 3; ++c) out = out & (a.lo[c] <= b.hi[c] + margin) & (b.lo[c] <= a.hi[c] + margin);
  return out;
}

// Whether long double is sure where two triangles pass through each other. With u = 2^-64 a normal is off by u over its
// length here, and the line in which two planes meet by u over the angle between them: 1e-13 of the triangles' size.
bool is_clear(const NearSurface::Quick& a, const NearSurface::Quick& b) {
  constexpr double kThin = 1e-6;
  const double length_a = norm(a.normal), length_b = norm(b.normal);
  return length_a > kThin && length_b > kThin && norm(cross(a.normal, b.normal)) > kThin * (length_a * length_b);
}

// Judges the answers for the triangles of two leaves.
class Judge {
 public:
  Judge(Task& task, const Case& made, const Posed& posed)
      : task_(task),
        made_(made),
        tally_(task.tallies[made.method]),
        rig_(posed.rig()),
        surface_a_(posed.surface(made.instance[0], made.leaf[0])),
        surface_b_(posed.surface(made.instance[1], made.leaf[1])),
        shift_(posed.origin(made.instance[1]) - posed.origin(made.instance[0])),
        a_(surface_a_, {}, surface_a_.middle()),
        b_(surface_b_, shift_, surface_a_.middle()) {}

  // is_found: of each triangle of a with each of b.
  void judge(const std::vector<std::uint8_t>& is_found) {
    const bool is_one = made_.instance[0] == made_.instance[1];
    for (std::size_t x = 0, at = 0; x < a_.quick.size(); ++x)
      for (std::size_t y = 0; y < b_.quick.size(); ++y, ++at) {
        const bool overlap = bounds_overlap(a_.quick[x], b_.quick[y], double{made_.margin}), found = is_found[at] != 0;
        if (!overlap && !found) continue;
        if (is_one && share_a_vertex(x, y)) {
          if (found) report("triangles that share a vertex are reported", x, y);
          continue;
        }
        tally_.judged += overlap;
        judge_pair(x, y, found);
      }
  }

 private:
  bool share_a_vertex(std::size_t x, std::size_t y) const {
    const std::uint32_t* const a = rig_.triangles[made_.leaf[0]].data() + 3 * x;
    const std::uint32_t* const b = rig_.triangles[made_.leaf[1]].data() + 3 * y;
    return std::find_first_of(a, a + 3, b, b + 3) != a + 3;
  }

  // What may touch must be found: by docs/proof.md, step 21.3, not even what is `unclear` apart can be called apart.
  void judge_pair(std::size_t x, std::size_t y, bool found) {
    const Real margin = made_.margin,
               numbers = (surface_a_.numbers[x] + surface_b_.numbers[y]) + (norm_1(shift_) + margin),
               unclear = kUnclear * numbers;
    const bool apart = oracle::certainly_apart(a_.quick[x].at, b_.quick[y].at, std::max(a_.reach, b_.reach),
                                               static_cast<double>(margin + unclear));
    if (apart && !found) return;
    const Real gap = apart || !meets(x, y, found) ? oracle::distance_apart(a_.exact[x], b_.exact[y]) - margin : -margin;
    if (gap < -unclear || (gap <= 0 && margin == 0)) {
      ++tally_.touching;
    } else if (gap <= unclear) {
      ++tally_.unclear;
    } else if (found) {
      const auto wide = static_cast<double>(gap / (kWidestGap * numbers));
      ++tally_.false_positives;
      tally_.widest_gap = std::max(tally_.widest_gap, wide);
      if (wide > 1) report("triangles that are reported are " + shortest(wide) + " times 2^-40 apart", x, y);
    }
    if (found || gap > unclear) return;
    ++tally_.lost;
    report("triangles that touch are called apart", x, y);
  }

  // Whether two triangles have a point in common. Binary128 confirms it where that says that a pair is lost, and where
  // long double is not sure.
  bool meets(std::size_t x, std::size_t y, bool found) const {
    const Triangle<Real>&a = a_.exact[x], &b = b_.exact[y];
    return meet(a, b) && ((found && is_clear(a_.quick[x], b_.quick[y])) || meet(widened(a), widened(b)));
  }

  void report(const std::string& what, std::size_t x, std::size_t y) {
    task_.violation(made_.method, what + "; A:" + to_text(a_.exact[x]) + "; B:" + to_text(b_.exact[y]));
  }

  Task& task_;
  const Case& made_;
  Tally& tally_;
  const oracle::SkinRig& rig_;
  const Surface &surface_a_, &surface_b_;
  Point shift_;
  NearSurface a_, b_;
};

struct Answers {
  std::size_t row;
  std::vector<std::uint8_t> is_found;
};

void judge_case(Task& task, const Case& made, const Posed& posed, std::vector<Skinning>& skinnings) {
  const ExactLeaf a = posed.leaf(made.instance[0], made.leaf[0]), b = posed.leaf(made.instance[1], made.leaf[1]);
  compare(task, made, a, b, skinnings);
  Answers answers = {posed.surface(made.instance[1], made.leaf[1]).at.size(), {}};
  answers.is_found.resize(answers.row * posed.surface(made.instance[0], made.leaf[0]).at.size());
  Skinning& by = skinnings.front();
  task.subject->find_touching_triangles(frame_of(by.kernels), a, b, made.margin, by.cache, by.stats, &answers,
                                        [](void* taker, std::uint32_t x, std::uint32_t y) {
                                          Answers& of = *static_cast<Answers*>(taker);
                                          of.is_found[of.row * x + y] = 1;
                                          return true;
                                        });
  Judge(task, made, posed).judge(answers.is_found);
}

// --------------------------------------------------------------------------------------------------------------- cases

oracle::Vec3<double> any_in_cube(oracle::Random& random, double half) {
  return {{random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)}};
}

// A corner, a point of an edge or a point inside.
Point point_of(oracle::Random& random, const Triangle<Real>& triangle) {
  const double v = random.chance(0.3) ? 0 : random.uniform(0, 1), w = random.chance(0.3) ? 0 : random.uniform(0, 1 - v);
  const auto& c = triangle.corner;
  return c[0] + Real{v} * (c[1] - c[0]) + Real{w} * (c[2] - c[0]);
}

const Triangle<Real>& any_of(oracle::Random& random, const Surface& surface) {
  return surface.at[random.index(static_cast<unsigned>(surface.at.size()))];
}

// By how much to shift the second leaf.
oracle::Vec3<double> shift_for(oracle::Random& random, std::size_t method, const Surface& a, const Surface& b) {
  const double extent = std::min(a.extent(), b.extent());
  const auto corner_to_point = [&] {
    const Point way = point_of(random, any_of(random, a)) - any_of(random, b).corner[random.index(3)];
    return oracle::convert<double>(
        way + oracle::convert<Real>(any_in_cube(random, random.log_uniform(1e-17, 1e-2) * extent)));
  };
  const auto middle_to_middle = [&] {
    return oracle::convert<double>(a.middle() - b.middle()) + any_in_cube(random, random.log_uniform(1e-2, 1) * extent);
  };
  switch (method) {
    case kNear: return middle_to_middle();
    case kCorner: return corner_to_point();
    case kAlong: {
      const auto& c = any_of(random, a).corner;
      const double v = random.uniform(-1, 1), w = random.chance(0.3) ? 0 : random.uniform(-1, 1);
      return oracle::convert<double>(Real{v} * (c[1] - c[0]) + Real{w} * (c[2] - c[0]));
    }
    case kMargin:
    case kFar: return random.chance(0.5) ? middle_to_middle() : corner_to_point();
    default: return {};
  }
}

// Draws two leaves and puts them together. Returns false if there are none, as with one leaf in one instance.
bool draw(oracle::Random& random, std::size_t method, Posed& posed, Case& out) {
  const auto leaves = static_cast<unsigned>(posed.rig().leaves.size());
  out = {method, {0, 1}, {random.index(leaves), random.index(leaves)}, 0};
  if (method == kSame || method == kAlong) {
    out.instance[1] = 2;
    if (random.chance(0.8)) out.leaf[1] = out.leaf[0];
  }
  oracle::Vec3<double> origin{};
  if (random.chance(0.3)) origin = any_in_cube(random, random.log_uniform(1, 1e5) * posed.rig().size);
  posed.put(0, origin);
  if (method == kWithin) {
    out.instance[0] = out.instance[1] = random.index(2);
    posed.put(out.instance[0], origin);
    if (leaves == 1) return false;
    if (out.leaf[0] == out.leaf[1]) out.leaf[1] = (out.leaf[0] + 1) % leaves;
    return true;
  }
  const Surface &a = posed.surface(0, out.leaf[0]), &b = posed.surface(out.instance[1], out.leaf[1]);
  oracle::Vec3<double> shift = shift_for(random, method, a, b);
  if (method == kMargin) {
    out.margin = static_cast<float>(random.log_uniform(1e-4, 0.3) * std::min(a.extent(), b.extent()));
    shift = shift + double{out.margin} * random.unit_vector();
  }
  posed.put(out.instance[1], origin + shift);
  return true;
}

void judge_skin(Task& task, const oracle::SkinRig& rig, const Articulation& articulation,
                std::vector<Skinning>& skinnings) {
  constexpr PoseFormat kFormats[] = {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                     PoseFormat::kMatrix4x4Columns};
  oracle::Random& random = task.random;
  for (std::uint32_t i = 0; i <= kPoses; ++i) {
    const bool is_far = i == kPoses;
    const double away = is_far ? random.log_uniform(1, 1e7) : 0.5 * random.index(2);
    Posed posed(rig, articulation, random_surface_poses(random, rig, kFormats[random.index(3)], away));
    for (Skinning& each : skinnings) forget_skinned(each.cache);
    Case made;
    if (is_far) {
      if (draw(random, kFar, posed, made)) judge_case(task, made, posed, skinnings);
      continue;
    }
    for (std::size_t method = 0; method < kFar; ++method)
      for (std::uint32_t k = 0; k < kCases; ++k)
        if (draw(random, method, posed, made)) judge_case(task, made, posed, skinnings);
  }
}

void run(Task& task) {
  for (std::uint32_t i = 0; i < kSkins; ++i) {
    const unsigned most = task.random.index(kLarge) == 0 ? kMostOfLarge : kMostTriangles;
    const oracle::SkinRig rig = oracle::random_surface(task.random, static_cast<oracle::SkinRegime>(task.regime), most);
    Arena arena(default_allocator());
    Articulation articulation;
    oracle::require(build_articulation(rig.desc(), arena, &articulation, nullptr));
    const SurfaceLeaves& surface = articulation.surface;
    std::vector<Skinning> skinnings = {{*task.subject->kernels}};
    for (const kernel::KernelTable* kernels : all_kernels())
      if (kernels != task.subject->kernels) skinnings.push_back({*kernels});
    for (Skinning& each : skinnings)
      size_skin_cache({surface.most_blocks, surface.most_patches, surface.most_bones}, arena, each.cache);
    judge_skin(task, rig, articulation, skinnings);
  }
}

}  // namespace

// The regimes are those of oracle::SkinRegime, in its order.
VerifyPart triangles_part() {
  return {"triangles",
          "pairs",
          Columns::kTriangles,
          {"smooth", "many links", "tiny weights", "one link", "flat"},
          {std::begin(kMethods), std::end(kMethods)},
          run};
}

}  // namespace cab::perf
