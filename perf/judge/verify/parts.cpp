#include "perf/judge/verify/parts.h"

#include <algorithm>
#include <tuple>

#include "engine/step/instance_batch.h"
#include "perf/base/option_values.h"
#include "perf/base/report.h"
#include "perf/harness/world.h"

namespace cab::perf {
namespace {

// The most findings that one task keeps. Further ones add nothing.
constexpr std::size_t kFindingsKept = 2;

template <class Enumeration>
std::vector<Enumeration> values_of(const std::string& field) {
  std::vector<Enumeration> out;
  for (std::uint32_t v = 0; v < policy_table()[policy_row(field)].value_count; ++v)
    out.push_back(static_cast<Enumeration>(v));
  return out;
}

std::string list_of(const float* numbers, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += (i == 0 ? "(" : " ") + shortest(numbers[i]);
  return out + ")";
}

}  // namespace

void Tally::add(const Tally& other) {
  for (const NamedCount& each : kCounts) this->*each.count += other.*each.count;
  for (const NamedValue& each : kMaxima) this->*each.value = std::max(this->*each.value, other.*each.value);
  if (std::tie(share, rounding, padding) < std::tie(other.share, other.rounding, other.padding))
    std::tie(share, rounding, padding) = std::tie(other.share, other.rounding, other.padding);
}

void Task::violation(std::size_t method, const std::string& input) {
  ++tallies[method].violations;
  if (findings.size() < kFindingsKept) findings.push_back(input);
}

const std::vector<VerifyPart>& verify_parts() {
  // The inputs of a part depend on its place, so new ones come last.
  static const std::vector<VerifyPart> parts = {
      merges_part(),  overlaps_part(), trees_part(),   frames_part(), shapes_part(),   queries_part(),
      rays_part(),    motions_part(),  spheres_part(), points_part(), boxes_part(),    capsules_part(),
      regions_part(), surfaces_part(), round_part(),   depths_part(), triangles_part()};
  return parts;
}

const std::vector<const kernel::KernelTable*>& all_kernels() {
  static const std::vector<const kernel::KernelTable*> all = [] {
    std::vector<const kernel::KernelTable*> out;
    for (const Isa isa : oracle::available_isas()) out.push_back(kernel::find_kernels(isa));
    return out;
  }();
  return all;
}

std::vector<RefitMethod> refit_methods(std::uint32_t refit_count) {
  std::vector<RefitMethod> out;
  for (const Refit refit : values_of<Refit>("refit")) {
    if (static_cast<std::uint32_t>(refit) >= refit_count) continue;
    for (const Extents extents : values_of<Extents>("extents")) {
      const Policies policies = {refit, Strategy::kTree, Exact::kNone, extents};
      out.push_back({policy_value(policies, "refit") + ", " + policy_value(policies, "extents"), policies});
    }
  }
  return out;
}

std::vector<RefitMethod> sat_methods() {
  std::vector<RefitMethod> out;
  for (const Sat sat : values_of<Sat>("sat")) {
    Policies policies;
    policies.sat = sat;
    out.push_back({policy_value(policies, "sat"), policies});
  }
  return out;
}

std::vector<RefitMethod> frame_methods() {
  std::vector<RefitMethod> out;
  for (const Refit refit : values_of<Refit>("refit")) {
    for (const Strategy strategy : values_of<Strategy>("strategy")) {
      for (const Extents extents : values_of<Extents>("extents")) {
        const bool descends = strategy != Strategy::kBrute;
        const Policies policies = {refit, strategy, Exact::kNone, extents};
        if (!descends && extents != Extents::kChildren) continue;
        std::string name = policy_value(policies, "strategy") + ", " + policy_value(policies, "refit");
        if (descends) name += ", " + policy_value(policies, "extents");
        out.push_back({name, policies});
        if (is_axis_aligned(refit) || extents != Extents::kChildren) continue;
        for (const RefitMethod& sat : sat_methods()) {
          if (sat.policies.sat == Sat::kAll15) continue;
          Policies fewer = policies;
          fewer.sat = sat.policies.sat;
          out.push_back({name + ", " + sat.name, fewer});
        }
      }
    }
  }
  return out;
}

std::vector<std::string> names_of(const std::vector<RefitMethod>& methods) {
  std::vector<std::string> out;
  for (const RefitMethod& method : methods) out.push_back(method.name);
  return out;
}

std::string to_text(const oracle::OracleBox<float>& box) {
  const auto three = [](const float(&v)[3]) {
    return "(" + shortest(v[0]) + " " + shortest(v[1]) + " " + shortest(v[2]) + ")";
  };
  return "center " + three(box.center) + " axes " + three(box.axis[0]) + three(box.axis[1]) + three(box.axis[2]) +
         " half " + three(box.half);
}

std::vector<std::string> convex_regimes() {
  return {"regular", "thin",  "unequal", "near",   "concentric", "aligned",
          "far",     "units", "needles", "plates", "nested",     "equal"};
}

const char* name_of(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kBox: return "box";
    case ShapeKind::kEllipsoid: return "ellipsoid";
    case ShapeKind::kCapsule: return "capsule";
    case ShapeKind::kConvexHull: return "hull";
    case ShapeKind::kSphere: return "sphere";
    case ShapeKind::kCylinder: return "cylinder";
    case ShapeKind::kHalfSpace: return "half space";
  }
  return "";
}

std::string to_text(const oracle::PosedPart& posed) {
  const ConvexPart& part = posed.part;
  return std::string(name_of(part.kind)) + " size " + list_of(part.size, 3) + " position " + list_of(part.position, 3) +
         " rotation " + list_of(part.rotation, 4) + " pose " + list_of(posed.pose, 7) + ", " +
         std::to_string(posed.vertices.size() / 3) + " vertices";
}

}  // namespace cab::perf
