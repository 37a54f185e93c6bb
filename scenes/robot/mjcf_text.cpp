#include "scenes/robot/mjcf_text.h"

#include "scenes/import/input_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/mjcf_tree.h"
#include "scenes/robot/mjcf_words.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <locale>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

namespace cab::scenes {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;
using Attributes = std::map<std::string, std::string>;
using Counts = std::map<std::string, std::size_t>;  // of words

constexpr double kPi = 3.14159265358979323846;

// <replicate> makes a text of any size out of a small one.
constexpr std::size_t kMaxLines = 200000;
constexpr std::size_t kMaxTextBytes = std::size_t{64} << 20;
constexpr std::size_t kMaxWork = 4000000;  // elements and attributes that are looked at

// What geoms, joints and meshes are asked for that their class may say.
constexpr std::string_view kClassKeys[] = {"conaffinity", "contype", "inertia",      "limited",
                                           "mesh",        "range",   "shellinertia", "type"};

bool is_zero(std::string_view number) {
  return number.find('0') != number.npos && number.find_first_not_of(" 0") == number.npos;
}

std::vector<const XMLElement*> named(const std::vector<const XMLElement*>& elements, std::string_view name) {
  std::vector<const XMLElement*> found;
  for (const XMLElement* element : elements)
    if (element->Name() == name) found.push_back(element);
  return found;
}

// Whether an OBJ text has faces before a line that begins an object or a group. libmujoco 2.2.2 reads these alone.
bool has_several_objects(const std::string& text) {
  bool has_face = false;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t\r\n", at)) != text.npos;) {
    const std::string_view word = std::string_view(text).substr(at, text.find_first_of(" \t\r\n", at) - at);
    if (has_face && (word == "o" || word == "g")) return true;
    has_face = has_face || word == "f";
    at = text.find_first_of("\r\n", at);
  }
  return false;
}

// Lines of a text, one element each, and the elements that they come from.
class MjcfLines {
 public:
  explicit MjcfLines(const MjcfTree& tree) : tree_(tree) {}

  void open(const std::string& tag, const Attributes& attributes, const XMLElement& origin) {
    std::string line = "<" + tag;
    for (const auto& [name, value] : attributes) line += " " + name + "=\"" + escaped(value) + "\"";
    add(line + ">", origin);
    open_.push_back(tag);
  }

  void close() {
    add("</" + open_.back() + ">", *origins_.back());
    open_.pop_back();
  }

  void element(const std::string& tag, const Attributes& attributes, const XMLElement& origin) {
    open(tag, attributes, origin);
    close();
  }

  void append(const MjcfLines& more) {
    for (std::size_t k = 0; k < more.lines_.size(); ++k) add(more.lines_[k], *more.origins_[k]);
  }

  std::string joined() const {
    std::string text;
    for (const std::string& line : lines_) text += line + "\n";
    return text;
  }

  const std::vector<const XMLElement*>& origins() const { return origins_; }

 private:
  void add(const std::string& line, const XMLElement& origin) {
    bytes_ += line.size() + 1;
    if (lines_.size() >= kMaxLines || bytes_ > kMaxTextBytes)
      throw ImportError(tree_.place_of(origin) + ": with what it repeats and includes the robot is too large");
    lines_.push_back(line);
    origins_.push_back(&origin);
  }

  // A line break in a value would end the line.
  static std::string escaped(const std::string& value) {
    std::string text;
    for (const char c : value) switch (c) {
        case '&': text += "&amp;"; break;
        case '<': text += "&lt;"; break;
        case '>': text += "&gt;"; break;
        case '"': text += "&quot;"; break;
        case '\n': text += "&#10;"; break;
        case '\r': text += "&#13;"; break;
        default: text += c;
      }
    return text;
  }

  const MjcfTree& tree_;
  std::vector<std::string> lines_;
  std::vector<const XMLElement*> origins_;
  std::vector<std::string> open_;  // tags
  std::size_t bytes_ = 0;
};

