// Reads a skeleton and its motion from a file through assimp.
#include "scenes/import/asf_amc.h"
#include "scenes/import/bvh_text.h"
#include "scenes/import/gltf_file.h"
#include "scenes/import/import.h"
#include "scenes/import/import_payload.h"
#include "scenes/import/in_child.h"
#include "scenes/import/input_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/prepared_file.h"
#include "scenes/import/printable.h"
#include "scenes/import/scene_file.h"
#include "scenes/import/unit.h"
#include "scenes/vec3d.h"

#include <assimp/config.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

namespace cab::scenes {
namespace {

// Decides as assimp does: by the extension, or by the first word of the text.
bool is_bvh(const std::string& extension, const std::string& first_bytes) {
  return extension == ".bvh" || first_bytes.find("HIERARCHY") != std::string::npos;
}

// Runs one of assimp's readers. Every way in which it can fail becomes an ImportError.
template <class Read>
const aiScene& read_with_assimp(Assimp::Importer& importer, const std::string& name, Read read) {
  // Without these settings assimp invents a mesh for every skeleton, and nodes for the pivots of FBX joints.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  const aiScene* scene = nullptr;
  std::string reason;
  try {
    scene = read();
    reason = importer.GetErrorString();
  } catch (const ImportError&) { throw; } catch (const std::exception& error) {
    reason = error.what();
  }
  if (scene == nullptr) throw ImportError(name + ": assimp cannot read it: " + printable(reason));
  if (scene->mRootNode == nullptr) throw ImportError(name + ": assimp found no nodes in it");
  return *scene;
}

// assimp's track of one joint, checked against the text from which it came.
const aiNodeAnim& checked_track(const aiAnimation& animation, std::size_t track, const BvhJoint& joint,
                                std::uint32_t frame_count, const std::string& name) {
  const aiNodeAnim& keys = *animation.mChannels[track];
  const bool has_positions = joint.channels.size() == 6;
  const auto fail = [&](const std::string& reason) {
    throw ImportError(name + ": joint " + joint.name + ": " + reason);
  };
  if (keys.mNumRotationKeys != frame_count || keys.mNumPositionKeys != (has_positions ? frame_count : 1)) {
    fail("assimp read another number of frames than the file has");
  }
  for (unsigned k = 0; k < keys.mNumPositionKeys; ++k) {
    const aiVector3D& p = keys.mPositionKeys[k].mValue;
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      fail("position key " + std::to_string(k) + " is not finite");
  }
  for (unsigned k = 0; k < keys.mNumRotationKeys; ++k) {
    const aiQuaternion& q = keys.mRotationKeys[k].mValue;
    if (!std::isfinite(q.x) || !std::isfinite(q.y) || !std::isfinite(q.z) || !std::isfinite(q.w)) {
      fail("rotation key " + std::to_string(k) + " is not finite");
    }
  }
  return keys;
}

// A joint's translation in its parent's frame. Position channels replace the offset. assimp keeps them for joints with
// exactly six channels and drops them for all others, whose position channels therefore come from the text.
Vec3 local_translation(const BvhText& text, const BvhJoint& joint, const aiNodeAnim* keys, std::uint32_t frame) {
  Vec3 local = {joint.offset[0], joint.offset[1], joint.offset[2]};
  if (joint.channels.size() == 6) {
    const aiVector3D& p = keys->mPositionKeys[frame].mValue;
    return {p.x, p.y, p.z};
  }
  for (std::size_t c = 0; c < joint.channels.size(); ++c) {
    const auto axis = static_cast<std::size_t>(joint.channels[c]);
    if (axis < 3) local[axis] = text.values[frame * text.channel_count + joint.first_value + c];
  }
  return local;
}

Skeleton read_bvh(std::string bytes, const std::string& name, const ImportOptions& options) {
  if (!options.animation.empty()) throw ImportError(name + ": a BVH file has one motion, without a name");
  const BvhText text = check_bvh_text(bytes, name);

  // assimp gets the checked bytes instead of the file, which may have changed since.
  Assimp::Importer importer;
  const aiScene& scene = read_with_assimp(
      importer, name, [&] { return importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "bvh"); });
  std::size_t track_count = 0;
  for (const BvhJoint& joint : text.joints) track_count += joint.is_end_site ? 0 : 1;
  if (scene.mNumAnimations != 1 || scene.mAnimations[0]->mNumChannels != track_count) {
    throw ImportError(name + ": assimp read another number of joints than the file has");
  }

