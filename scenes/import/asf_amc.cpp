#include "scenes/import/asf_amc.h"

#include "scenes/import/input_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/unit.h"
#include "scenes/import/words.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string_view>
#include <vector>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDefaultFramesPerSecond = 120;
constexpr double kStaticFrameSeconds = 1.0 / 30;
constexpr double kMostFramesPerSecond = 1e4;
constexpr double kMetresPerInch = .0254;

using Words = std::vector<std::string_view>;

// A channel: rotation about x, y or z (0 to 2), or translation along it (3 to 5).
using Channel = std::size_t;
constexpr const char* kChannelNames[] = {"rx", "ry", "rz", "tx", "ty", "tz"};

struct Bone {
  std::string name;
  std::int32_t parent = -1;  // index in Asf::bones
  std::vector<std::size_t> children;
  Vec3 direction = {0, 0, 0};  // in the world's axes
  double length = 0;
  Vec3 axis_angles = {0, 0, 0};  // degrees or radians
  std::string axis_order = "xyz";
  std::vector<Channel> channels;
  std::size_t first_value = 0;  // index of this bone's first value among the values of a frame
};

// Bone 0 is the root, which has no length.
struct Asf {
  std::vector<Bone> bones;
  std::map<std::string, std::size_t, std::less<>> by_name;
  Vec3 root_position = {0, 0, 0};
  double length_unit = 1;
  bool in_radians = false;
  std::size_t value_count = 0;  // of a frame
};

// Gives the lines of a text as words, without comments and empty lines.
class Lines {
 public:
  explicit Lines(const NamedText& file) : name_(file.name), rest_(file.text) {}

  bool next() {
    for (words_.clear(); words_.empty() && !rest_.empty(); ++line_) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      const std::string_view text = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      split_line(text.substr(0, text.find('#')), words_);
    }
    return !words_.empty();
  }

  const Words& words() const { return words_; }
  std::string first() const { return lower_case(words_[0]); }

  [[noreturn]] void fail(const std::string& reason) const {
    throw ImportError(name_ + ": line " + std::to_string(line_) + ": " + reason);
  }

  double number(std::size_t word) const {
    double value = 0;
    if (word >= words_.size()) fail("a number is missing after '" + printable(words_.back()) + "'");
    if (!read_number(words_[word], value)) fail("'" + printable(words_[word]) + "' is not a number");
    if (!(std::fabs(value) <= kMaxImportValue)) fail("'" + printable(words_[word]) + "' is not finite or out of range");
    return value;
  }

  Vec3 vector() const { return {number(1), number(2), number(3)}; }

 private:
  const std::string& name_;
  std::string_view rest_;
  std::size_t line_ = 0;
  Words words_;
};

std::string in_quotes(std::string_view word) { return "'" + printable(word) + "'"; }

// -------------------------------------------------------------------------------------------------- the skeleton

class AsfReader {
 public:
  explicit AsfReader(const NamedText& file) : file_(file), lines_(file) {
    asf_.bones.emplace_back();
    asf_.bones[0].name = "root";
    asf_.by_name.emplace("root", 0);
  }

  Asf read() {
    std::string section;
    while (lines_.next()) {
      const std::string word = lines_.first();
      if (word[0] == ':') {
        section = word;
      } else if (section == ":units") {
        read_unit(word);
      } else if (section == ":root") {
        read_root(word);
      } else if (section == ":bonedata" && word == "begin") {
        read_bone();
      } else if (section == ":hierarchy" && word != "begin" && word != "end") {
        read_children();
      }
    }
    if (asf_.bones.size() == 1) throw ImportError(file_.name + ": no skeleton: it has no bones");
    check_tree();
    return std::move(asf_);
  }

 private:
  void read_unit(const std::string& word) {
    if (word == "length") asf_.length_unit = lines_.number(1);
    if (word == "angle") asf_.in_radians = lines_.words().size() > 1 && lower_case(lines_.words()[1]) == "rad";
  }