class MjcfWriter {
 public:
  MjcfWriter(const XmlText& text, const RobotOptions& options)
      : options_(options),
        tree_(text, MjcfTree::OnError::kThrow),
        defaults_(tree_),
        assets_(tree_),
        bodies_(tree_),
        contacts_(tree_) {}

  MjcfText write() {
    const XMLElement& root = tree_.root();
    const Attributes model = check_attributes(root, "mujoco");
    const std::vector<const XMLElement*> sections = tree_.children(root);
    for (const XMLElement* section : sections) check_section(*section);
    for (const XMLElement* section : named(sections, "option")) read_option(*section);
    for (const XMLElement* section : named(sections, "contact")) list_pairs(*section);
    for (const XMLElement* section : named(sections, "default")) write_root_default(*section);
    for (const XMLElement* section : named(sections, "worldbody")) write_world(*section);
    for (const XMLElement* section : named(sections, "asset")) write_assets(*section);  // of the bodies' meshes
    for (const XMLElement* section : named(sections, "contact")) write_contact(*section);

    MjcfLines all(tree_);
    all.open("mujoco", model, root);
    all.element("compiler", compiler(), root);
    all.element("size", {{"nuser_body", "1"}}, root);
    all.open("option", {}, root);  // libmujoco tries a step, which needs neither
    all.element("flag", {{"constraint", "disable"}, {"contact", "disable"}}, root);
    all.close();
    for (const MjcfLines* part : {&defaults_, &assets_, &bodies_, &contacts_}) all.append(*part);
    all.close();
    result_.xml = all.joined();
    std::map<std::string, std::size_t> files;
    for (const XMLElement* origin : all.origins())
      result_.lines.push_back(
          {files.emplace(tree_.file_of(*origin), files.size()).first->second, origin->GetLineNum()});
    result_.files.resize(files.size());
    for (const auto& [file, index] : files) result_.files[index] = file;
    add_notes();
    return std::move(result_);
  }

 private:
  // Where an element of a body stands.
  struct Context {
    std::string_view class_name = "main";  // of elements without one
    std::string suffix;                    // of names, inside <replicate>
    bool is_top = true;                    // the world, or a frame in it
    bool drops_free_joints = false;        // of this body
  };

  // ----------------------------------------------------------------------------------------------------------- words

  [[noreturn]] void refuse(const XMLElement& element, const std::string& what, const std::string& word) const {
    throw ImportError(tree_.place_of(element) + ": " + what + "; --ignore " + printable(word) + " passes it over");
  }

  static std::string unknown() {
    return std::string("which no MuJoCo up to ") + kMjcfWordsVersion + " has: it may change the robot";
  }

  bool is_ignored(const std::string& word) {
    const std::vector<std::string>& words = options_.ignored_words;
    if (std::find(words.begin(), words.end(), word) == words.end()) return false;
    ++ignored_[word];
    return true;
  }

  void count_work(const XMLElement& element) {
    if (++work_ > kMaxWork)
      throw ImportError(tree_.place_of(element) + ": with what it repeats and includes the robot is too large");
  }

  // The attributes of an element that are read. `kind` is its name in the table of words.
  Attributes check_attributes(const XMLElement& element, const std::string& kind) {
    Attributes read;
    const std::string has = "<" + printable(element.Name()) + "> has the attribute ";
    for (const XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      count_work(element);
      const std::string name = a->Name();
      const MjcfUse use = mjcf_attribute(kind, name);
      if (use == MjcfUse::kRead) {
        read[name] = a->Value();
      } else if (use == MjcfUse::kCut) {
        if (name != "maxhullvert") {
          ++cut_[name];
        } else if (a->Value() != std::string_view("-1")) {  // which means no bound
          ++whole_hulls_;
        }
      } else if (!is_ignored(name)) {
        refuse(element, has + printable(name) + ", " + (use == MjcfUse::kRefused ? "which is not read" : unknown()),
               name);
      }
    }
    return read;
  }

