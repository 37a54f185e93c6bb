// `cab kernels`: nanoseconds of the merge, of the overlap test and of the exact test on every instruction set, and
// FCL's on the same boxes and shapes, measured in turns in one run.
#include "kernels/find_kernels.h"
#include "kernels/gather_pairs.h"
#include "kernels/isa_list.h"
#include "kernels/refit_tree.h"
#include "layout/box_aos.h"
#include "layout/merge_program.h"
#include "layout/tile.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/measure/kernels/exact.h"
#include "perf/measure/kernels/options.h"
#include "perf/measure/kernels/race.h"

#include <cab/cab.h>
#include <fcl/math/bv/OBB.h>

#include <iostream>

namespace cab::perf {
namespace {

// One round makes kMergeTiles x kMergeRepeats merges of 16 lanes. Children and parents stay in a core's second-level
// cache.
constexpr std::uint32_t kMergeTiles = 64;
constexpr std::uint32_t kMergeRepeats = 16;

// Overlap tests in one round: random index pairs over boxes that stay in the second-level cache.
constexpr std::uint32_t kBoxes = 4096;
constexpr std::uint32_t kPairs = 1u << 15;

fcl::OBBf random_box(Random& random, float place) {
  Eigen::Quaternionf q(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  if (q.norm() < 0.1f) q = Eigen::Quaternionf::Identity();
  fcl::OBBf box;
  box.axis = q.normalized().toRotationMatrix();
  box.To = fcl::Vector3f(random.uniform(-place, place), random.uniform(-place, place), random.uniform(-place, place));
  box.extent = fcl::Vector3f(random.uniform(0.15f, 0.5f), random.uniform(0.05f, 0.2f), random.uniform(0.05f, 0.2f));
  return box;
}

void put(BoxTile& tile, std::uint32_t lane, const fcl::OBBf& box) {
  for (int c = 0; c < 3; ++c) {
    tile.center[c][lane] = box.To[c];
    tile.half[c][lane] = box.extent[c];
    for (int k = 0; k < 3; ++k) tile.axis[k][c][lane] = box.axis(c, k);
  }
}

BoxAos to_aos(const fcl::OBBf& box) {
  BoxAos out{};
  for (int c = 0; c < 3; ++c) {
    out.center[c] = box.To[c];
    out.half[c] = box.extent[c];
    for (int k = 0; k < 3; ++k) out.axis[3 * k + c] = box.axis(c, k);
  }
  return out;
}

// The kernels of the chosen instruction sets, or of every available one if `isas` is empty.
std::vector<const kernel::KernelTable*> chosen_kernels(std::vector<Isa> isas) {
  if (isas.empty()) isas.assign(std::begin(kernel::kAllIsas), std::end(kernel::kAllIsas));
  std::vector<const kernel::KernelTable*> out;
  for (const Isa isa : isas)
    if (const kernel::KernelTable* table = kernel::find_kernels(isa)) out.push_back(table);
  return out;
}

// ------------------------------------------------------------------------------------------------------ merge

struct MergeWork {
  MergeWork()
      : nodes(3 * kMergeTiles),
        joints(kMergeTiles),
        first(kMergeTiles * kLanes),
        second(first.size()),
        merged(first.size()) {
    Random random(1);
    for (std::uint32_t i = 0; i < first.size(); ++i) {
      first[i] = random_box(random, 0.5f);
      second[i] = random_box(random, 0.5f);
      second[i].To =
          first[i].To + first[i].axis.col(0) * first[i].extent[0] + second[i].axis.col(0) * second[i].extent[0];
      const std::uint32_t tile = i / kLanes, lane = i % kLanes;
      put(nodes[3 * tile], lane, first[i]);
      put(nodes[3 * tile + 1], lane, second[i]);
      const fcl::Vector3f joint = first[i].To + first[i].axis.col(0) * first[i].extent[0];
      for (int c = 0; c < 3; ++c) joints[tile].at[c][lane] = joint[c];
    }
  }
  std::vector<BoxTile> nodes;
  std::vector<PointTile> joints;
  std::vector<fcl::OBBf> first, second, merged;
};

void measure_merge(const std::vector<const kernel::KernelTable*>& tables, std::uint32_t rounds, ProgressBar& bar) {
  MergeWork work;
  static constexpr MergeStep kStep[] = {{0, 1, 0}};
  MergeProgram program;
  program.steps = {kStep, 1};
  std::vector<Contender> contenders;
  const std::uint64_t merges = std::uint64_t{kMergeTiles} * kLanes * kMergeRepeats;
  for (const kernel::KernelTable* table : tables)
    contenders.push_back({std::string("cab ") + to_string(table->isa), merges, [&work, &program, table] {
                            for (std::uint32_t r = 0; r < kMergeRepeats; ++r)
                              for (std::uint32_t t = 0; t < kMergeTiles; ++t)
                                table->refit_boxes[0][0]({&program, &work.joints[t], &work.nodes[3 * t]});
                            return std::uint64_t{0};
                          }});
  contenders.push_back({"FCL OBB<float> operator+", work.first.size(), [&work] {
                          for (std::size_t i = 0; i < work.first.size(); ++i)
                            work.merged[i] = work.first[i] + work.second[i];
                          return std::uint64_t{0};
                        }});
  race(contenders, rounds, bar);
  TextTable out;
  out.add_row({"merge of two jointed boxes", "ns", "FCL operator+ / this"});
  for (const Contender& contender : contenders)
    out.add_row({contender.name, fixed(median(contender.nanoseconds), 2),
                 fixed(times_faster(contender, contenders.back()), 1)});
  out.print(std::cout);
}

// -------------------------------------------------------------------------------------------------------- SAT

struct Pair {
  std::uint32_t a, b;
};

struct OverlapWork {
  OverlapWork() {
    Random random(2);
    for (std::uint32_t i = 0; i < kBoxes; ++i) {
      fcl_boxes.push_back(random_box(random, 0.45f));
      boxes.push_back(to_aos(fcl_boxes.back()));
    }
  }

  // Random pairs. The given share of them overlaps.
  std::vector<Pair> pairs(double share) const {
    Random random(3);
    std::vector<Pair> out;
    std::size_t overlapping = 0;
    const std::size_t wanted = static_cast<std::size_t>(share * kPairs);
    while (out.size() < kPairs) {
      const Pair pair = {static_cast<std::uint32_t>(random.next_u64() % kBoxes),
                         static_cast<std::uint32_t>(random.next_u64() % kBoxes)};
      if (pair.a == pair.b) continue;
      const bool overlap = fcl_boxes[pair.a].overlap(fcl_boxes[pair.b]);
      if (overlap ? overlapping == wanted : out.size() - overlapping == kPairs - wanted) continue;
      overlapping += overlap;
      out.push_back(pair);
    }
    return out;
  }

  std::vector<fcl::OBBf> fcl_boxes;
  std::vector<BoxAos> boxes;
};

std::uint64_t count_overlaps(const kernel::KernelTable& table, const std::vector<BoxAos>& boxes,
                             const std::vector<Pair>& pairs) {
  std::uint64_t count = 0;
  kernel::BoxPairs<BoxAos> block;
  block.shift = nullptr;
  block.leaves = 0;
  for (std::size_t i = 0; i < pairs.size(); i += kLanes) {
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      block.a[lane] = &boxes[pairs[i + lane].a];
      block.b[lane] = &boxes[pairs[i + lane].b];
    }
    count += static_cast<std::uint64_t>(
        __builtin_popcount(table.overlap_boxes[static_cast<std::size_t>(Sat::kAll15)](block)));
  }
  return count;
}

// The relative pose of a pair, as FCL's obbDisjoint takes it.
struct Relative {
  fcl::Matrix3f rotation;
  fcl::Vector3f translation;
};

void measure_overlap(const std::vector<const kernel::KernelTable*>& tables, std::uint32_t rounds, ProgressBar& bar) {
  const OverlapWork work;
  for (const double share : {0.1, 0.5, 0.9}) {
    const std::vector<Pair> pairs = work.pairs(share);
    std::vector<Relative> relative;
    for (const Pair& pair : pairs) {
      const fcl::OBBf &a = work.fcl_boxes[pair.a], &b = work.fcl_boxes[pair.b];
      relative.push_back({a.axis.transpose() * b.axis, a.axis.transpose() * (b.To - a.To)});
    }
    std::vector<Contender> contenders;
    for (const kernel::KernelTable* table : tables)
      contenders.push_back({std::string("cab ") + to_string(table->isa), kPairs,
                            [&work, &pairs, table] { return count_overlaps(*table, work.boxes, pairs); }});
    contenders.push_back({"FCL OBB<float>::overlap", kPairs, [&work, &pairs] {
                            std::uint64_t count = 0;
                            for (const Pair& pair : pairs)
                              count += work.fcl_boxes[pair.a].overlap(work.fcl_boxes[pair.b]);
                            return count;
                          }});
    contenders.push_back({"FCL obbDisjoint<float> (relative pose given)", kPairs, [&work, &pairs, &relative] {
                            std::uint64_t count = 0;
                            for (std::size_t i = 0; i < pairs.size(); ++i)
                              count += !fcl::obbDisjoint(relative[i].rotation, relative[i].translation,
                                                         work.fcl_boxes[pairs[i].a].extent,
                                                         work.fcl_boxes[pairs[i].b].extent);
                            return count;
                          }});
    race(contenders, rounds, bar);
    TextTable out;
    out.add_row({"overlap from index pairs, " + fixed(100 * share, 0) + " % overlap", "ns", "overlap / this",
                 "obbDisjoint / this", "overlapping"});
    for (const Contender& contender : contenders)
      out.add_row({contender.name, fixed(median(contender.nanoseconds), 2),
                   fixed(times_faster(contender, contenders[contenders.size() - 2]), 1),
                   fixed(times_faster(contender, contenders.back()), 1), std::to_string(contender.answer)});
    std::cout << '\n';
    out.print(std::cout);
  }
}

}  // namespace

int kernels_command(const KernelsOptions& options) {
  const std::vector<const kernel::KernelTable*> tables = chosen_kernels(options.isas);
  ProgressBar bar("rounds", (4 + kExactTables) * (std::uint64_t{options.rounds} + 1));
  measure_merge(tables, options.rounds, bar);
  measure_overlap(tables, options.rounds, bar);
  measure_exact(tables, options.rounds, bar);
  return 0;
}

}  // namespace cab::perf