  void read_root(const std::string& word) {
    Bone& root = asf_.bones[0];
    if (word == "order") read_channels(root);
    if (word == "axis") root.axis_order = order(1);
    if (word == "position") asf_.root_position = lines_.vector();
    if (word == "orientation") root.axis_angles = lines_.vector();
  }

  // The axes of a word such as XYZ, in lower case.
  std::string order(std::size_t word) const {
    if (word >= lines_.words().size()) return "xyz";
    std::string letters = lower_case(lines_.words()[word]), sorted = letters;
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "xyz") lines_.fail(in_quotes(lines_.words()[word]) + " is not an order of axes such as XYZ");
    return letters;
  }

  void read_channels(Bone& bone) {
    const bool is_root = &bone == asf_.bones.data();
    bone.channels.clear();
    for (std::size_t w = 1; w < lines_.words().size(); ++w) {
      const std::string word = lower_case(lines_.words()[w]);
      const auto found = std::find(std::begin(kChannelNames), std::end(kChannelNames), word);
      const auto channel = static_cast<Channel>(found - std::begin(kChannelNames));
      if (channel > 2 && !(is_root && channel < 6))
        lines_.fail(in_quotes(lines_.words()[w]) +
                    (is_root ? " is none of tx, ty, tz, rx, ry, rz" : " is none of rx, ry, rz"));
      if (std::count(bone.channels.begin(), bone.channels.end(), channel) > 0)
        lines_.fail(in_quotes(lines_.words()[w]) + " is given twice");
      bone.channels.push_back(channel);
    }
  }

  void read_bone() {
    Bone bone;
    for (;;) {
      if (!lines_.next() || lines_.first()[0] == ':')
        lines_.fail("a bone has no end" + (bone.name.empty() ? "" : ": " + bone.name));
      const std::string word = lines_.first();
      if (word == "end") break;
      if (word == "name" && lines_.words().size() > 1) bone.name = printable(lines_.words()[1]);
      if (word == "direction") bone.direction = lines_.vector();
      if (word == "length") bone.length = lines_.number(1);
      if (word == "dof") read_channels(bone);
      if (word != "axis") continue;
      bone.axis_angles = lines_.vector();
      bone.axis_order = order(4);
    }
    if (bone.name.empty()) lines_.fail("a bone has no name");
    if (asf_.bones.size() == kMaxJoints) lines_.fail("more than " + std::to_string(kMaxJoints) + " bones");
    if (!asf_.by_name.emplace(bone.name, asf_.bones.size()).second)
      lines_.fail("more than one bone is named " + bone.name);
    const double size = length(bone.direction);
    if (bone.length != 0 && !(size > 0)) lines_.fail("the direction of " + bone.name + " is 0");
    if (size > 0) bone.direction = (1 / size) * bone.direction;
    asf_.bones.push_back(std::move(bone));
  }

  std::size_t bone_named(std::string_view word) const {
    const auto found = asf_.by_name.find(printable(word));
    if (found == asf_.by_name.end()) lines_.fail("there is no bone " + in_quotes(word));
    return found->second;
  }

  void read_children() {
    const std::size_t parent = bone_named(lines_.words()[0]);
    for (std::size_t w = 1; w < lines_.words().size(); ++w) {
      const std::size_t child = bone_named(lines_.words()[w]);
      Bone& bone = asf_.bones[child];
      if (child == 0) lines_.fail("the root has a parent");
      if (bone.parent >= 0) lines_.fail(bone.name + " has two parents");
      bone.parent = static_cast<std::int32_t>(parent);
      asf_.bones[parent].children.push_back(child);
    }
  }

  // Every bone must be below the root. Gives each its place in a frame's values.
  void check_tree() {
    std::size_t reached = 0;
    for (std::vector<std::size_t> open = {0}; !open.empty(); ++reached) {
      const std::vector<std::size_t>& children = asf_.bones[open.back()].children;
      open.pop_back();
      open.insert(open.end(), children.begin(), children.end());
    }
    for (const Bone& bone : asf_.bones)
      if (reached < asf_.bones.size() && bone.parent < 0 && &bone != asf_.bones.data())
        throw ImportError(file_.name + ": bone " + bone.name + " is not in the hierarchy");
    if (reached < asf_.bones.size()) throw ImportError(file_.name + ": the hierarchy has a loop");
    for (Bone& bone : asf_.bones) {
      bone.first_value = asf_.value_count;
      asf_.value_count += bone.channels.size();
    }
  }

  const NamedText& file_;
  Lines lines_;
  Asf asf_;
};

