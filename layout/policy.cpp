#include <cab/policy.h>

#include <cstring>

namespace cab {
namespace {

// One value of a policy: its enumerator, name and meaning. A row of a table.
template <class Enum>
constexpr PolicyValue row(Enum value, const char* name, const char* meaning) {
  return {static_cast<std::uint8_t>(value), name, meaning};
}

// Whether the rows stand in the order of their enumeration, each value once.
template <std::size_t N>
constexpr bool lists_all(const PolicyValue (&values)[N], std::uint32_t count) {
  for (std::size_t i = 0; i < N; ++i)
    if (values[i].value != i) return false;
  return N == count;
}

// The meanings are copied word for word to the enumerators of cab/policy.h and to docs/policies.md; tests compare them.
constexpr PolicyValue kRefitValues[] = {
    row(Refit::kCab, "cab", "the paper's CAB: oriented boxes along the main axis of two jointed children"),
    row(Refit::kBest3, "best3",
        "of three oriented boxes, along the axes of cab and of each child, the one of least surface"),
    row(Refit::kCabSum, "cab_sum",
        "the paper's footnote: as cab, but along the sum of both major axes where their ends are closest"),
    row(Refit::kCovariance, "covariance",
        "the paper's OBB: oriented boxes along the principal axes of the children's corners"),
    row(Refit::kAabbHull, "aabb_hull", "the paper's AABB*: axis-aligned boxes about the leaf boxes, leaves included"),
    row(Refit::kAabbVertices, "aabb_vertices",
        "the paper's AABB+: axis-aligned boxes about all vertices below, leaves included"),
};
static_assert(lists_all(kRefitValues, kRefitCount));
constexpr PolicyValue kExtentsValues[] = {
    row(Extents::kChildren, "children", "an inner box is as large as its two children need"),
    row(Extents::kLeaves, "leaves", "an inner box is as large as the leaf boxes below it need"),
};
static_assert(lists_all(kExtentsValues, kExtentsCount));
constexpr PolicyValue kStrategyValues[] = {
    row(Strategy::kTree, "tree", "simultaneous descent of two hierarchies"),
    row(Strategy::kRows, "rows",
        "each leaf's bounds against all leaf bounds of the other, then boxes; sequences: as brute"),
    row(Strategy::kLinks, "links", "boxes of links by rows, then the leaves of those that overlap; sequences: as tree"),
    row(Strategy::kBrute, "brute", "every leaf of one against every leaf of the other"),
    row(Strategy::kAuto, "auto",
        "characters: rows, links or tree by leaves and links; sequences: brute or tree by leaf pairs and nodes"),
};
static_assert(lists_all(kStrategyValues, kStrategyCount));
constexpr PolicyValue kExactValues[] = {
    row(Exact::kNone, "none", "overlapping leaf boxes are the answer"),
    row(Exact::kFcl, "fcl", "FCL tests the exact shapes of leaves whose boxes overlap"),
    row(Exact::kConvex, "convex",
        "kernels test the exact shapes of leaves whose boxes overlap, sixteen pairs at a time"),
    row(Exact::kSurface, "surface", "as convex, and of leaves with triangles these are tested"),
};
static_assert(lists_all(kExactValues, kExactCount));
constexpr PolicyValue kSatValues[] = {
    row(Sat::kAll15, "all_15", "the six face normals and the nine cross products of edges"),
    row(Sat::kFaces6, "faces_6", "the six face normals: less time per test, but more pairs pass"),
};
static_assert(lists_all(kSatValues, kSatCount));

template <std::size_t N>
constexpr PolicyField field(const char* name, const char* meaning, const PolicyValue (&values)[N],
                            std::uint32_t use_count = N) {
  return {name, meaning, values, N, use_count};
}

// Rows are listed in the order of the fields of Policies. Each field is one byte, so the index of a row is the offset
// of its field.
constexpr PolicyField kTable[] = {
    field("refit", "how inner boxes are made in each frame", kRefitValues, static_cast<std::uint32_t>(Refit::kCabSum)),
    field("strategy", "how overlapping leaf pairs are found", kStrategyValues),
    field("exact", "what confirms an overlapping leaf pair", kExactValues),
    field("extents", "what an inner box contains", kExtentsValues),
    field("sat", "which axes can separate two oriented boxes", kSatValues),
};
constexpr std::size_t kFieldCount = sizeof(kTable) / sizeof(kTable[0]);
static_assert(sizeof(Policies) == kFieldCount);

// docs/policies.md has the figures behind them.
constexpr PolicyPreset kPresets[] = {
    {"paper",
     "what the paper's CAB does before its exact queries: trees of cab, all fifteen axes",
     {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kChildren, Sat::kAll15}},
    {"balanced", "the defaults: the sharpest answer in the least time", {}},
    {"tight",
     "the fewest box tests: tighter boxes, at about twice the cost for sequences",
     {Refit::kBest3, Strategy::kAuto, Exact::kNone, Extents::kLeaves, Sat::kAll15}},
};

}  // namespace

Span<const PolicyField> policy_table() noexcept { return {kTable, kFieldCount}; }

Span<const PolicyPreset> preset_table() noexcept { return {kPresets, sizeof(kPresets) / sizeof(kPresets[0])}; }

bool preset_set(Policies& policies, const char* preset_name) noexcept {
  if (!preset_name) return false;
  for (const PolicyPreset& preset : kPresets) {
    if (std::strcmp(preset.name, preset_name) != 0) continue;
    policies = preset.policies;
    return true;
  }
  return false;
}

std::uint32_t policy_get(const Policies& policies, std::uint32_t field) noexcept {
  return field < kFieldCount ? reinterpret_cast<const std::uint8_t*>(&policies)[field] : 0;
}

bool policy_set(Policies& policies, std::uint32_t field, const char* value_name) noexcept {
  if (field >= kFieldCount || !value_name) return false;
  for (std::uint32_t i = 0; i < kTable[field].value_count; ++i) {
    const PolicyValue& value = kTable[field].values[i];
    if (std::strcmp(value.name, value_name) != 0) continue;
    reinterpret_cast<std::uint8_t*>(&policies)[field] = value.value;
    return true;
  }
  return false;
}

}  // namespace cab
