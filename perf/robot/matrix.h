// The allowed-collision matrix of a robot, made as MoveIt's setup assistant makes it: which pairs of links are not
// tested against each other, and why.
#pragma once

#include <cstdint>
#include <vector>

#include "perf/robot/session.h"
#include "scenes/robot/robot.h"

namespace cab::perf {

// Why a pair of links is masked. Of several reasons the first holds.
enum class MaskReason : std::uint8_t {
  kFile,      // the SRDF file or the MJCF file excludes the pair
  kWelded,    // no joint moves the links against each other, by MuJoCo's rules
  kAdjacent,  // a joint connects the links: as scenes/robot/adjacency.h says, or for MJCF by MuJoCo's rules
  kDefault,   // they touch at rest
  kAlways,    // they touch in more than 95 % of the sampled states
  kNever,     // they touch in none of the sampled states
};
inline constexpr std::uint32_t kMaskReasonCount = 6;

// The name of a reason in tables and files.
const char* to_string(MaskReason reason);

struct MaskedPair {
  LinkPair links;  // a < b
  MaskReason reason = MaskReason::kFile;
};

struct MatrixOptions {
  std::vector<LinkPair> excluded;  // by a file
  bool derive = true;              // also mask adjacent links, and those that touch at rest
  std::uint32_t samples = 0;       // random states that decide about `always` and `never`; 0: neither
  std::uint64_t seed = 1;
};

// The masked pairs, sorted by a, then b. Only pairs of links with shapes are listed. Pairs in a <pair> of an MJCF file
// are never masked.
std::vector<MaskedPair> make_matrix(const scenes::Robot& robot, const MatrixOptions& options,
                                    const RobotSessionOptions& session);

// How many links have a shape.
std::size_t count_shaped(const scenes::Robot& robot);

}  // namespace cab::perf
