#include "perf/measure/peers/surface_world.h"

#include <cab/skin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <utility>

#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

using oracle::Vec3;

// How many frames ahead the next of several like characters is.
constexpr std::uint32_t kPhase = 11;

// docs/exact.md: what is reported is at most so far apart, in parts of the numbers that place it.
constexpr double kWidestGap = 0x1p-40;

// The most numbers of each kind in a file of arrays, so that a damaged one is not taken for a large one.
constexpr std::int32_t kMostInSkinFile = 1 << 24;

// The bytes of a file of arrays.
class SkinFile {
 public:
  explicit SkinFile(const std::string& path) : path_(path), file_(path, std::ios::binary) {}

  template <class T>
  std::vector<T> read(std::size_t count) {
    std::vector<T> values;
    // Not more memory at a time than the file has.
    for (std::size_t done = 0; done < count;) {
      const std::size_t step = std::min<std::size_t>(count - done, 1 << 20);
      values.resize(done + step);
      file_.read(reinterpret_cast<char*>(values.data() + done), static_cast<std::streamsize>(step * sizeof(T)));
      if (!file_) throw scenes::ImportError(scenes::printable(path_) + ": no file of a skin's arrays, or cut short");
      done += step;
    }
    return values;
  }

 private:
  const std::string& path_;
  std::ifstream file_;
};

void require(rig::SkinStatus status, const std::string& path) {
  if (status != rig::SkinStatus::kOk)
    throw scenes::ImportError(scenes::printable(path) + ": " + rig::to_string(status));
}

scenes::Character character_of(const rig::SkinBodies& bodies, const std::string& path) {
  const ArticulationDesc desc = bodies.desc();
  scenes::Character out;
  out.name = path;
  out.link_parents.assign(desc.link_parents.begin(), desc.link_parents.end());
  out.leaves = scenes::copied(desc.leaves);
  out.skin = scenes::copied(desc.skin);
  out.ignored_pairs.assign(desc.ignored_pairs.begin(), desc.ignored_pairs.end());
  return out;
}

// Where each bone comes if parents come first. Throws ImportError for parents that are none.
std::vector<std::uint32_t> parents_first(const std::vector<std::int32_t>& parents, const std::string& path) {
  std::vector<std::size_t> depth(parents.size());
  for (std::size_t b = 0; b < parents.size(); ++b)
    for (std::int64_t at = parents[b]; at >= 0; at = parents[static_cast<std::size_t>(at)])
      if (at >= static_cast<std::int64_t>(parents.size()) || ++depth[b] > parents.size())
        throw scenes::ImportError(scenes::printable(path) + ": a bone has no such parent, or is above itself");
  std::vector<std::uint32_t> order(parents.size()), place(parents.size());
  for (std::uint32_t b = 0; b < order.size(); ++b) order[b] = b;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return depth[a] < depth[b]; });
  for (std::uint32_t b = 0; b < order.size(); ++b) place[order[b]] = b;
  return place;
}

