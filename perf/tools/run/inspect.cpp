// `cab inspect`: says what cab makes of one file, and writes one frame of it with everything that a person needs to
// check the engine by hand.
#include <cab/cab.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/run/bodies_file.h"
#include "perf/tools/run/import_summary.h"
#include "perf/tools/run/options.h"
#include "scenes/import/companions.h"
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "scenes/import/unit.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;
using Vec3 = std::array<double, 3>;

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

Vec3 widen(const float* v) { return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])}; }

Json box_json(const Box& box) {
  return {{"center_metres", widen(box.center)},
          {"axes", {widen(box.axis[0]), widen(box.axis[1]), widen(box.axis[2])}},
          {"half_metres", widen(box.half)}};
}

const char* shape_name(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kBox: return "box";
    case ShapeKind::kEllipsoid: return "ellipsoid";
    case ShapeKind::kCapsule: return "capsule";
    case ShapeKind::kConvexHull: return "convex_hull";
    case ShapeKind::kSphere: return "sphere";
    case ShapeKind::kCylinder: return "cylinder";
    case ShapeKind::kHalfSpace: return "half_space";
  }
  return "unknown";
}

Json joints_json(const scenes::Skeleton& skeleton, std::uint32_t frame, const Vec3& offset) {
  Json joints = Json::array();
  const std::size_t count = skeleton.joint_names.size();
  for (std::size_t j = 0; j < count; ++j) {
    const double* position = skeleton.positions.data() + (frame * count + j) * 3;
    joints.push_back({{"name", skeleton.joint_names[j]},
                      {"parent", skeleton.joint_parents[j]},
                      {"end_site", static_cast<bool>(skeleton.is_end_site[j])},
                      {"world_metres", Vec3{position[0], position[1], position[2]} + offset}});
  }
  return joints;
}

// The links with their joints in the world. The frame of an imported link has its origin at the joint, so the
// translation of a pose is the place of the joint.
Json links_json(const scenes::Character& character, std::uint32_t frame, const Vec3& origin) {
  if (character.pose_format != PoseFormat::kQuaternionTranslation || !character.link_joints.empty())
    throw std::logic_error(character.name + ": an imported character has quaternions and joints at the links' frames");
  Json links = Json::array();
  const std::size_t count = character.link_parents.size();
  for (std::size_t l = 0; l < count; ++l) {
    const float* pose = character.poses.data() + (frame * count + l) * pose_floats(character.pose_format);
    links.push_back({{"name", character.link_names[l]},
                     {"parent", character.link_parents[l]},
                     {"joint_world_metres", widen(pose + 4) + origin}});
  }
  return links;
}

// A leaf's box and exact shape in its link's frame, how many triangles it has, and the box as posed.
Json leaves_json(const scenes::Character& character, const CharacterBoxes& boxes) {
  Json leaves = Json::array();
  for (std::size_t n = 0; n < character.leaves.size(); ++n) {
    const scenes::BodyLeaf& leaf = character.leaves[n];
    Json parts = Json::array();
    for (const scenes::ShapePart& part : leaf.parts)
      parts.push_back({{"shape", shape_name(part.shape.kind)},
                       {"position_metres", widen(part.shape.position)},
                       {"rotation_xyzw", part.shape.rotation},
                       {"size_metres", widen(part.shape.size)},
                       {"vertices_metres", part.vertices}});
    leaves.push_back({{"node", n},
                      {"link", leaf.link},
                      {"link_name", character.link_names[leaf.link]},
                      {"box_in_link", box_json(leaf.box)},
                      {"parts_in_link", parts},
                      {"box", box_json(boxes.boxes[n])}});
    if (!leaf.triangles.empty()) leaves.back()["triangle_count"] = leaf.triangles.size() / 3;
  }
  return leaves;
}

// One entry per merge: the node that the merge makes, its two children, the joint, and the box.
Json merges_json(const scenes::Character& character, const CharacterBoxes& boxes) {
  Json merges = Json::array();
  for (std::size_t s = 0; s < boxes.steps.size(); ++s) {
    const MergeStep& step = boxes.steps[s];
    const std::size_t node = boxes.info.leaf_count + s;
    const bool has_joint = step.joint_link != kNoJoint;
    merges.push_back({{"node", node},
                      {"left", step.left},
                      {"right", step.right},
                      {"joint_link", has_joint ? Json(step.joint_link) : Json()},
                      {"joint_link_name", has_joint ? Json(character.link_names[step.joint_link]) : Json()},
                      {"box", box_json(boxes.boxes[node])}});
  }
  return merges;
}