  Skeleton skeleton;
  skeleton.notes = text.notes;
  set_unit(options, skeleton);
  skeleton.frame_seconds = text.frame_seconds;
  skeleton.frame_count = text.frame_count;
  // assimp's tracks are in file order, like the joints of the text; names need not be unique.
  std::vector<const aiNodeAnim*> tracks;
  std::size_t next_track = 0;
  for (const BvhJoint& joint : text.joints) {
    skeleton.joint_names.push_back(joint.name);
    skeleton.joint_parents.push_back(joint.parent);
    skeleton.is_end_site.push_back(joint.is_end_site);
    for (const double component : joint.offset) skeleton.rest_offsets.push_back(component * skeleton.unit.metres);
    tracks.push_back(nullptr);
    if (joint.is_end_site) continue;
    tracks.back() = &checked_track(*scene.mAnimations[0], next_track++, joint, text.frame_count, name);
  }

  const std::size_t joint_count = text.joints.size();
  skeleton.rotations.reserve(text.frame_count * joint_count * 4);
  skeleton.positions.reserve(text.frame_count * joint_count * 3);
  std::vector<Quat> rotation(joint_count);
  std::vector<Vec3> position(joint_count);
  for (std::uint32_t f = 0; f < text.frame_count; ++f) {
    for (std::size_t j = 0; j < joint_count; ++j) {
      const BvhJoint& joint = text.joints[j];
      rotation[j] = {0, 0, 0, 1};
      if (tracks[j] != nullptr) {
        const aiQuaternion& q = tracks[j]->mRotationKeys[f].mValue;
        rotation[j] = normalized({q.x, q.y, q.z, q.w});
      }
      position[j] = skeleton.unit.metres * local_translation(text, joint, tracks[j], f);
      if (joint.parent >= 0) {
        const auto parent = static_cast<std::size_t>(joint.parent);
        position[j] = position[parent] + rotate(rotation[parent], position[j]);
        rotation[j] = normalized(multiply(rotation[parent], rotation[j]));
      }
      skeleton.rotations.insert(skeleton.rotations.end(), rotation[j].begin(), rotation[j].end());
      skeleton.positions.insert(skeleton.positions.end(), position[j].begin(), position[j].end());
    }
  }
  return skeleton;
}

// A scene, which keeps alive the importer that owns it.
struct SceneFile {
  std::shared_ptr<const aiScene> scene;
  FileFacts facts;
};

std::shared_ptr<const aiScene> owned(std::shared_ptr<Assimp::Importer> importer, const aiScene& scene) {
  return {std::move(importer), &scene};
}

// The begin of a file, by which its format is told.
std::string head_of(const std::string& path) {
  constexpr std::size_t kHeadBytes = 200;
  const std::string name = printable(path);
  return read_bytes(path, name, std::min(check_file(path, name), kHeadBytes));
}

NamedText named_text(const std::string& path) {
  const std::string name = printable(path);
  return {name, read_text(path, name)};
}

// A file of a format that has a skeleton and its motion alone; nothing for any other.
std::optional<Skeleton> read_capture(const std::string& path, const ImportOptions& options) {
  const std::string extension = lower_extension(path), head = head_of(path);
  if (extension == ".asf") return read_asf(named_text(path), options);
  if (extension == ".amc") {
    const AsfFile asf = find_asf(path);
    Skeleton skeleton = read_asf_amc(named_text(asf.path), named_text(path), options);
    if (!asf.has_name_of_motion) {
      skeleton.notes.push_back("the skeleton is " + printable(std::filesystem::path(asf.path).filename().string()) +
                               ", the only one in the folder");
      skeleton.alterations.push_back({AlterationKind::kGuessed, "skeletons", 1, skeleton.notes.back()});
    }
    return skeleton;
  }
  if (is_gltf(extension, head) || !is_bvh(extension, head)) return {};
  NamedText text = named_text(path);
  return read_bvh(std::move(text.text), text.name, options);
}

// Any other file.
SceneFile read_scene(const std::string& path) {
  const std::string name = printable(path), extension = lower_extension(path);
  // assimp 5.2.5 crashes on good RAW files, and allocates as much as an OFF file claims to need. Neither can hold a
  // skeleton.
  if (!is_gltf(extension, head_of(path)) && (extension == ".raw" || extension == ".off"))
    throw ImportError(name + ": no skeleton: files of this type cannot hold one");
  SceneFile file;
  const auto importer = std::make_shared<Assimp::Importer>();
  const auto read = [&] { return read_prepared(*importer, path, name, file.facts); };
  file.scene = owned(importer, read_with_assimp(*importer, name, read));
  return file;
}

// The motion of options.motion, with lengths as its file has them.
Motion read_motion(const ImportOptions& options) {
  const std::string& path = options.motion->path;
  const std::string name = printable(path);
  const auto refuse = [&name] { throw ImportError(name + ": it has no animation"); };
  ImportOptions unscaled = options;
  unscaled.metres_per_unit.reset();
  if (std::optional<Skeleton> skeleton = read_capture(path, unscaled)) {
    if (lower_extension(path) == ".asf") refuse();
    return motion_of_skeleton(std::move(*skeleton), name);
  }
  const SceneFile file = read_scene(path);
  if (file.scene->mNumAnimations == 0) refuse();
  Motion motion = motion_of_scene(file.scene, name, options.animation);
  for (const std::string& note : file.facts.notes) motion.notes.push_back(name + ": " + note);
  if (!file.facts.repeated_names.empty())
    motion.notes.push_back("warning: " + name + ": the motion of several nodes of one name (" +
                           listed(file.facts.repeated_names) + ") goes to the first of them");
  return motion;
}

Skeleton read_skeleton(const std::string& path, const ImportOptions& options) {
  const std::string name = printable(path);
  if (std::optional<Skeleton> skeleton = read_capture(path, options)) {
    if (options.motion)
      throw ImportError(name + ": a motion in another file is for files of nodes, such as glTF, FBX and Collada");
    return std::move(*skeleton);
  }
  const SceneFile file = read_scene(path);
  const Motion motion = options.motion ? read_motion(options) : motion_of_scene(file.scene, name, options.animation);
  Skeleton skeleton = skeleton_of_scene(*file.scene, name, motion, options, file.facts.named_bones);
  skeleton.notes.insert(skeleton.notes.end(), file.facts.notes.begin(), file.facts.notes.end());
  std::vector<std::string> repeated;
  for (const std::string& joint : skeleton.joint_names)
    if (std::count(file.facts.repeated_names.begin(), file.facts.repeated_names.end(), joint) > 0)
      repeated.push_back(joint);
  if (!repeated.empty())
    skeleton.notes.push_back("warning: the weights and the motion of several nodes of one name (" + listed(repeated) +
                             ") all go to the first of them: give each a name of its own");
  return skeleton;
}

Skeleton import_here(const std::string& path, const ImportOptions& options) {
  Skeleton skeleton = read_skeleton(path, options);
  skeleton.is_static = skeleton.frame_count == 1;
  if (skeleton.is_static)
    skeleton.notes.push_back("no motion: the pose of " +
                             (options.motion ? printable(options.motion->path) : "the file") + " holds for all frames");
  return skeleton;
}

}  // namespace

Skeleton import_skeleton(const std::string& path, const ImportOptions& options) {
  const auto check_unit = [](const std::string& file, double unit) {
    if (!(unit >= kLeastUnit && unit <= kGreatestUnit))
      throw ImportError(printable(file) + ": metres per unit must be between 1e-9 and 1e9");
  };
  if (options.metres_per_unit) check_unit(path, *options.metres_per_unit);
  if (options.motion && options.motion->metres_per_unit != 0)
    check_unit(options.motion->path, options.motion->metres_per_unit);
  if (options.metres_per_unit && options.guesses_unit)
    throw ImportError(printable(path) + ": a length unit is given or guessed, not both");
  ChildFiles files;
  if (options.motion) files.other = options.motion->path;
  Skeleton skeleton = options.sandbox
                          ? from_child(
                                path, *options.sandbox, [&] { return skeleton_payload(import_here(path, options)); },
                                read_skeleton_payload, files)
                          : in_this_process([&] { return import_here(path, options); });
  fit_unit(options, skeleton);
  return skeleton;
}

}  // namespace cab::scenes
