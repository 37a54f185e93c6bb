// Policies: every choice between speed and accuracy, and the one table of their names and meanings.
//
// No policy loses a pair of links that touch. Most policies change how fast the answer comes; some also change how many
// pairs that are apart are reported with the others. docs/policies.md has the figures.
//
// Every function below takes well under a microsecond, allocates nothing, and reads and writes only its arguments and
// constant tables. Any thread may call it at any time.
#pragma once

#include <cab/api.h>
#include <cab/span.h>

#include <cstdint>

namespace cab {

// How inner boxes are made in each frame. The comments of the values are their meanings in policy_table(), word for
// word; so are those of the enumerations below. From kCabSum on they are the paper's others, for comparison: no
// measured scene with the same hits favours one of them. Refits of oriented boxes come first.
enum class Refit : std::uint8_t {
  kCab,           // the paper's CAB: oriented boxes along the main axis of two jointed children
  kBest3,         // of three oriented boxes, along the axes of cab and of each child, the one of least surface
  kCabSum,        // the paper's footnote: as cab, but along the sum of both major axes where their ends are closest
  kCovariance,    // the paper's OBB: oriented boxes along the principal axes of the children's corners
  kAabbHull,      // the paper's AABB*: axis-aligned boxes about the leaf boxes, leaves included
  kAabbVertices,  // the paper's AABB+: axis-aligned boxes about all vertices below, leaves included
};

// How an inner box is sized along its axes.
enum class Extents : std::uint8_t {
  kChildren,  // an inner box is as large as its two children need
  kLeaves,    // an inner box is as large as the leaf boxes below it need
};

// How overlapping leaf pairs are found. For characters, kLinks becomes kRows where the refit makes axis-aligned boxes,
// and in batches whose articulation has a skin, or no link with several leaves.
enum class Strategy : std::uint8_t {
  kTree,   // simultaneous descent of two hierarchies
  kRows,   // each leaf's bounds against all leaf bounds of the other, then boxes; sequences: as brute
  kLinks,  // boxes of links by rows, then the leaves of those that overlap; sequences: as tree
  kBrute,  // every leaf of one against every leaf of the other
  kAuto,   // characters: rows, links or tree by leaves and links; sequences: brute or tree by leaf pairs and nodes
};

// What confirms an overlapping leaf pair.
enum class Exact : std::uint8_t {
  kNone,     // overlapping leaf boxes are the answer
  kFcl,      // FCL tests the exact shapes of leaves whose boxes overlap
  kConvex,   // kernels test the exact shapes of leaves whose boxes overlap, sixteen pairs at a time
  kSurface,  // as convex, and of leaves with triangles these are tested
};

// Which axes can separate two oriented boxes, inner ones and leaves. Axis-aligned boxes have three axes in either case.
enum class Sat : std::uint8_t {
  kAll15,   // the six face normals and the nine cross products of edges
  kFaces6,  // the six face normals: less time per test, but more pairs pass
};

// How many values each enumeration has.
inline constexpr std::uint32_t kRefitCount = 6;
inline constexpr std::uint32_t kExtentsCount = 2;
inline constexpr std::uint32_t kStrategyCount = 5;
inline constexpr std::uint32_t kExactCount = 4;
inline constexpr std::uint32_t kSatCount = 2;

// The policies of a frame. Every combination is valid and conservative; the defaults are the preset `balanced`.
struct Policies {
  Refit refit = Refit::kCab;             // how inner boxes are made, and whether leaf boxes are axis-aligned too
  Strategy strategy = Strategy::kAuto;   // how overlapping leaf pairs are found
  Exact exact = Exact::kNone;            // what confirms an overlapping leaf pair
  Extents extents = Extents::kChildren;  // what inner boxes contain
  Sat sat = Sat::kAll15;                 // which axes can separate two oriented boxes
};

// One value of a field of Policies. The strings live as long as the program.
struct PolicyValue {
  std::uint8_t value;   // the enumerator as a number, which is also its index in PolicyField::values
  const char* name;     // on the command line and in files, such as "cab_sum"
  const char* meaning;  // what the value does, in one phrase
};

// One field of Policies: a row of the table of policies. All of it lives as long as the program.
struct PolicyField {
  const char* name;           // the field's name in Policies
  const char* meaning;        // what the field decides, in one phrase
  const PolicyValue* values;  // value_count of them, in the order of the enumeration
  std::uint32_t value_count;  // how many values the enumeration has
  std::uint32_t use_count;    // how many of them, from the first on, are for use; the rest is for comparison
};

// The one table of policies, one row per field of Policies in the order of its fields. The library, the command line,
// files, tests and documents share it.
CAB_API Span<const PolicyField> policy_table() noexcept;

// The value of the field whose row in policy_table() is `field`, as a number; 0 if the table has no such row.
CAB_API std::uint32_t policy_get(const Policies& policies, std::uint32_t field) noexcept;

// Sets the field whose row in policy_table() is `field` to the value with this name. Returns false and changes nothing
// if the table has no such row, if the row has no such value, or if the name is null.
CAB_API bool policy_set(Policies& policies, std::uint32_t field, const char* value_name) noexcept;

// Values for all policies under one name. A preset says how boxes are made and tested. Whether hits are confirmed is
// the caller's choice, so `exact` is kNone in all presets. The strings live as long as the program.
struct PolicyPreset {
  const char* name;     // on the command line and for preset_set, such as "tight"
  const char* meaning;  // what the preset is for, in one phrase
  Policies policies;    // the value of every field
};

// The one table of presets. preset_set, the command line and the documents share it.
CAB_API Span<const PolicyPreset> preset_table() noexcept;

// Sets every field to its value in the preset with this name. Returns false and changes nothing if there is no such
// preset, or if the name is null.
CAB_API bool preset_set(Policies& policies, const char* preset_name) noexcept;

}  // namespace cab
