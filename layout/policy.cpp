#include <cab/policy.h>

#include <cstring>

namespace cab {
namespace {

// Values are listed in the order of their enumerations.
constexpr PolicyValue kRefitValues[] = {
    {"cab", "the paper's merge: oriented boxes along the major axis of two jointed children"},
    {"cab_sum", "the footnote's variant: along the sum of the major axes where their ends are closest"},
    {"covariance", "the paper's OBB: oriented boxes along the principal axes of the children's corners"},
    {"covariance_leaves", "oriented boxes along the principal axes of the corners of all leaf boxes below"},
    {"best3", "of the boxes along the axes of cab and of each child, the one with the least surface"},
    {"aabb_hull", "the paper's AABB*: axis-aligned boxes of the leaf boxes at every level, leaves included"},
    {"aabb_vertices", "the paper's AABB+: axis-aligned boxes of all vertices below at every level, leaves included"},
};
constexpr PolicyValue kExtentsValues[] = {
    {"children", "a box is as large as its two children need"},
    {"leaves", "a box is as large as the leaf boxes below it need"},
};
constexpr PolicyValue kStrategyValues[] = {
    {"tree", "simultaneous descent of two hierarchies"},
    {"rows",
     "each leaf's bounds against all of the other's at once, then the boxes of those that overlap; frames: brute"},
    {"links", "the boxes of links by rows, then the leaves of those that overlap; one leaf a link: rows; frames: tree"},
    {"brute", "every leaf of one against every leaf of the other"},
    {"exact_all", "no boxes: every leaf pair goes to the exact test"},
    {"auto", "characters: rows, links or tree by leaves and links; frames: brute or tree by leaf pairs and nodes"},
};
constexpr PolicyValue kExactValues[] = {
    {"none", "overlapping leaf boxes are the answer"},
    {"fcl", "overlapping leaf boxes are confirmed by FCL on the exact shapes"},
};
constexpr PolicyValue kSatValues[] = {
    {"all_15", "the six faces and the nine pairs of edges"},
    {"faces_6", "the six faces: less time for each test, but more pairs pass"},
};

template <std::size_t N>
constexpr PolicyField field(const char* name, const char* meaning, const PolicyValue (&values)[N]) {
  return {name, meaning, values, N};
}

// Rows are listed in the order of the fields of Policies.
constexpr PolicyField kTable[] = {
    field("refit", "how inner boxes follow their children", kRefitValues),
    field("strategy", "how overlapping leaf pairs are found", kStrategyValues),
    field("exact", "what confirms an overlapping leaf pair", kExactValues),
    field("extents", "what an inner box is made to contain", kExtentsValues),
    field("sat", "which axes may show that two oriented boxes are apart", kSatValues),
};

// docs/policies.md has the figures behind them.
constexpr PolicyPreset kPresets[] = {
    {"paper",
     "what the paper's CAB does before its exact queries: trees of cab, all fifteen axes",
     {Refit::kCab, Strategy::kTree, Exact::kNone, Extents::kChildren, Sat::kAll15}},
    {"fast",
     "the least time where some more false positives are fine",
     {Refit::kCab, Strategy::kAuto, Exact::kNone, Extents::kChildren, Sat::kFaces6}},
    {"balanced", "the defaults: the sharpest answer in the least time", {}},
    {"tight",
     "the fewest box tests: inner boxes nearly as small as they can be, for more time to make them",
     {Refit::kBest3, Strategy::kAuto, Exact::kNone, Extents::kLeaves, Sat::kAll15}},
};

std::uint8_t* value_of(Policies& policies, std::uint32_t row) {
  switch (row) {
    case 0: return reinterpret_cast<std::uint8_t*>(&policies.refit);
    case 1: return reinterpret_cast<std::uint8_t*>(&policies.strategy);
    case 2: return reinterpret_cast<std::uint8_t*>(&policies.exact);
    case 3: return reinterpret_cast<std::uint8_t*>(&policies.extents);
    default: return reinterpret_cast<std::uint8_t*>(&policies.sat);
  }
}

}  // namespace

Span<const PolicyField> policy_table() noexcept { return {kTable, sizeof(kTable) / sizeof(kTable[0])}; }

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

std::uint32_t policy_get(const Policies& policies, std::uint32_t row) noexcept {
  Policies copy = policies;
  return *value_of(copy, row);
}

bool policy_set(Policies& policies, std::uint32_t row, const char* value_name) noexcept {
  if (row >= policy_table().size || !value_name) return false;
  for (std::uint32_t value = 0; value < kTable[row].value_count; ++value) {
    if (std::strcmp(kTable[row].values[value].name, value_name) != 0) continue;
    *value_of(policies, row) = static_cast<std::uint8_t>(value);
    return true;
  }
  return false;
}

}  // namespace cab