SurfaceActor load_arrays(const std::string& path) {
  SkinFile file(path);
  const std::vector<std::int32_t> counts = file.read<std::int32_t>(5);
  for (const std::int32_t count : counts)
    if (count < 1 || count > kMostInSkinFile)
      throw scenes::ImportError(scenes::printable(path) + ": no file of a skin's arrays");
  const auto vertices = static_cast<std::size_t>(counts[0]), bones = static_cast<std::size_t>(counts[2]),
             frames = static_cast<std::size_t>(counts[3]), width = static_cast<std::size_t>(counts[4]);
  const auto places = file.read<double>(3 * vertices);
  auto influence_bones = file.read<std::uint32_t>(width * vertices);
  const auto weights = file.read<double>(width * vertices);
  const auto triangles = file.read<std::uint32_t>(3 * static_cast<std::size_t>(counts[1]));
  const auto given_parents = file.read<std::int32_t>(bones);
  const auto rows = file.read<double>(12 * bones * frames);
  const std::vector<std::uint32_t> place = parents_first(given_parents, path);
  std::vector<std::int32_t> parents(bones);
  for (std::size_t b = 0; b < bones; ++b)
    parents[place[b]] =
        given_parents[b] < 0 ? -1 : static_cast<std::int32_t>(place[static_cast<std::size_t>(given_parents[b])]);
  for (std::uint32_t& bone : influence_bones)
    if (bone < bones) bone = place[bone];  // others are refused with the skin
  const std::vector<float> place_floats(places.begin(), places.end()), weight_floats(weights.begin(), weights.end());
  std::vector<float> poses(16 * bones * frames), binds;
  for (std::size_t p = 0; p < frames * bones; ++p) {
    float* const to = poses.data() + 16 * (p / bones * bones + place[p % bones]);
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t c = 0; c < 3; ++c) to[4 * k + c] = static_cast<float>(rows[12 * p + 4 * c + k]);
    to[15] = 1;
  }
  for (std::size_t i = 0; i < 16 * bones; ++i) binds.push_back(i % 16 % 5 == 0 ? 1.0f : 0.0f);
  rig::Skin skin;
  skin.joint_parents = parents;
  skin.poses = poses;
  skin.vertices = place_floats;
  skin.triangles = triangles;
  skin.influence_count = static_cast<std::uint32_t>(width);
  skin.influence_bones = influence_bones;
  skin.influence_weights = weight_floats;
  skin.inverse_bind = binds;
  rig::SkinBodies surface, hulls;
  require(surface_from_skin(skin, {}, &surface), path);
  require(bodies_from_skin(skin, {}, &hulls), path);
  SurfaceActor out = {character_of(surface, path), character_of(hulls, path), static_cast<std::uint32_t>(frames)};
  const std::size_t floats = 7 * out.surface.link_parents.size();
  out.surface.poses.resize(floats * frames);
  out.surface.origins.resize(3 * frames);
  for (std::size_t f = 0; f < frames; ++f)
    require(rig::link_poses(surface, {poses.data() + 16 * bones * f, 16 * bones},
                            {out.surface.poses.data() + floats * f, floats}),
            path);
  return out;
}

bool is_arrays(const std::string& path) {
  constexpr const char* kEnd = ".skin";
  return path.size() > 5 && path.compare(path.size() - 5, 5, kEnd) == 0;
}

}  // namespace

SurfaceActor load_surface_actor(const std::string& path, const std::optional<scenes::SandboxLimits>& sandbox) {
  SurfaceActor out;
  if (is_arrays(path)) {
    out = load_arrays(path);
  } else {
    scenes::ImportOptions options;
    options.sandbox = sandbox;
    options.skin.emplace().surface = true;
    scenes::Clip clip = scenes::import_clip(path, options);
    options.skin->surface = false;
    out = {std::move(clip.character), scenes::import_clip(path, options).character, clip.frame_count};
    out.hulls.poses.clear();
  }
  if (out.surface.link_parents != out.hulls.link_parents)
    throw scenes::ImportError(scenes::printable(path) + ": its surface has other links than its hulls");
  return out;
}

const float* SurfaceWorld::poses(std::size_t instance, std::uint32_t frame) const {
  const SurfaceInstance& of = instances[instance];
  const SurfaceActor& actor = actors[of.actor];
  return actor.surface.poses.data() + 7 * actor.surface.link_parents.size() * ((frame + of.phase) % actor.frame_count);
}

Vec3<double> SurfaceWorld::origin(std::size_t instance, std::uint32_t frame) const {
  const SurfaceInstance& of = instances[instance];
  const SurfaceActor& actor = actors[of.actor];
  const double* const at = actor.surface.origins.data() + 3 * std::size_t{(frame + of.phase) % actor.frame_count};
  return {{at[0] + of.offset[0], at[1] + of.offset[1], at[2] + of.offset[2]}};
}

