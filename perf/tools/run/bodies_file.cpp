// The bodies of a figure as a JSON file and as a table.
#include "perf/tools/run/bodies_file.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "perf/base/report.h"
#include "scenes/import/in_child.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"
#include "scenes/sandbox/payload.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;
using scenes::BodyReason;
using scenes::SkeletonBody;

constexpr double kMaxMetres = 1e9;
constexpr const char* kNoBody = "none";
constexpr std::array<std::pair<const char*, ShapeKind>, 5> kShapes = {{{"ellipsoid", ShapeKind::kEllipsoid},
                                                                       {"capsule", ShapeKind::kCapsule},
                                                                       {"cylinder", ShapeKind::kCylinder},
                                                                       {"sphere", ShapeKind::kSphere},
                                                                       {"box", ShapeKind::kBox}}};

const char* shape_of(const SkeletonBody& body) {
  if (!body.is_solid) return kNoBody;
  const auto* const found =
      std::find_if(kShapes.begin(), kShapes.end(), [&](const auto& shape) { return shape.second == body.kind; });
  return found->first;
}

const char* reason_of(const SkeletonBody& body) {
  switch (body.reason) {
    case BodyReason::kBone: return "bone";
    case BodyReason::kCap: return "cap";
    case BodyReason::kBall: return "ball";
    case BodyReason::kTravels: return "its end moves";
    case BodyReason::kOutside: break;
  }
  return "outside the body";
}

std::string end_of(const scenes::Skeleton& skeleton, const SkeletonBody& body) {
  return body.end < 0 ? scenes::kNoEnd : skeleton.joint_names[static_cast<std::size_t>(body.end)];
}

// A length above 0 of an entry.
double length_of(const Json& value, const std::string& where) {
  const double length = value.is_number() ? value.get<double>() : 0;
  if (!(length > 0 && length <= kMaxMetres)) throw scenes::ImportError(where + ": lengths are metres above 0");
  return length;
}

scenes::BodyChange read_change(const Json& entry, const std::string& where) {
  const auto fail = [&where](const std::string& reason) { throw scenes::ImportError(where + ": " + reason); };
  if (!entry.is_object()) fail("a body is an object with link, to and shape");
  scenes::BodyChange change;
  std::string shape;
  for (const auto& [key, value] : entry.items()) {
    if (key == "link" || key == "to" || key == "shape") {
      if (!value.is_string()) fail(key + " is a text");
      (key == "link" ? change.link : key == "to" ? change.to : shape) = value.get<std::string>();
    } else if (key == "half_metres") {
      if (!value.is_array() || value.size() != 3) fail("half_metres is a list of three lengths");
      change.half.emplace();
      for (std::size_t k = 0; k < 3; ++k) (*change.half)[k] = length_of(value[k], where);
    } else if (key == "radius_metres") {
      change.radius = length_of(value, where);
    } else if (key != "reason" && key != "part") {
      fail("unknown key " + scenes::printable(key) +
           "; there are link, to, shape, half_metres, radius_metres, reason and part");
    }
  }
  if (change.link.empty() || change.to.empty() || shape.empty()) fail("link, to and shape are needed");
  change.is_solid = shape != kNoBody;
  const auto* const found =
      std::find_if(kShapes.begin(), kShapes.end(), [&](const auto& known) { return known.first == shape; });
  if (change.is_solid && found == kShapes.end())
    fail("unknown shape " + scenes::printable(shape) +
         "; there are ellipsoid, capsule, cylinder, sphere, box and none");
  if (change.is_solid) change.kind = found->second;
  return change;
}

std::vector<scenes::BodyChange> read_here(const std::string& path) {
  const std::string name = scenes::printable(path);
  const std::string text = scenes::read_bytes(path, name, scenes::check_file(path, name));
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw scenes::ImportError(name + ": it is not JSON");
  if (!json.is_object() || !json.contains("bodies") || !json["bodies"].is_array())
    throw scenes::ImportError(name + ": it has no list \"bodies\"");
  std::vector<scenes::BodyChange> changes;
  for (const Json& entry : json["bodies"])
    changes.push_back(read_change(entry, name + ": body " + std::to_string(changes.size() + 1)));
  return changes;
}

