#include "scenes/robot/matrix.h"

#include <algorithm>
#include <cmath>

#include "scenes/robot/adjacency.h"
#include "scenes/robot/kinematics.h"

namespace cab::scenes {
namespace {

// The first sampled state for the matrix. It is far from those that `cab robot` checks, so that these are others.
constexpr std::uint64_t kFirstSample = std::uint64_t{1} << 63;

// One cell per pair of links.
template <class Cell>
class PairTable {
 public:
  explicit PairTable(std::size_t links) : links_(links), cells_(links * links) {}
  Cell& at(std::size_t a, std::size_t b) { return cells_[place(a, b)]; }
  const Cell& at(std::size_t a, std::size_t b) const { return cells_[place(a, b)]; }

 private:
  std::size_t place(std::size_t a, std::size_t b) const { return std::min(a, b) * links_ + std::max(a, b); }

  std::size_t links_;
  std::vector<Cell> cells_;
};

std::vector<LinkPair> links_of(const std::vector<DisabledPair>& masked) {
  std::vector<LinkPair> pairs;
  for (const DisabledPair& pair : masked) pairs.push_back(pair.links);
  return pairs;
}

}  // namespace

std::size_t count_shaped(const Robot& robot) {
  const std::vector<bool> shaped = shaped_links(robot);
  return static_cast<std::size_t>(std::count(shaped.begin(), shaped.end(), true));
}

double never_bound(std::uint32_t samples) { return -std::expm1(std::log(.05) / samples); }

Matrix make_matrix(const Robot& robot, const MatrixOptions& options, const RobotSessionOptions& session) {
  const std::size_t count = robot.links.size();
  const std::vector<bool> shaped = shaped_links(robot);
  PairTable<char> known(count);
  Matrix matrix;
  matrix.samples = options.samples;
  const auto mask = [&](std::uint32_t a, std::uint32_t b, DisabledReason reason, std::uint32_t touching) {
    if (a == b || !shaped[a] || !shaped[b] || known.at(a, b) != 0) return;
    known.at(a, b) = 1;
    matrix.masked.push_back({{std::min(a, b), std::max(a, b)}, reason, touching});
  };
  for (const LinkPair& pair : options.excluded) mask(pair.a, pair.b, DisabledReason::kFile, 0);
  if (robot.mujoco) {
    for (const LinkPair& pair : robot.mujoco->listed) known.at(pair.a, pair.b) = 1;
    for (const LinkPair& pair : robot.mujoco->welded) mask(pair.a, pair.b, DisabledReason::kWelded, 0);
  }
  // In how many states the links of each pair are within a margin.
  const auto count_within = [&](const StateSource& states, float margin) {
    PairTable<std::uint32_t> within(count);
    RobotSessionOptions settings = session;
    settings.margin = margin;
    if (states.count > 0)
      RobotSession(robot, links_of(matrix.masked), settings).run(states, {}, [&](const StateChunk& chunk) {
        for (const Hit& hit : chunk.hits) ++within.at(hit.link_a, hit.link_b);
      });
    return within;
  };
  if (options.derive)
    for (const LinkPair& pair : robot.mujoco ? robot.mujoco->adjacent : adjacent_pairs(robot))
      mask(pair.a, pair.b, DisabledReason::kAdjacent, 0);
  const StateSource rest = {options.derive ? 1u : 0u, [&](std::uint64_t, double* state) {
                              const std::vector<double> values = rest_state(robot);
                              std::copy(values.begin(), values.end(), state);
                            }};
  const StateSource random = {options.samples, [&](std::uint64_t index, double* state) {
                                random_state(robot, options.seed, kFirstSample + index, state);
                              }};
  const PairTable<std::uint32_t> at_rest = count_within(rest, 0), touching = count_within(random, 0);
  const bool has_margin = options.margin > 0;
  const PairTable<std::uint32_t> near_at_rest = has_margin ? count_within(rest, options.margin) : at_rest;
  const PairTable<std::uint32_t> near = has_margin ? count_within(random, options.margin) : touching;
  for (std::uint32_t a = 0; a < count; ++a)
    for (std::uint32_t b = a + 1; b < count; ++b) {
      const std::uint32_t times = touching.at(a, b);
      const bool rests = at_rest.at(a, b) != 0;
      if (options.samples > 0 && times >= kAlwaysShare * options.samples) {
        mask(a, b, rests ? DisabledReason::kDefault : DisabledReason::kAlways, times);
      } else if (rests) {
        matrix.rest_pairs.push_back({{a, b}, times});
      } else if (options.samples > 0 && near.at(a, b) == 0 && near_at_rest.at(a, b) == 0) {
        mask(a, b, DisabledReason::kNever, 0);
      }
    }
  std::sort(matrix.masked.begin(), matrix.masked.end(), [](const DisabledPair& l, const DisabledPair& r) {
    return l.links.a != r.links.a ? l.links.a < r.links.a : l.links.b < r.links.b;
  });
  return matrix;
}

}  // namespace cab::scenes