  // Whether a child of an element is read.
  bool is_read(const XMLElement& child, const std::string& parent) {
    count_work(child);
    const std::string tag = child.Name();
    const MjcfUse use = mjcf_child(parent, tag);
    if (use == MjcfUse::kRead) return true;
    if (use == MjcfUse::kCut) {
      if (tag != "equality") ++cut_["<" + tag + ">"];  // a default of what is not applied
      if (mjcf_has_row(tag)) check_attributes(child, tag);
    } else if (!is_ignored(tag)) {
      refuse(child,
             "<" + printable(tag) + "> in <" + parent + ">" +
                 (use == MjcfUse::kRefused ? " is not read" : ", " + unknown()),
             tag);
    }
    return false;
  }

  // -------------------------------------------------------------------------------------------------------- sections

  // Unknown sections cannot be about bodies, which would refer to them by words of their own.
  void check_section(const XMLElement& section) {
    const std::string name = section.Name();
    const MjcfUse use = mjcf_child("mujoco", name);
    if (use == MjcfUse::kCut) {
      const std::size_t children = tree_.children(section).size();
      if (name == "equality") {
        equalities_ += children;
      } else {
        cut_["<" + name + ">"] += std::max<std::size_t>(children, 1);
      }
    } else if (use != MjcfUse::kRead) {
      if (!is_ignored(name)) ++unknown_["<" + name + ">"];
    } else if (name == "compiler") {
      check_attributes(section, name);
      for (const XMLElement* child : tree_.children(section)) is_read(*child, name);
    } else if (name == "deformable") {
      for (const XMLElement* child : tree_.children(section)) is_read(*child, name);
    }
  }

  // Masses and inertias have bounds, so that none is refused; of <composite>, whose bodies are libmujoco's.
  Attributes compiler() const {
    Attributes attributes = {
        {"autolimits", "true"}, {"balanceinertia", "true"}, {"boundinertia", "1"}, {"boundmass", "1"}};
    for (const char* name : {"angle", "autolimits", "coordinate", "eulerseq"})
      if (!tree_.setting(name).empty()) attributes[name] = tree_.setting(name);
    if (fitted_ > 0 && !tree_.setting("exactmeshinertia").empty())  // it says nothing of other geoms
      attributes["exactmeshinertia"] = tree_.setting("exactmeshinertia");
    return attributes;
  }

  void read_option(const XMLElement& section) {
    const std::string collision = text_of(section, "collision");  // until MuJoCo 3.0
    if (!collision.empty()) {
      result_.tests_all_pairs = collision != "predefined";
      result_.tests_listed_pairs = collision != "dynamic";
    }
    for (const XMLElement* flag : tree_.children(section)) {
      if (flag->Name() != std::string("flag")) continue;
      if (flag->Attribute("filterparent") != nullptr)
        result_.filters_parents = text_of(*flag, "filterparent") != "disable";
      for (const char* name : {"contact", "constraint"})
        if (text_of(*flag, name) == "disable")
          result_.notes.push_back(std::string("the file disables ") + name + "s: its shapes are tested all the same");
    }
  }

  void list_pairs(const XMLElement& section) {
    for (const XMLElement* child : tree_.children(section))
      if (child->Name() == std::string("pair"))
        for (const char* name : {"geom1", "geom2"})
          if (std::string geom = text_of(*child, name); !geom.empty()) listed_.insert(std::move(geom));
  }

  void write_root_default(const XMLElement& section) {
    write_default(section, "main");
    const std::string name = text_of(section, "class");
    if (!name.empty()) classes_[name] = classes_["main"];
  }

