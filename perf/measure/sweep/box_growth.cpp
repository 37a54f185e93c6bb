#include "perf/measure/sweep/box_growth.h"

#include <cab/cab.h>

#include "perf/base/engine_session.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/rotation_limit.h"

namespace cab::perf {
namespace {

using oracle::OracleBox;

// The boxes of a figure in its poses: [pose][node].
struct FigureBoxes {
  ArticulationInfo info;
  std::vector<MergeStep> steps;
  std::vector<Box> boxes;
};

FigureBoxes boxes_of(const PosedFigure& posed, const Policies& policies) {
  const oracle::EnginePtr engine = oracle::make_engine();
  const ArticulationId id = add_character(*engine, posed.figure);
  FigureBoxes out;
  oracle::require(articulation_info(*engine, id, &out.info));
  out.steps.resize(out.info.leaf_count - 1);
  oracle::require(merge_steps(*engine, id, out.steps));
  BatchInput input;
  input.batch = oracle::add_instances(*engine, id, posed.pose_count);
  input.poses.format = posed.figure.pose_format;
  input.poses.data = posed.figure.poses.data();
  input.orientations = posed.orientations;
  out.boxes.resize(std::size_t{posed.pose_count} * out.info.node_count);
  oracle::require(compute_boxes(*engine, input, policies, out.boxes));
  return out;
}

OracleBox<double> in_double(const Box& box) {
  OracleBox<double> out{};
  for (std::size_t k = 0; k < 3; ++k) {
    out.center[k] = static_cast<double>(box.center[k]);
    out.half[k] = static_cast<double>(box.half[k]);
    for (std::size_t c = 0; c < 3; ++c) out.axis[k][c] = static_cast<double>(box.axis[k][c]);
  }
  return out;
}

}  // namespace

double inner_area(const std::vector<PosedFigure>& figures, const Policies& policies) {
  double sum = 0;
  for (const PosedFigure& posed : figures) {
    const FigureBoxes found = boxes_of(posed, policies);
    for (std::size_t b = 0; b < found.boxes.size(); ++b)
      if (b % found.info.node_count >= found.info.leaf_count) sum += oracle::surface_of(in_double(found.boxes[b]).half);
  }
  return sum;
}

double inner_area_limit(const std::vector<PosedFigure>& figures) {
  double sum = 0;
  for (const PosedFigure& posed : figures) {
    const FigureBoxes found = boxes_of(posed, {});                       // oriented leaves
    std::vector<std::vector<std::size_t>> below(found.info.node_count);  // the leaves of each node
    for (std::size_t leaf = 0; leaf < found.info.leaf_count; ++leaf) below[leaf] = {leaf};
    for (std::size_t s = 0; s < found.steps.size(); ++s) {
      std::vector<std::size_t>& leaves = below[found.info.leaf_count + s];
      for (const std::uint16_t child : {found.steps[s].left, found.steps[s].right})
        leaves.insert(leaves.end(), below[child].begin(), below[child].end());
    }
    for (std::uint32_t pose = 0; pose < posed.pose_count; ++pose)
      for (std::size_t node = found.info.leaf_count; node < found.info.node_count; ++node) {
        std::vector<OracleBox<double>> leaves;
        for (const std::size_t leaf : below[node])
          leaves.push_back(in_double(found.boxes[std::size_t{pose} * found.info.node_count + leaf]));
        sum += oracle::rotation_limit(leaves);
      }
  }
  return sum;
}

}  // namespace cab::perf