// ---------------------------------------------------------------------------------------------------- the motion

struct Amc {
  std::vector<double> values;  // [frame][value]
  std::uint32_t frame_count = 0;
  bool in_radians = false;
};

class AmcReader {
 public:
  AmcReader(const Asf& asf, const NamedText& file) : asf_(asf), file_(file), lines_(file) {
    amc_.in_radians = asf.in_radians;
  }

  Amc read() {
    while (lines_.next()) {
      const std::string word = lines_.first();
      std::uint32_t number = 0;
      if (word[0] == ':')
        read_unit(word);
      else if (lines_.words().size() == 1 && read_number(lines_.words()[0], number))
        begin_frame(number);
      else
        read_values();
    }
    if (amc_.frame_count == 0) throw ImportError(file_.name + ": no motion: it has no frames");
    end_frame();
    return std::move(amc_);
  }

 private:
  void read_unit(const std::string& word) {
    if (word == ":radians") amc_.in_radians = true;
    if (word == ":degrees") amc_.in_radians = false;
  }

  void begin_frame(std::uint32_t number) {
    if (amc_.frame_count > 0 && number != number_ + 1)
      lines_.fail("frame " + std::to_string(number) + " follows frame " + std::to_string(number_));
    end_frame();
    number_ = number;
    if (++amc_.frame_count > kMaxJointFrames / (2 * asf_.bones.size()))
      lines_.fail("frames x joints is more than " + std::to_string(kMaxJointFrames));
    amc_.values.resize(amc_.frame_count * asf_.value_count);
    is_given_.assign(asf_.bones.size(), false);
  }

  // Checks that the last frame has all bones that have values.
  void end_frame() const {
    for (std::size_t b = 0; amc_.frame_count > 0 && b < asf_.bones.size(); ++b)
      if (!asf_.bones[b].channels.empty() && !is_given_[b])
        lines_.fail("frame " + std::to_string(number_) + ", which ends here, has no " + asf_.bones[b].name);
  }

  void read_values() {
    const Words& words = lines_.words();
    if (amc_.frame_count == 0) lines_.fail("expected the number of a frame, found " + in_quotes(words[0]));
    const auto found = asf_.by_name.find(printable(words[0]));
    if (found == asf_.by_name.end()) lines_.fail("the skeleton has no bone " + in_quotes(words[0]));
    const Bone& bone = asf_.bones[found->second];
    if (words.size() - 1 != bone.channels.size())
      lines_.fail(bone.name + " has " + std::to_string(words.size() - 1) + " values, its dof are " +
                  std::to_string(bone.channels.size()));
    if (is_given_[found->second]) lines_.fail(bone.name + " is twice in frame " + std::to_string(number_));
    is_given_[found->second] = true;
    for (std::size_t w = 1; w < words.size(); ++w)
      amc_.values[(amc_.frame_count - 1) * asf_.value_count + bone.first_value + w - 1] = lines_.number(w);
  }

  const Asf& asf_;
  const NamedText& file_;
  Lines lines_;
  Amc amc_;
  std::uint32_t number_ = 0;
  std::vector<bool> is_given_;  // [bone] in the last frame
};

// -------------------------------------------------------------------------------------------------- the kinematics