  // A class has what its parent has when it begins, and what it says itself.
  void write_default(const XMLElement& section, const std::string& name) {
    defaults_.open("default", check_attributes(section, "default"), section);
    std::vector<const XMLElement*> nested;
    for (const XMLElement* child : tree_.children(section)) {
      if (!is_read(*child, "default")) continue;
      const std::string tag = child->Name();
      if (tag == "default") {
        nested.push_back(child);
        continue;
      }
      for (const std::string_view key : kClassKeys)
        if (const char* const value = child->Attribute(key.data())) classes_[name][{tag, key}] = value;
      for (const XMLElement* below : tree_.children(*child)) is_read(*below, tag);
      defaults_.element(tag, check_attributes(*child, tag), *child);
    }
    for (const XMLElement* child : nested) {
      const std::string child_name = text_of(*child, "class");
      classes_[child_name] = classes_[name];
      write_default(*child, child_name);
    }
    defaults_.close();
  }

  void write_assets(const XMLElement& section) {
    assets_.open("asset", {}, section);
    for (const XMLElement* child : tree_.children(section)) {
      const std::string tag = child->Name();
      if (mjcf_child("asset", tag) == MjcfUse::kUnknown) {
        if (!is_ignored(tag)) ++unknown_["<" + tag + ">"];
      } else if (is_read(*child, "asset")) {
        tag == "mesh" ? write_mesh(*child) : write_height_field(*child);
      }
    }
    assets_.close();
  }

  // Height fields are left out, so their files are not opened.
  void write_height_field(const XMLElement& element) {
    const std::string name = text_of(element, "name"), file = text_of(element, "file");
    assets_.element("hfield",
                    {{"name", name.empty() ? std::filesystem::path(file).stem().string() : name},
                     {"ncol", "2"},
                     {"nrow", "2"},
                     {"size", text_of(element, "size")}},
                    element);
  }

  // A mesh that no written geom has is not opened.
  void write_mesh(const XMLElement& element) {
    Attributes given = check_attributes(element, "mesh");
    for (const XMLElement* below : tree_.children(element)) is_read(*below, "mesh");
    if (given["name"].empty()) given["name"] = std::filesystem::path(given["file"]).stem().string();
    if (meshes_.count(given["name"]) == 0) {
      ++cut_["<mesh> of no shape"];
      return;
    }
    const std::string_view inertia = value_of(element, "inertia", {});
    if (fitted_meshes_.count(given["name"]) != 0 && !inertia.empty() && inertia != "legacy" && !is_ignored("inertia"))
      refuse(element, "<mesh> has the attribute inertia, which is not read, and a geom is fitted to it", "inertia");
    if (given["file"].empty()) {
      given.erase("file");
    } else {
      const std::string place = tree_.place_of(element) + ": mesh " + printable(given["file"]);
      given["file"] = tree_.mesh_path(element);
      require_mjcf_file(given["file"], place);
      const bool has_own = given.count("vertex") + given.count("face") > 0;  // which libmujoco refuses
      if (!has_own && lower_extension(given["file"]) == ".obj" && has_several_objects(read_text(given["file"], place)))
        take_mesh(given, place);
    }
    assets_.element("mesh", given, element);
  }

  // Puts the vertices and triangles of all objects of a mesh's file in the place of the file.
  void take_mesh(Attributes& given, const std::string& place) {
    std::vector<Vec3> corners;
    const std::vector<Vec3> vertices = read_mesh(given["file"], place, result_.notes, &corners);
    std::vector<double> numbers, indices;
    for (const Vec3& vertex : vertices) numbers.insert(numbers.end(), vertex.begin(), vertex.end());
    for (const Vec3& corner : corners)
      indices.push_back(
          static_cast<double>(std::lower_bound(vertices.begin(), vertices.end(), corner) - vertices.begin()));
    given.erase("file");
    given["vertex"] = written(numbers);
    if (!indices.empty()) given["face"] = written(indices);
  }

