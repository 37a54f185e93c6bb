// The allowed-collision matrix of a robot: which pairs of links are not tested against each other, and why.
#pragma once

#include <cstdint>
#include <vector>

#include "perf/tools/robot/session.h"
#include "scenes/robot/robot.h"

namespace cab::perf {

// Why a pair of links is masked. Of several reasons the first holds.
enum class MaskReason : std::uint8_t {
  kFile,      // the SRDF file or the MJCF file excludes the pair
  kWelded,    // no joint moves the links against each other, by MuJoCo's rules
  kAdjacent,  // a joint connects the links: as scenes/robot/adjacency.h says, or for MJCF by MuJoCo's rules
  kDefault,   // they touch at rest and in at least kAlwaysShare of the sampled states
  kAlways,    // they touch in at least kAlwaysShare of the sampled states, not at rest
  kNever,     // they touch in none of the sampled states
};
inline constexpr std::uint32_t kMaskReasonCount = 6;

// The name of a reason in tables and files.
const char* to_string(MaskReason reason);

// The share of sampled states from which on links touch by their build, so that a test says nothing. MoveIt's setup
// assistant has the same.
inline constexpr double kAlwaysShare = .95;

struct MaskedPair {
  LinkPair links;  // a < b
  MaskReason reason = MaskReason::kFile;
  std::uint32_t touching_samples = 0;  // of default, always and never: in how many sampled states they touch
};

// A pair that touches at rest and is tested all the same, because it is apart in too many of the samples.
struct RestPair {
  LinkPair links;  // a < b
  std::uint32_t touching_samples = 0;
};

struct Matrix {
  std::vector<MaskedPair> masked;    // sorted by a, then b; only pairs of links with shapes
  std::vector<RestPair> rest_pairs;  // in the same order
  std::uint32_t samples = 0;         // that decided
};

struct MatrixOptions {
  std::vector<LinkPair> excluded;  // by a file
  bool derive = true;              // also mask adjacent links, and ask which others touch at rest
  std::uint32_t samples = 0;       // random states that decide about `default`, `always` and `never`; 0: none of them
  std::uint64_t seed = 1;
};

// Pairs in a <pair> of an MJCF file are masked by options.excluded alone.
Matrix make_matrix(const scenes::Robot& robot, const MatrixOptions& options, const RobotSessionOptions& session);

// The greatest share of states in which a pair may touch that touched in none of `samples` random ones, at 95 %
// confidence: with a larger share, all samples are free with a probability of less than 5 %.
double never_bound(std::uint32_t samples);

// How many links have a shape.
std::size_t count_shaped(const scenes::Robot& robot);

}  // namespace cab::perf
