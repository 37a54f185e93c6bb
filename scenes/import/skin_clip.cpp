// A character of bodies that are made of a file's meshes.
#include "scenes/import/skin_clip.h"

#include <algorithm>
#include <cstdio>

#include "scenes/import/printable.h"
#include "scenes/import/surface_words.h"
#include "scenes/vec3d.h"

namespace cab::scenes {
namespace {

void check(rig::SkinStatus status, const std::string& name) {
  if (status != rig::SkinStatus::kOk) throw ImportError(name + ": bodies of its meshes: " + rig::to_string(status));
}

std::vector<std::uint32_t> joints_by_name(const Skeleton& skeleton, const std::vector<std::string>& names,
                                          const std::string& file) {
  std::vector<std::uint32_t> joints;
  for (const std::string& name : names) {
    const auto found = std::find(skeleton.joint_names.begin(), skeleton.joint_names.end(), name);
    if (found == skeleton.joint_names.end()) throw ImportError(file + ": no joint is named " + printable(name));
    joints.push_back(static_cast<std::uint32_t>(found - skeleton.joint_names.begin()));
  }
  return joints;
}

std::string coverage_note(const rig::Coverage& coverage, const Skeleton& skeleton) {
  char text[256];
  std::snprintf(text, sizeof text, "%.2f %% of the surface inside the bodies, worst protrusion %.2f cm",
                100 * coverage.share_inside, 100 * coverage.worst_protrusion);
  std::string note = text;
  if (coverage.worst_protrusion > 0)
    note += " (" + skeleton.joint_names[coverage.worst_joint] + ", frame " + std::to_string(coverage.worst_pose) + ")";
  if (coverage.mesh_volume > 0) {
    std::snprintf(text, sizeof text, ", bodies' volume %.2f of the mesh's",
                  coverage.bodies_volume / coverage.mesh_volume);
    note += text;
  }
  if (coverage.median_box_ratio > 0) {
    std::snprintf(text, sizeof text, ", boxes %.2f times their bodies (median)", coverage.median_box_ratio);
    note += text;
  }
  return note;
}

void add_left_out(std::uint32_t count, const char* why, const char* what, Clip& clip) {
  if (count == 0) return;
  clip.notes.push_back(counted(count, "triangle", "triangles") + " left out (" + why + ")");
  clip.alterations.push_back({AlterationKind::kDropped, what, count, clip.notes.back()});
}

// How many triangles have a vertex that no bone moves.
std::uint32_t count_without_weight(const rig::Skin& skin) {
  const auto has_weight = [&skin](std::uint32_t vertex) {
    const float* const weights = skin.influence_weights.data + std::size_t{vertex} * skin.influence_count;
    return std::any_of(weights, weights + skin.influence_count, [](float weight) { return weight > 0; });
  };
  std::uint32_t count = 0;
  for (std::size_t t = 0; t < skin.triangles.size; t += 3)
    count += std::all_of(skin.triangles.data + t, skin.triangles.data + t + 3, has_weight) ? 0 : 1;
  return count;
}

rig::SkinBodies make_solids(const rig::Skin& skin, const Skeleton& skeleton, const SkinOptions& options,
                            const std::string& name, Clip& clip) {
  const std::vector<std::uint32_t> kept = joints_by_name(skeleton, options.kept_joints, name);
  rig::BodyRules rules;
  rules.kinds = options.kinds;
  rules.leaves_per_link = options.leaves_per_link;
  rules.inflate = options.inflate;
  rules.kept_joints = kept;
  rules.least_reach = static_cast<float>(options.least_reach);
  rig::SkinBodies bodies;
  check(rig::bodies_from_skin(skin, rules, &bodies), name);
  rig::Coverage coverage;
  check(rig::measure_coverage(skin, bodies, &coverage), name);
  clip.coverage = coverage;
  clip.notes.push_back(coverage_note(coverage, skeleton));
  add_left_out(count_without_weight(skin), "a corner without weight", "triangles without weight", clip);
  return bodies;
}

// Distances from the file's surface below this are rounding. Metres.
constexpr double kShownDistance = 5e-5;

std::string surface_note(const rig::SurfaceInfo& info, std::size_t leaf_count) {
  char text[256];
  std::snprintf(text, sizeof text, "surface of boxes %.2f times that about their vertices", info.growth);
  const std::string note = triangle_words(info, leaf_count) + ", " + text + ", " + part_words(info);
  if (info.worst_distance < kShownDistance) return note;
  std::snprintf(text, sizeof text, ", up to %.2f cm from the file's surface (frame %u)", 100 * info.worst_distance,
                static_cast<unsigned>(info.worst_pose));
  return note + text;
}

rig::SkinBodies make_surface(const rig::Skin& skin, const Skeleton& skeleton, const std::string& name, Clip& clip) {
  rig::SkinBodies bodies;
  rig::SurfaceInfo info;
  std::uint32_t bone = 0;
  const rig::SkinStatus status = rig::surface_from_skin(skin, {}, &bodies, &info, &bone);
  if (status == rig::SkinStatus::kNoInverse || status == rig::SkinStatus::kBindsDiffer)
    throw ImportError(name + ": surface of its meshes: mesh " +
                      skeleton.skin.mesh_names[skeleton.skin.bone_meshes[bone]] + ", joint " +
                      skeleton.joint_names[skeleton.skin.bone_joints[bone]] + ": " + rig::to_string(status));
  check(status, name);
  clip.surface = info;
  clip.notes.push_back(surface_note(info, bodies.desc().leaves.size));
  add_left_out(info.left_out_count, "two corners at one place, or a corner without weight",
               "triangles with corners at one place or without weight", clip);
  return bodies;
}

}  // namespace

rig::Skin skin_of(const Skeleton& skeleton, std::vector<float>& poses) {
  const std::size_t joints = skeleton.joint_names.size();
  poses.clear();
  poses.reserve(16 * joints * skeleton.frame_count);
  for (std::size_t f = 0; f < skeleton.frame_count; ++f) {
    const double* const root = skeleton.positions.data() + 3 * f * joints;
    for (std::size_t j = f * joints; j < (f + 1) * joints; ++j) {
      const double* const q = skeleton.rotations.data() + 4 * j;
      const float* const stretch = skeleton.skin.stretches.data() + 6 * j;
      const Vec3 columns[3] = {{stretch[0], 0, 0}, {stretch[1], stretch[2], 0}, {stretch[3], stretch[4], stretch[5]}};
      for (const Vec3& column : columns) {
        for (const double component : rotate({q[0], q[1], q[2], q[3]}, column))
          poses.push_back(static_cast<float>(component));
        poses.push_back(0);
      }
      for (std::size_t k = 0; k < 3; ++k) poses.push_back(static_cast<float>(skeleton.positions[3 * j + k] - root[k]));
      poses.push_back(1);
    }
  }
  const FileSkin& file = skeleton.skin;
  rig::Skin skin;
  skin.joint_parents = {skeleton.joint_parents.data(), joints};
  skin.poses = poses;
  skin.vertices = file.vertices;
  skin.triangles = file.triangles;
  skin.influence_count = file.influence_count;
  skin.influence_bones = file.influence_bones;
  skin.influence_weights = file.influence_weights;
  skin.inverse_bind = file.inverse_bind;
  skin.bone_joints = file.bone_joints;
  return skin;
}

void add_skin_bodies(const Skeleton& skeleton, const std::string& name, const ImportOptions& options, Clip& clip) {
  if (skeleton.skin.triangles.empty()) throw ImportError(name + ": no mesh that joints move: it has no skin");
  std::vector<float> matrices;
  const rig::Skin skin = skin_of(skeleton, matrices);
  const rig::SkinBodies bodies = options.skin->surface ? make_surface(skin, skeleton, name, clip)
                                                       : make_solids(skin, skeleton, *options.skin, name, clip);

  Character& character = clip.character;
  character.name = name;
  character.is_static = skeleton.is_static;
  for (const std::uint32_t joint : bodies.joints()) character.link_names.push_back(skeleton.joint_names[joint]);
  const ArticulationDesc desc = bodies.desc();
  character.link_parents.assign(desc.link_parents.begin(), desc.link_parents.end());
  character.leaves = copied(desc.leaves);
  character.skin = copied(desc.skin);
  character.ignored_pairs.assign(desc.ignored_pairs.begin(), desc.ignored_pairs.end());
  const std::size_t joints = skeleton.joint_names.size(), links = character.link_parents.size();
  character.poses.resize(7 * links * skeleton.frame_count);
  for (std::size_t f = 0; f < skeleton.frame_count; ++f) {
    check(rig::link_poses(bodies, {matrices.data() + 16 * joints * f, 16 * joints},
                          {character.poses.data() + 7 * links * f, 7 * links}),
          name);
    for (std::size_t k = 0; k < 3; ++k)
      character.origins.push_back(skeleton.positions[3 * joints * f + k] + options.offset[k]);
  }
}

}  // namespace cab::scenes