  void write_contact(const XMLElement& section) {
    contacts_.open("contact", {}, section);
    for (const XMLElement* child : tree_.children(section)) {
      if (!is_read(*child, "contact")) continue;
      const std::string tag = child->Name();
      bool is_written = true;
      for (const char* key : {"geom1", "geom2", "body1", "body2"}) {
        const std::string name = text_of(*child, key);
        if (repeated_.count(name) == 0) continue;
        if (!is_ignored(tag))
          refuse(*child, "<" + tag + "> names " + printable(name) + ", which a <replicate> repeats", tag);
        is_written = false;
      }
      const Attributes given = check_attributes(*child, tag);
      if (is_written) contacts_.element(tag, given, *child);
    }
    contacts_.close();
  }

  // ---------------------------------------------------------------------------------------------------------- bodies

  void write_world(const XMLElement& section) {
    bodies_.open("worldbody", check_attributes(section, "worldbody"), section);
    write_children(section, "worldbody", {});
    bodies_.close();
  }

  // An attribute of a geom, a joint or a mesh, which its class may give.
  std::string_view value_of(const XMLElement& element, std::string_view key, const Context& context) const {
    if (const char* const own = element.Attribute(key.data())) return own;
    const char* const name = element.Attribute("class");
    const auto values = classes_.find(name != nullptr ? std::string(name) : std::string(context.class_name));
    if (values == classes_.end()) return {};
    const auto value = values->second.find({element.Name(), key});
    return value == values->second.end() ? std::string_view() : value->second;
  }

  bool is_free_joint(const XMLElement& element, const Context& context) const {
    const std::string tag = element.Name();
    return tag == "freejoint" || (tag == "joint" && value_of(element, "type", context) == "free");
  }

  // With global coordinates the frame of a body may be that of its mass.
  bool has_own_masses() const { return tree_.setting("coordinate") == "global"; }

  // A mass of which libmujoco does not ask the meshes.
  void write_mass(const XMLElement& element) {
    if (has_own_masses()) return;
    bodies_.element("inertial", {{"diaginertia", "1 1 1"}, {"mass", "1"}, {"pos", "0 0 0"}}, element);
  }

  void write_children(const XMLElement& parent, const std::string& kind, const Context& context) {
    const bool has_mass = kind == "body" && has_own_masses();
    for (const XMLElement* child : tree_.children(parent)) {
      const std::string tag = child->Name();
      if (!(has_mass && tag == "inertial") && !is_read(*child, kind)) continue;
      Attributes given = check_attributes(*child, tag);
      const auto name = given.find("name");
      if (name != given.end() && !context.suffix.empty()) {
        repeated_.insert(name->second);
        name->second += context.suffix;
      }
      if (tag == "replicate") {
        write_replicate(*child, given, context);
      } else if (tag == "frame" || tag == "body") {
        write_body(*child, given, context);
      } else if (tag == "geom") {
        write_geom(*child, given, context);
      } else if (tag == "composite") {
        write_composite(*child, given);
      } else if (!context.drops_free_joints || !is_free_joint(*child, context)) {
        if (tag == "joint") count_limits(*child, context);
        bodies_.element(tag, given, *child);
      }
    }
  }

  void count_limits(const XMLElement& joint, const Context& context) {
    const std::string_view limited = value_of(joint, "limited", context);
    const bool is_auto = limited.empty() || limited == "auto";
    if (is_auto && !value_of(joint, "range", context).empty() && tree_.setting("autolimits").empty())
      ++limited_by_range_;
  }

  // A frame becomes a body, which MjcfReader takes apart again. So a body in it is no longer directly below the world,
  // where alone libmujoco takes free joints and mocap bodies.
  void write_body(const XMLElement& element, Attributes given, const Context& context) {
    const std::string tag = element.Name();
    Context below = context;
    if (const char* const name = element.Attribute("childclass")) below.class_name = name;
    int flags = 0;
    if (tag == "frame") {
      flags = kMjcfFrame;
    } else {
      const std::vector<const XMLElement*> children = tree_.children(element);
      below.drops_free_joints =
          context.is_top && std::any_of(children.begin(), children.end(),
                                        [&](const XMLElement* child) { return is_free_joint(*child, below); });
      below.is_top = false;
      if (below.drops_free_joints) flags |= kMjcfFreeBody;
      if (given["mocap"] == "true") flags |= kMjcfMocap;
      given.erase("mocap");
    }
    if (flags != 0) given["user"] = std::to_string(flags);
    bodies_.open("body", given, element);
    write_mass(element);
    write_children(element, tag, below);
    bodies_.close();
  }

