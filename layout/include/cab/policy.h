// Policies: every knob that trades speed for accuracy, and the one table of their names.
#pragma once

#include <cab/span.h>

#include <cstdint>

// What a shared libcab exports.
#define CAB_API __attribute__((visibility("default")))

namespace cab {

enum class Refit : std::uint8_t {
  kCab,               // the paper's merge of two oriented boxes at a joint
  kCabSum,            // its footnote's variant: the sum of the major axes where their ends are closest
  kCovariance,        // the paper's OBB: principal axes of the children's corners
  kCovarianceLeaves,  // principal axes of the corners of all leaf boxes below
  kBest3,             // of kCab's axes and both children's, those that make the box of least surface
  kAabbHull,          // the paper's AABB*: axis-aligned boxes of the leaf boxes at every level, leaves included
  kAabbVertices,      // the paper's AABB+: axis-aligned boxes of all vertices below, leaves included
};

enum class Extents : std::uint8_t {
  kChildren,  // a box is made as large as its two children need
  kLeaves,    // a box is made as large as the leaf boxes below need
};

enum class Strategy : std::uint8_t {
  kTree,      // simultaneous descent of two hierarchies
  kRows,      // each leaf's bounds against all of the other's, then the boxes of those that overlap; frames: as kBrute
  kLinks,     // links first: boxes about all leaves of a link by rows, then the leaves of links whose boxes overlap
  kBrute,     // every leaf of one against every leaf of the other
  kExactAll,  // no boxes: every leaf pair goes to the exact test (with Exact::kNone every pair is reported)
  kAuto,      // characters: rows, links or tree by leaves and links; frames: brute or tree by leaf pairs and nodes
};

// Crossovers of kAuto (docs/policies.md). Up to this many links with leaves an articulation is paired faster by rows than
// by its tree; fewer where the links are one chain.
inline constexpr std::uint32_t kRowsMaxLeaves = 64;
inline constexpr std::uint32_t kRowsMaxLeavesOfChain = 47;

// From this many leaves on an articulation that has several on some link is paired faster by links than by rows.
inline constexpr std::uint32_t kLinksMinLeaves = 49;

enum class Exact : std::uint8_t {
  kNone,  // overlapping leaf boxes are the answer
  kFcl,   // overlapping leaf boxes are confirmed by FCL on the leaves' exact shapes
};

// Which axes may show that two oriented boxes are apart, inner ones and leaves. Fewer axes let more pairs pass.
enum class Sat : std::uint8_t {
  kAll15,   // the six faces and the nine pairs of edges
  kFaces6,  // the six faces
};

// Every combination is valid and conservative.
struct Policies {
  Refit refit = Refit::kCab;
  Strategy strategy = Strategy::kAuto;
  Exact exact = Exact::kNone;
  Extents extents = Extents::kChildren;
  Sat sat = Sat::kAll15;
};

// One value of a policy field: its name on the command line and in files, and what it does.
struct PolicyValue {
  const char* name;
  const char* meaning;
};

// One row of the table of policies, in the order of the fields of Policies.
struct PolicyField {
  const char* name;
  const char* meaning;
  const PolicyValue* values;
  std::uint32_t value_count;
};

// The one table of policies that API, command line, files, tests and documents share.
CAB_API Span<const PolicyField> policy_table() noexcept;

// Reads and writes a field of Policies by its row of the table; set returns false for a name that is no value.
CAB_API std::uint32_t policy_get(const Policies& policies, std::uint32_t field) noexcept;
CAB_API bool policy_set(Policies& policies, std::uint32_t field, const char* value_name) noexcept;

// All policies chosen at once, by a name. Presets say how boxes are made and tested; `exact`, which is what is asked, is
// kNone in all of them.
struct PolicyPreset {
  const char* name;
  const char* meaning;
  Policies policies;
};

// The one table of presets.
CAB_API Span<const PolicyPreset> preset_table() noexcept;

// Sets every field to a preset's; false for a name that is none, and nothing is changed.
CAB_API bool preset_set(Policies& policies, const char* preset_name) noexcept;

}  // namespace cab