Quat about(std::size_t axis, double radians) {
  Quat q = {0, 0, 0, std::cos(radians / 2)};
  q[axis] = std::sin(radians / 2);
  return q;
}

// The rotation about fixed axes, one after the other in the order of the letters.
Quat from_angles(const Vec3& radians, const std::string& order) {
  Quat q = {0, 0, 0, 1};
  for (const char letter : order) {
    const auto axis = static_cast<std::size_t>(letter - 'x');
    q = multiply(about(axis, radians[axis]), q);
  }
  return q;
}

// The rotation and translation of a bone in its parent, with the world's axes in the rest pose. `values` are of one
// frame, or null for the rest pose.
struct Local {
  Quat rotation = {0, 0, 0, 1};
  Vec3 translation = {0, 0, 0};  // of the root alone
};

Local local_pose(const Asf& asf, const Bone& bone, const double* values, bool in_radians) {
  Local local;
  const bool is_root = &bone == asf.bones.data();
  if (is_root) local.translation = asf.root_position;
  Vec3 angles = {0, 0, 0};
  std::string order;  // as the channels are listed
  for (std::size_t c = 0; values != nullptr && c < bone.channels.size(); ++c) {
    const std::size_t channel = bone.channels[c];
    const double value = values[bone.first_value + c];
    if (channel > 2) {
      local.translation[channel - 3] = value;
    } else {
      angles[channel] = in_radians ? value : value * kPi / 180;
      order += static_cast<char>('x' + channel);
    }
  }
  // The angles are about the bone's own axes. The axes of the root also say the order of its angles.
  const double unit = asf.in_radians ? 1 : kPi / 180;
  const Quat axes = from_angles(unit * bone.axis_angles, bone.axis_order);
  local.rotation = multiply(multiply(axes, from_angles(angles, is_root ? bone.axis_order : order)), conjugate(axes));
  return local;
}

// The bones in an order in which parents come first, and the joints that they become.
struct Joint {
  std::size_t bone = 0;
  bool is_end_site = false;
};

std::vector<Joint> list_joints(const Asf& asf) {
  std::vector<Joint> joints;
  for (std::vector<std::size_t> open = {0}; !open.empty();) {
    const std::size_t b = open.back();
    const std::vector<std::size_t>& children = asf.bones[b].children;
    open.pop_back();
    joints.push_back({b, false});
    if (children.empty()) joints.push_back({b, true});
    open.insert(open.end(), children.rbegin(), children.rend());
  }
  return joints;
}