  // Geoms that are only to look at are left out with their meshes.
  void write_geom(const XMLElement& element, const Attributes& given, const Context& context) {
    for (const XMLElement* below : tree_.children(element)) is_read(*below, "geom");
    const std::string_view type = value_of(element, "type", context), mesh = value_of(element, "mesh", context);
    if (type == "sdf")
      throw ImportError(tree_.place_of(element) + ": a geom of type sdf, the shape of a plugin, is not read");
    if (is_zero(value_of(element, "contype", context)) && is_zero(value_of(element, "conaffinity", context)) &&
        listed_.count(text_of(element, "name")) == 0) {
      ++cut_["<geom> without contact bits"];
      return;
    }
    if (!mesh.empty()) meshes_.emplace(mesh);
    if (!mesh.empty() && type != "mesh") {
      ++fitted_;
      fitted_meshes_.emplace(mesh);
      refuse_fit(element, "fitaabb", tree_.setting("fitaabb"));
      refuse_fit(element, "shellinertia", value_of(element, "shellinertia", context));
    }
    bodies_.element("geom", given, element);
  }

  // By some words libmujoco 2.2.2 fits a geom to a mesh as if this stood elsewhere.
  void refuse_fit(const XMLElement& element, const std::string& word, std::string_view value) {
    if (!value.empty() && value != "false" && !is_ignored(word))
      refuse(element, "a geom is fitted to a mesh by " + word + ", which libmujoco 2.2.2 does wrong", word);
  }

  void write_composite(const XMLElement& element, const Attributes& given) {
    bodies_.open("composite", given, element);
    for (const XMLElement* child : tree_.children(element))
      if (is_read(*child, "composite"))
        bodies_.element(child->Name(), check_attributes(*child, "composite/" + std::string(child->Name())), *child);
    bodies_.close();
  }

  // --------------------------------------------------------------------------------------------------------- repeats

