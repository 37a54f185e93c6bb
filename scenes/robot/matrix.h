// The allowed-collision matrix of a robot: which pairs of links are not tested against each other, and why.
#pragma once

#include "scenes/robot/session.h"

#include <cab/files.h>

#include <cstdint>
#include <vector>

namespace cab::scenes {

using files::DisabledPair;
using files::DisabledReason;

inline constexpr std::uint32_t kDisabledReasonCount = 6;

// The share of sampled states from which on links touch by their build, so that a test says nothing. MoveIt's setup
// assistant has the same.
inline constexpr double kAlwaysShare = .95;

// A pair that touches at rest and is tested all the same, because it is apart in too many of the samples.
struct RestPair {
  LinkPair links;  // a < b
  std::uint32_t touching_samples = 0;
};

struct Matrix {
  std::vector<DisabledPair> masked;  // sorted by a, then b; only pairs of links with shapes
  std::vector<RestPair> rest_pairs;  // in the same order
  std::uint32_t samples = 0;         // that decided
};

struct MatrixOptions {
  std::vector<LinkPair> excluded;  // by a file
  bool derive = true;              // also mask adjacent links, and ask which others touch at rest
  std::uint32_t samples = 0;       // random states that decide about `default`, `always` and `never`; 0: none of them
  std::uint64_t seed = 1;
  float margin = 0;  // metres: links that come as near in a sample are tested, although they touch in none
};

// Pairs in a <pair> of an MJCF file are masked by options.excluded alone.
Matrix make_matrix(const Robot& robot, const MatrixOptions& options, const RobotSessionOptions& session);

// The greatest share of states in which a pair may touch that touched in none of `samples` random ones, at 95 %
// confidence: with a larger share, all samples are free with a probability of less than 5 %.
double never_bound(std::uint32_t samples);

// How many links have a shape.
std::size_t count_shaped(const Robot& robot);

}  // namespace cab::scenes
