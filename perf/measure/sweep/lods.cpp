#include "perf/measure/sweep/lods.h"

#include <algorithm>
#include <array>
#include <iostream>
#include <iterator>
#include <memory>
#include <utility>

#include "perf/base/option_values.h"
#include "perf/base/report.h"

namespace cab::perf {
namespace {

// Two characters in a frame: the frame, and group and instance of each.
using CharacterPair = std::array<std::uint32_t, 5>;

// A crowd at one level, in an engine.
struct LodCell {
  LodRow row;
  std::unique_ptr<CrowdSession> session;
  std::vector<double> seconds;  // of a frame, by round
};

LodCell make_cell(const SweepScene& scene, std::string name) {
  LodCell out;
  out.row.name = std::move(name);
  out.session = std::make_unique<CrowdSession>(*scene.crowd, Isa::kAuto, 1);
  return out;
}

// Runs all frames. Returns the pairs of characters that are reported, sorted, and adds their counts to the row.
std::vector<CharacterPair> count(const SweepScene& scene, const Policies& policies, LodCell& cell) {
  std::vector<CharacterPair> out;
  for (std::uint32_t f = 0; f < scene.frame_count; ++f) {
    cell.row.candidates += cell.session->run(scene.posed[f], policies).candidates;
    cell.row.hits += cell.session->hits().size;
    for (const Hit& hit : cell.session->hits())
      out.push_back({f, cell.session->group_of(hit.batch_a), hit.instance_a, cell.session->group_of(hit.batch_b),
                     hit.instance_b});
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  cell.row.pairs = out.size();
  return out;
}

std::uint64_t count_only_in(const std::vector<CharacterPair>& all, const std::vector<CharacterPair>& others) {
  std::vector<CharacterPair> out;
  std::set_difference(all.begin(), all.end(), others.begin(), others.end(), std::back_inserter(out));
  return out.size();
}

}  // namespace

std::vector<LodRow> sweep_lods(const SweepScene& scene, std::uint32_t rounds) {
  Policies exact;
  exact.exact = Exact::kConvex;
  LodCell judge = make_cell(scene, "judge");
  const std::vector<CharacterPair> touching = count(scene, exact, judge);

  std::vector<LodCell> cells;
  cells.push_back(make_cell(scene, "finest"));
  std::size_t least_links = kMaxLinks;
  for (const scenes::CrowdGroup& group : scene.crowd->groups)
    least_links = std::min(least_links, group.figure.link_parents.size());
  for (const LodKind kind : {LodKind::kReach, LodKind::kNodes})
    for (std::uint32_t leaves = 1; leaves < least_links; leaves *= 2) {
      cells.push_back(
          make_cell(scene, std::string(kLodKindNames[static_cast<std::size_t>(kind)]) + ' ' + std::to_string(leaves)));
      cells.back().session->use_coarse({1, kind, leaves}, scene.posed[0]);
    }
  for (LodCell& cell : cells) {
    const std::vector<CharacterPair> found = count(scene, {}, cell);
    cell.row.false_pairs = count_only_in(found, touching);
    cell.row.misses = count_only_in(touching, found);
  }
  for (std::uint32_t r = 0; r < rounds; ++r)
    for (LodCell& cell : cells) {
      double sum = 0;
      for (std::uint32_t f = 0; f < scene.frame_count; ++f) sum += cell.session->run(scene.posed[f], {}).seconds_total;
      cell.seconds.push_back(sum / scene.frame_count);
    }
  std::vector<LodRow> out;
  for (LodCell& cell : cells) {
    cell.row.seconds = spread_of(std::move(cell.seconds));
    out.push_back(cell.row);
  }
  return out;
}

void print_lods(const SweepScene& scene, const std::vector<LodRow>& rows) {
  std::cout << "Levels of detail of " << scene.name << ", all " << scene.character_count()
            << " characters at one level:\n";
  TextTable table;
  table.add_row({"", "ms per frame", "of finest", "candidates", "hits", "pairs", "false pairs", "misses"});
  for (const LodRow& row : rows)
    table.add_row({row.name, fixed(1e3 * row.seconds.median, 4), fixed(row.seconds.median / rows[0].seconds.median, 2),
                   std::to_string(row.candidates), std::to_string(row.hits), std::to_string(row.pairs),
                   std::to_string(row.false_pairs), std::to_string(row.misses)});
  table.print(std::cout);
  std::cout << '\n';
}

}  // namespace cab::perf