Json masked_json(std::uint8_t flags) {
  Json reasons = Json::array();
  if ((flags & kInstanceNotFinite) != 0) reasons.push_back("not finite or too large");
  if ((flags & kInstanceNotRigid) != 0) reasons.push_back("not a rigid motion");
  return reasons;
}

Json coverage_json(const rig::Coverage& coverage, const scenes::Skeleton& skeleton) {
  return {{"share_inside", coverage.share_inside},
          {"worst_protrusion_metres", coverage.worst_protrusion},
          {"worst_frame", coverage.worst_pose},
          {"worst_joint", skeleton.joint_names[coverage.worst_joint]},
          {"mesh_cubic_metres", coverage.mesh_volume},
          {"bodies_cubic_metres", coverage.bodies_volume},
          {"median_box_over_body", coverage.median_box_ratio},
          {"flat_leaves", coverage.flat_count}};
}

Json surface_json(const rig::SurfaceInfo& info) {
  return {{"triangles", info.triangle_count},
          {"triangles_left_out", info.left_out_count},
          {"vertices", info.vertex_count},
          {"vertices_welded", info.welded_count},
          {"links_with_leaves", info.link_count},
          {"most_triangles_of_a_leaf", info.most_triangles},
          {"most_influences_of_a_leaf", info.most_influences},
          {"parts", info.part_count},
          {"open_parts", info.open_part_count},
          {"open_edges", info.open_edge_count},
          {"growth", info.growth},
          {"worst_distance_metres", info.worst_distance},
          {"worst_frame", info.worst_pose}};
}

// The pairs that share a joint.
MaskedPairs masked_pairs(const scenes::Character& character) {
  const std::size_t links = character.link_parents.size();
  return {character.ignored_pairs.size(), links * (links - 1) / 2};
}

// How tall a figure is, in words; empty if it has no bones. Bodies of a mesh say nothing of it.
std::string height_words(const scenes::SkeletonBodies& bodies, char up) {
  const double height = bodies.bodies.empty() ? 0 : scenes::height_of(bodies, up);
  return height > 0 ? ", " + fixed(height, 2) + " m tall" : std::string();
}

// What a person wants to know of a file, a line for each, without its bodies.
void print_summary(const InspectOptions& options, const scenes::Skeleton& skeleton, const scenes::Scene& scene,
                   const scenes::ImportReport& report, const scenes::SkeletonBodies& bodies, const MaskedPairs& pairs) {
  const scenes::Character& character = scene.characters.front();
  const auto ends = std::count(skeleton.is_end_site.begin(), skeleton.is_end_site.end(), true);
  std::cout << scenes::printable(character.name) << ": "
            << static_cast<std::ptrdiff_t>(skeleton.joint_names.size()) - ends << " joints, ";
  if (character.is_static)
    std::cout << "no motion";
  else
    std::cout << scene.frame_count << " frames, " << fixed(scene.frame_count * scene.frame_seconds, 1) << " s at "
              << scenes::digits(1 / scene.frame_seconds, 4) << " per second";
  std::cout << height_words(bodies, options.up) << '\n';
  const scenes::LengthUnit& unit = report.units.front();
  std::cout << "unit: " << scenes::digits(unit.metres, 4) << " m (" << to_string(unit.source) << ")\n";
  std::cout << "bodies: " << character.leaves.size() << " leaf boxes on " << character.link_parents.size()
            << " links\n";
  std::cout << "masked: " << pairs.masked << " of " << pairs.all << " pairs of links, which share a joint\n";
  for (const std::string& line : alteration_lines(report)) std::cout << scenes::printable(line) << '\n';
}

}  // namespace