Skeleton make_skeleton(const Asf& asf, const Amc* amc, const ImportOptions& options) {
  Skeleton skeleton;
  set_unit(options, skeleton);
  const std::vector<Joint> joints = list_joints(asf);
  const auto segment = [&asf](std::int32_t bone) {
    const Bone& above = asf.bones[static_cast<std::size_t>(bone)];
    return above.length * above.direction;
  };
  // The joint above: the joint of the parent bone, or for an end site that of the bone itself.
  const auto bone_above = [&asf](const Joint& joint) {
    return joint.is_end_site ? static_cast<std::int32_t>(joint.bone) : asf.bones[joint.bone].parent;
  };
  std::vector<std::int32_t> joint_of(asf.bones.size(), -1);
  for (const Joint& joint : joints) {
    const std::int32_t above = bone_above(joint);
    if (!joint.is_end_site) joint_of[joint.bone] = static_cast<std::int32_t>(skeleton.joint_names.size());
    skeleton.joint_names.push_back(asf.bones[joint.bone].name + (joint.is_end_site ? "/End" : ""));
    skeleton.joint_parents.push_back(above < 0 ? -1 : joint_of[static_cast<std::size_t>(above)]);
    skeleton.is_end_site.push_back(joint.is_end_site);
    const Vec3 offset = above < 0 ? asf.root_position : segment(above);
    for (const double component : offset) skeleton.rest_offsets.push_back(component * skeleton.unit.metres);
  }

  skeleton.frame_count = amc == nullptr ? 1 : amc->frame_count;
  std::vector<Quat> rotation(asf.bones.size());
  std::vector<Vec3> position(asf.bones.size());  // where a bone begins
  for (std::uint32_t f = 0; f < skeleton.frame_count; ++f) {
    const double* const values = amc == nullptr ? nullptr : amc->values.data() + f * asf.value_count;
    for (const Joint& joint : joints) {
      const std::int32_t above = bone_above(joint);
      Vec3 place = {0, 0, 0};
      if (above >= 0) {
        const auto b = static_cast<std::size_t>(above);
        place = position[b] + rotate(rotation[b], segment(above));
      }
      if (!joint.is_end_site) {
        const Local local = local_pose(asf, asf.bones[joint.bone], values, amc != nullptr && amc->in_radians);
        position[joint.bone] = place = place + local.translation;
        rotation[joint.bone] = local.rotation;
        if (above >= 0)
          rotation[joint.bone] = normalized(multiply(rotation[static_cast<std::size_t>(above)], local.rotation));
      }
      const Quat& q = rotation[joint.bone];
      skeleton.rotations.insert(skeleton.rotations.end(), q.begin(), q.end());
      for (const double component : place) skeleton.positions.push_back(component * skeleton.unit.metres);
    }
  }
  if (asf.length_unit != 1 && asf.length_unit > 0 && skeleton.unit.metres == 1)
    skeleton.notes.push_back("the file's unit of length is " + std::to_string(asf.length_unit) +
                             ": if it counts inches, as in the CMU database, that is --units " +
                             std::to_string(kMetresPerInch / asf.length_unit));
  return skeleton;
}

}  // namespace

Skeleton read_asf(const NamedText& asf, const ImportOptions& options) {
  Skeleton skeleton = make_skeleton(AsfReader(asf).read(), nullptr, options);
  skeleton.frame_seconds = kStaticFrameSeconds;
  return skeleton;
}

Skeleton read_asf_amc(const NamedText& asf, const NamedText& amc, const ImportOptions& options) {
  const double rate = options.frames_per_second == 0 ? kDefaultFramesPerSecond : options.frames_per_second;
  if (!(rate > 1 / kMaxFrameSeconds && rate <= kMostFramesPerSecond))
    throw ImportError(amc.name + ": frames a second must be above 1/3600 and at most 10000");
  const Asf bones = AsfReader(asf).read();
  const Amc motion = AmcReader(bones, amc).read();
  Skeleton skeleton = make_skeleton(bones, &motion, options);
  skeleton.frame_seconds = 1 / rate;
  if (options.frames_per_second == 0) {
    skeleton.notes.emplace_back(
        "the file has no frame rate: 120 frames a second, as in the CMU database; --fps changes it");
    skeleton.alterations.push_back({AlterationKind::kGuessed, "clocks", 1, skeleton.notes.back()});
  }
  return skeleton;
}

AsfFile find_asf(const std::string& amc_path) {
  namespace fs = std::filesystem;
  const fs::path path(amc_path);
  const std::string stem = path.stem().string(), name = printable(amc_path);
  const std::string subject = stem.substr(0, stem.rfind('_'));
  std::error_code error;
  std::vector<std::string> all;
  std::string found;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(path.has_parent_path() ? path.parent_path() : fs::path("."), error)) {
    if (lower_extension(entry.path().string()) != ".asf") continue;
    const std::string other = entry.path().stem().string();
    all.push_back(entry.path().string());
    if (other == stem || (other == subject && found.empty())) found = all.back();
  }
  if (!found.empty()) return {found};
  if (all.size() == 1) return {all[0], false};
  throw ImportError(name + ": no skeleton for it: put " + printable(stem) + ".asf" +
                    (subject == stem ? "" : " or " + printable(subject) + ".asf") + " beside it");
}

}  // namespace cab::scenes