  // Three numbers of an attribute; zeros without it.
  Vec3 three_numbers(const XMLElement& element, const char* name) const {
    const char* const text = element.Attribute(name);
    Vec3 numbers = {0, 0, 0};
    if (text == nullptr) return numbers;
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    std::string rest;
    if (!(in >> numbers[0] >> numbers[1] >> numbers[2]) || in >> rest ||
        !std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::fabs(x) <= kMaxImportValue; }))
      throw ImportError(tree_.place_of(element) + ": <replicate>: " + name + " is not three numbers up to 1e9");
    return numbers;
  }

  // The rotation by angles about the axes of `eulerseq`: small letters turn with the frame, large ones do not.
  Quat turned(const Vec3& angles) const {
    const std::string order = tree_.setting("eulerseq").empty() ? "xyz" : tree_.setting("eulerseq");
    const double unit = tree_.setting("angle") == "radian" ? 1 : kPi / 180;
    Quat rotation = {0, 0, 0, 1};
    for (std::size_t k = 0; k < std::min<std::size_t>(order.size(), 3); ++k) {
      const std::size_t axis = std::string_view("xyzXYZ").find(order[k]);
      if (axis == std::string_view::npos) continue;  // libmujoco refuses it
      Quat turn = {0, 0, 0, std::cos(.5 * unit * angles[k])};
      turn[axis % 3] = std::sin(.5 * unit * angles[k]);
      rotation = axis < 3 ? multiply(rotation, turn) : multiply(turn, rotation);
    }
    return rotation;
  }

  static std::string written(const std::vector<double>& values) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(std::numeric_limits<double>::max_digits10);
    for (const double value : values) out << value << ' ';
    return out.str();
  }

  // Each copy is in a frame of its own, one offset and one rotation further than the one before.
  void write_replicate(const XMLElement& element, const Attributes& given, const Context& context) {
    const Vec3 offset = three_numbers(element, "offset"), euler = three_numbers(element, "euler");
    const std::string count_text = text_of(element, "count");
    if (count_text.empty() || count_text.size() > 6 || is_zero(count_text) ||
        count_text.find_first_not_of("0123456789") != std::string::npos)
      throw ImportError(tree_.place_of(element) + ": <replicate>: count is not a number from 1 to 999999");
    const std::size_t count = std::stoul(count_text), digits = std::to_string(count).size();
    Vec3 position = {0, 0, 0};
    for (std::size_t k = 0; k < count; ++k) {
      count_work(element);
      const Quat q = turned(static_cast<double>(k) * euler);
      Attributes frame = {{"pos", written({position[0], position[1], position[2]})},
                          {"quat", written({q[3], q[0], q[1], q[2]})},
                          {"user", std::to_string(kMjcfFrame)}};
      Context below = context;
      const auto childclass = given.find("childclass");
      if (childclass != given.end()) frame.insert(*childclass), below.class_name = childclass->second;
      const std::string number = std::to_string(k);
      below.suffix = text_of(element, "sep") + std::string(digits - number.size(), '0') + number + context.suffix;
      bodies_.open("body", frame, element);
      write_mass(element);
      write_children(element, "replicate", below);
      bodies_.close();
      position = position + rotate(q, offset);
    }
  }

  // ----------------------------------------------------------------------------------------------------------- notes

  static std::string listed_words(const Counts& words) {
    constexpr std::size_t kMostBytes = 40;
    std::string text;
    for (const auto& [word, count] : words)
      text += (text.empty() ? "" : ", ") + printable(word.substr(0, kMostBytes)) + " " + std::to_string(count);
    return text;
  }

  void add_notes() {
    std::vector<std::string>& notes = result_.notes;
    if (!cut_.empty())
      notes.push_back(brief("not read, since it says nothing of shapes, joints and masks: " + listed_words(cut_)));
    if (!unknown_.empty()) notes.push_back(brief("not known, and not about bodies: " + listed_words(unknown_)));
    for (const std::string& word : options_.ignored_words) ignored_[word];  // also those that were not met
    if (!ignored_.empty()) notes.push_back(brief("passed over by --ignore: " + listed_words(ignored_)));
    if (limited_by_range_ > 0)
      notes.push_back(std::to_string(limited_by_range_) +
                      " joints are limited by their range alone, as MuJoCo 3 reads them (autolimits)");
    if (fitted_ > 0) notes.push_back(std::to_string(fitted_) + " geoms are fitted to meshes, as libmujoco fits them");
    if (whole_hulls_ > 0)
      notes.push_back("maxhullvert is not applied, meshes have their whole hulls: " + std::to_string(whole_hulls_));
    if (equalities_ > 0) notes.push_back("equality constraints are not applied: " + std::to_string(equalities_));
  }

  const RobotOptions& options_;
  MjcfTree tree_;
  MjcfText result_;
  MjcfLines defaults_, assets_, bodies_, contacts_;
  // Of each class: the attributes of kClassKeys by element and name. The values are in the files.
  std::map<std::string, std::map<std::pair<std::string, std::string_view>, std::string_view>> classes_;
  std::set<std::string> listed_;               // names of geoms in a <pair>
  std::set<std::string> repeated_;             // names inside a <replicate>, as written
  std::set<std::string, std::less<>> meshes_;  // names of those that written geoms have
  std::set<std::string> fitted_meshes_;        // names of those that written geoms are fitted to
  Counts cut_, unknown_, ignored_;
  std::size_t limited_by_range_ = 0, fitted_ = 0, equalities_ = 0, whole_hulls_ = 0, work_ = 0;
};

}  // namespace

MjcfText mjcf_text(const XmlText& text, const RobotOptions& options) { return MjcfWriter(text, options).write(); }

}  // namespace cab::scenes