int inspect_command(const InspectOptions& options) {
  if (options.skin && (!options.bodies_path.empty() || !options.write_bodies_path.empty()))
    throw UsageError("--bodies and --write-bodies are about bodies of the skeleton, not of --body skin or surface");
  if (options.motion_units > 0 && options.motion_path.empty()) throw UsageError(kUnitsNeedMotion);
  if (options.names_frame && !options.writes_json) throw UsageError("--frame: needs --json, which writes a frame");
  if (!options.writes_json && !options.box_options.empty())
    throw UsageError(options.box_options.front() + ": needs --json, which writes boxes of links");
  const std::vector<std::string> inputs = {options.file, options.motion_path, options.bodies_path};
  check_outputs({{"--json", options.json_path}, {"--write-bodies", options.write_bodies_path}}, inputs,
                [&options](const std::string& file) { return scenes::companion_files(file, options.sandbox); });
  OutputFile output(options.json_path), bodies_file(options.write_bodies_path);
  scenes::ImportOptions import;
  set_unit(options.metres_per_unit, import);
  import.offset = options.offset;
  import.up = options.up;
  import.sandbox = options.sandbox;
  if (!options.motion_path.empty()) import.motion = scenes::MotionFile{options.motion_path, options.motion_units};
  import.animation = options.animation;
  import.skin = options.skin;
  import.frames_per_second = options.frames_per_second;
  import.bodies = options.bodies;
  if (!options.bodies_path.empty()) import.body_changes = read_bodies(options.bodies_path, options.sandbox);
  const scenes::Skeleton skeleton = scenes::import_skeleton(options.file, import);
  std::vector<scenes::Clip> clips;
  clips.push_back(
      scenes::make_clip(skeleton, scenes::printable(std::filesystem::path(options.file).filename().string()), import));
  const std::optional<rig::Coverage> coverage = clips.front().coverage;
  const std::optional<rig::SurfaceInfo> surface = clips.front().surface;
  const scenes::SkeletonBodies bodies = clips.front().bodies;
  scenes::ImportReport report;
  const scenes::Scene scene = scenes::make_world(std::move(clips), &report);
  const MaskedPairs pairs = masked_pairs(scene.characters.front());
  const bool prints_summary = !options.writes_json || output;  // else the JSON is what is printed
  print_notes(scene, report, false, std::cerr);
  const std::uint32_t frame = options.frame.value_or(scene.frame_count - 1);
  if (frame >= scene.frame_count)
    throw UsageError("--frame: the file has frames 0 to " + std::to_string(scene.frame_count - 1) + ", not " +
                     std::to_string(frame));
  if (bodies_file) write_json(bodies_file, bodies_json(skeleton, bodies));
  if (prints_summary) {
    print_summary(options, skeleton, scene, report, bodies, pairs);
    if (!options.skin) print_bodies(skeleton, bodies, std::cout);
  }
  if (!options.writes_json) return 0;

  const scenes::Character& character = scene.characters.front();
  Vec3 origin = {};
  if (!character.origins.empty())
    for (std::size_t k = 0; k < 3; ++k) origin[k] = character.origins[std::size_t{frame} * 3 + k];

  EngineSession session(scene, {options.isa, 1, {frame, frame + 1}, false});
  const CharacterBoxes boxes = session.boxes(0, options.policies);
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["file"] = options.file;
  if (!options.motion_path.empty()) json["motion"] = options.motion_path;
  json["character"] = character.name;
  json["metres_per_unit"] = report.units.front().metres;
  json["unit_from"] = to_string(report.units.front().source);
  json["offset_metres"] = options.offset;
  json["frame"] = frame;
  json["frame_count"] = scene.frame_count;
  json["frame_seconds"] = scene.frame_seconds;
  const std::uint32_t refit = 0;  // the first row of policy_table()
  json[policy_table()[refit].name] = policy_value(options.policies, refit);
  json["isa"] = to_string(session.isa());
  json["pose_hash"] = hex(scenes::pose_hash(scene));
  json["frame_of_boxes"] = "boxes are relative to world_origin_metres, along the world's axes";
  json["world_origin_metres"] = origin;
  json["masked"] = masked_json(boxes.flags);
  json["joints"] = joints_json(skeleton, frame, options.offset);
  json["links"] = links_json(character, frame, origin);
  json["leaves"] = leaves_json(character, boxes);
  json["merges"] = merges_json(character, boxes);
  if (coverage) json["coverage"] = coverage_json(*coverage, skeleton);
  if (surface) json["surface"] = surface_json(*surface);
  json["altered"] = import_json(report, pairs);
  json["size_doubts"] = report.size_doubts;
  json["notes"] = scene.notes;

  if (!output) {
    std::istringstream lines(to_text(json));
    for (std::string line; std::getline(lines, line);) std::cout << scenes::printable(line) << '\n';
    return 0;
  }
  write_json(output, json);
  return 0;
}

}  // namespace cab::perf