// The structured bindings name every field, so that a new field does not compile until it is written and read here.
std::string payload_of(const std::vector<scenes::BodyChange>& changes) {
  scenes::PayloadWriter writer;
  writer.value(std::uint64_t{changes.size()});
  for (const auto& [link, to, is_solid, kind, half, radius] : changes) {
    writer.text(link);
    writer.text(to);
    writer.value(is_solid);
    writer.value(kind);
    writer.array(half ? std::vector<double>(half->begin(), half->end()) : std::vector<double>());
    writer.array(radius ? std::vector<double>{*radius} : std::vector<double>());
  }
  return writer.take();
}

std::vector<scenes::BodyChange> read_payload(const std::string& bytes) {
  scenes::PayloadReader reader(bytes);
  constexpr std::size_t kLeastChangeBytes = 4 * sizeof(std::uint64_t) + 2;
  std::vector<scenes::BodyChange> changes(reader.count(kLeastChangeBytes));
  for (auto& [link, to, is_solid, kind, half, radius] : changes) {
    link = scenes::printable(reader.text());
    to = scenes::printable(reader.text());
    is_solid = reader.value<std::uint8_t>() != 0;
    kind = static_cast<ShapeKind>(reader.value<std::uint8_t>());
    scenes::require_payload(std::any_of(kShapes.begin(), kShapes.end(), [k = kind](auto& s) { return s.second == k; }),
                            "a body has no shape that it may have");
    const std::vector<double> halves = reader.array<double>(), radii = reader.array<double>();
    const auto is_length = [](double length) { return length > 0 && length <= kMaxMetres; };
    scenes::require_payload((halves.empty() || halves.size() == 3) && radii.size() <= 1 &&
                                std::all_of(halves.begin(), halves.end(), is_length) &&
                                std::all_of(radii.begin(), radii.end(), is_length),
                            "a body has no lengths that it may have");
    if (!halves.empty()) half = {halves[0], halves[1], halves[2]};
    if (!radii.empty()) radius = radii[0];
  }
  reader.finish();
  return changes;
}

}  // namespace

std::vector<scenes::BodyChange> read_bodies(const std::string& path,
                                            const std::optional<scenes::SandboxLimits>& sandbox) {
  if (!sandbox) return read_here(path);
  return scenes::from_child(
      path, *sandbox, [&] { return payload_of(read_here(path)); }, read_payload);
}

Json bodies_json(const scenes::Skeleton& skeleton, const scenes::SkeletonBodies& bodies) {
  Json list = Json::array();
  for (const SkeletonBody& body : bodies.bodies) {
    Json entry = {{"link", skeleton.joint_names[body.joint]},
                  {"to", end_of(skeleton, body)},
                  {"reason", reason_of(body)},
                  {"part", scenes::to_string(body.part)},
                  {"shape", shape_of(body)}};
    if (body.is_solid) entry["half_metres"] = body.half;
    list.push_back(std::move(entry));
  }
  return {{"stature_metres", bodies.stature.value},
          {"stature_source", scenes::to_string(bodies.stature.source)},
          {"bodies", std::move(list)}};
}

void print_bodies(const scenes::Skeleton& skeleton, const scenes::SkeletonBodies& bodies, std::ostream& out) {
  out << "stature " << fixed(bodies.stature.value, 2) << " m, " << scenes::to_string(bodies.stature.source) << '\n';
  TextTable table;
  table.add_row({"link", "to", "reason", "part", "shape", "length cm", "width cm", "depth cm", "moves cm"});
  const auto centimetres = [](double metres) { return fixed(100 * metres, 1); };
  for (const SkeletonBody& body : bodies.bodies) {
    std::vector<std::string> row = {skeleton.joint_names[body.joint], end_of(skeleton, body), reason_of(body),
                                    scenes::to_string(body.part), shape_of(body)};
    for (const double half : body.half) row.push_back(body.is_solid ? centimetres(2 * half) : "");
    row.push_back(body.strays > 0 ? centimetres(body.strays) : "");
    table.add_row(std::move(row));
  }
  table.print(out);
}

}  // namespace cab::perf