std::vector<Vec3<double>> SurfaceWorld::vertices(std::size_t instance, std::uint32_t frame) const {
  const scenes::BodySkin& skin = surface(instance).skin;
  const float* const pose = poses(instance, frame);
  struct Bone {
    Vec3<double> column[3], at;
  };
  std::vector<Bone> bones(surface(instance).link_parents.size());
  for (std::size_t l = 0; l < bones.size(); ++l) {
    const float *const p = pose + 7 * l, *const m = skin.inverse_bind.data() + 16 * l;
    const double q[4] = {p[0], p[1], p[2], p[3]};
    double turn[3][3];
    oracle::quaternion_matrix(q, turn);
    const auto turned = [&](const float* v) {
      return double{v[0]} * oracle::to_vec3(turn[0]) + double{v[1]} * oracle::to_vec3(turn[1]) +
             double{v[2]} * oracle::to_vec3(turn[2]);
    };
    for (std::size_t k = 0; k < 3; ++k) bones[l].column[k] = turned(m + 4 * k);
    bones[l].at = turned(m + 12) + Vec3<double>{{p[4], p[5], p[6]}};
  }
  std::vector<Vec3<double>> out(skin.vertices.size() / 3);
  for (std::size_t v = 0; v < out.size(); ++v) {
    double weights = 0;
    Vec3<double> sum{};
    for (std::size_t i = v * skin.influence_count; i < (v + 1) * skin.influence_count; ++i) {
      const double weight = skin.influence_weights[i];
      if (!(weight > 0)) continue;
      const Bone& bone = bones[skin.influence_links[i]];
      Vec3<double> at = bone.at;
      for (std::size_t k = 0; k < 3; ++k) at = at + double{skin.vertices[3 * v + k]} * bone.column[k];
      sum = sum + weight * at;
      weights += weight;
    }
    out[v] = (1 / weights) * sum + origin(instance, frame);
  }
  return out;
}

SurfaceWorld make_surface_grid(SurfaceActor actor, std::uint32_t count, double apart) {
  SurfaceWorld world;
  world.actors.push_back(std::move(actor));
  world.instances.resize(1);
  Vec3<double> lo = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}}, hi = -1.0 * lo;
  for (const Vec3<double>& at : world.vertices(0, 0))
    for (std::size_t c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], at[c]);
      hi[c] = std::max(hi[c], at[c]);
    }
  std::array<std::size_t, 3> axis = {0, 1, 2};  // by extent, the least first
  std::sort(axis.begin(), axis.end(), [&](std::size_t a, std::size_t b) { return hi[a] - lo[a] < hi[b] - lo[b]; });
  const double step = apart * (hi[axis[1]] - lo[axis[1]]);
  const auto row = static_cast<std::uint32_t>(std::ceil(std::sqrt(count)));
  world.instances.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    SurfaceInstance instance;
    instance.phase = kPhase * i;
    instance.offset[axis[1]] = step * (i % row);
    instance.offset[axis[0]] = step * (i / row);
    world.instances.push_back(instance);
  }
  return world;
}

std::vector<std::uint32_t> links_of_triangles(const scenes::Character& surface) {
  std::vector<std::uint32_t> links;
  for (const scenes::BodyLeaf& leaf : surface.leaves) links.insert(links.end(), leaf.triangles.size() / 3, leaf.link);
  return links;
}

JudgedSurfaces judge_surfaces(const SurfaceWorld& world, std::uint32_t frame) {
  std::vector<oracle::TriangleSet> sets;
  double size = 0;  // no coordinate is larger
  for (std::size_t i = 0; i < world.instances.size(); ++i) {
    const std::vector<Vec3<double>> at = world.vertices(i, frame);
    for (const Vec3<double>& place : at) size = std::max(size, norm_max(place));
    std::vector<oracle::Triangle<double>> triangles;
    for (const scenes::BodyLeaf& leaf : world.surface(i).leaves)
      for (std::size_t t = 0; t < leaf.triangles.size(); t += 3)
        triangles.push_back({{at[leaf.triangles[t]], at[leaf.triangles[t + 1]], at[leaf.triangles[t + 2]]}});
    sets.emplace_back(std::move(triangles));
  }
  JudgedSurfaces out;
  for (std::uint32_t a = 0; a < sets.size(); ++a)
    for (std::uint32_t b = a + 1; b < sets.size(); ++b)
      for_near(sets[a], sets[b], kWidestGap * size, [&](std::size_t x, std::size_t y, bool touches) {
        out.near.push_back({a, static_cast<std::uint32_t>(x), b, static_cast<std::uint32_t>(y)});
        if (touches) out.touching.push_back(out.near.back());
        return true;
      });
  std::sort(out.touching.begin(), out.touching.end());
  std::sort(out.near.begin(), out.near.end());
  return out;
}

}  // namespace cab::perf
