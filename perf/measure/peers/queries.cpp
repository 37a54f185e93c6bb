// `cab peers --queries`: rays, spheres and points through other libraries on the same crowds, each set-up verified by
// the judge and timed in turns with the engine.
#include "perf/measure/peers/queries.h"

#include <cab/cab.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/processor_time.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/base/usage.h"
#include "perf/judge/oracle/random.h"
#include "perf/measure/peers/all_peers.h"
#include "perf/measure/peers/query_check.h"
#include "perf/measure/peers/query_world.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;
using Posed = std::vector<scenes::PosedGroup>;

constexpr std::uint32_t kDefaultCharacters = 10000;

// Of the verification: few enough for brute force in long double.
constexpr std::uint32_t kVerifiedRays = 4000, kVerifiedSpheres = 400, kVerifiedPoints = 1000;

// Of the large crowd's answers that differ from cab's, so many of each set-up are judged.
constexpr std::uint32_t kMostJudged = 10;

// Rays and spheres in metres; where rays begin, and where points and the centres of spheres are.
constexpr float kRayLength = 20, kSphereRadius = 2;
constexpr double kLowest = 0.2, kHighest = 1.7;

constexpr QueryKind kKinds[] = {QueryKind::kRay, QueryKind::kSphere, QueryKind::kPoint};
constexpr std::uint32_t kPerRay = 10;  // rays per sphere, and per point

const char* name_of(QueryKind kind) {
  return kind == QueryKind::kRay ? "rays" : kind == QueryKind::kSphere ? "spheres" : "points";
}

// Random queries about a crowd. The same count, kind and crowd give the same queries.
QuestionSet make_queries(const Posed& posed, QueryKind kind, std::uint32_t count) {
  double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
  for (const scenes::PosedGroup& group : posed)
    for (std::size_t i = 0; i < group.origins.size(); i += 3)
      for (std::size_t c = 0; c < 2; ++c) {
        low[c] = std::min(low[c], group.origins[i + c]);
        high[c] = std::max(high[c], group.origins[i + c]);
      }
  oracle::Random random(1 + static_cast<std::uint64_t>(kind));
  QuestionSet out;
  out.kind = kind;
  for (std::uint32_t i = 0; i < count; ++i) {
    Query& ours = out.ours.emplace_back();
    PeerQuery& peers = out.peers.emplace_back();
    const oracle::Vec3<double> along = random.unit_vector();
    for (std::size_t c = 0; c < 3; ++c) {
      peers.at[c] = static_cast<float>(c < 2 ? random.uniform(low[c], high[c]) : random.uniform(kLowest, kHighest));
      peers.direction[c] = kind == QueryKind::kRay ? static_cast<float>(along[c]) : 0;
      ours.position[c] = static_cast<double>(peers.at[c]);  // the same bits
      ours.direction[c] = peers.direction[c];
    }
    ours.kind = kind;
    ours.want = kind == QueryKind::kSphere ? QueryWant::kAll : QueryWant::kClosest;
    ours.length = kind == QueryKind::kRay ? kRayLength : kNoHit;
    ours.radius = kind == QueryKind::kSphere ? kSphereRadius : 0;
    peers.reach = kind == QueryKind::kRay ? kRayLength : kSphereRadius;
  }
  return out;
}

// ------------------------------------------------------------------------------------------------------------- cab

// The modes of cab: for each kind by itself, and after a frame of the same poses. Spheres find many links, so they are
// asked for the short list too, which peers give.
struct CabMode {
  QueryKind kind;
  bool reuse, links;
};
constexpr CabMode kCabModes[] = {{QueryKind::kRay, false, false},    {QueryKind::kRay, true, false},
                                 {QueryKind::kSphere, false, false}, {QueryKind::kSphere, true, false},
                                 {QueryKind::kSphere, false, true},  {QueryKind::kSphere, true, true},
                                 {QueryKind::kPoint, false, false},  {QueryKind::kPoint, true, false}};

class CabQueries : public CrowdQueries {
 public:
  CabQueries(const scenes::Crowd& crowd, const Posed* const& posed, Isa isa, std::uint32_t queries)
      : leaves_(crowd), posed_(posed), session_(crowd, isa, 1) {
    session_.reserve_queries(queries);
  }

  Isa isa() const { return session_.isa(); }

  void update(const PosedBoxes&) override {}  // is part of each call
  void prepare(std::size_t mode) override {
    if (kCabModes[mode].reuse) session_.run(*posed_, {});
  }

  void answer(std::size_t mode, const QuestionSet& asked, Answers& out) override {
    const double start = processor_seconds();
    by_links_ = kCabModes[mode].links;
    const bool reuse = kCabModes[mode].reuse;
    const QueryStats stats =
        by_links_ ? session_.answer_by_links(*posed_, asked.ours, reuse) : session_.answer(*posed_, asked.ours, reuse);
    // The call measures wall time, so its parts are taken as shares.
    const double all = stats.seconds_total > 0 ? stats.seconds_total : 1;
    out.update_seconds = (processor_seconds() - start) * (stats.seconds_bound + stats.seconds_index) / all;
    out.sort_seconds = 0;
  }

  // The answers of the last call, as those of peers. Not timed.
  void read_answers(const QuestionSet& asked, Answers& out) const {
    const double update_seconds = out.update_seconds;
    out.clear(asked.ours.size());
    out.update_seconds = update_seconds;
    const auto leaf_of = [this](const auto& hit) {
      return leaves_.number_of(hit.batch.value - 1, hit.instance, hit.leaf);
    };
    const auto add_overlaps = [&](const auto& hits) {
      for (const auto& hit : hits) out.overlaps.push_back({hit.query, leaf_of(hit)});
    };
    if (by_links_) return add_overlaps(session_.query_links());
    if (asked.kind == QueryKind::kSphere) return add_overlaps(session_.query_hits());
    for (const QueryHit& hit : session_.query_hits()) {
      out.distances[hit.query] = hit.distance;
      out.leaves[hit.query] = leaf_of(hit);
    }
  }

  static std::vector<QueryMode> modes() {
    std::vector<QueryMode> out;
    for (const CabMode& mode : kCabModes)
      out.push_back({mode.kind,
                     std::string(mode.links ? "links" : "") + (mode.links && mode.reuse ? ", " : "") +
                         (mode.reuse ? "after a frame" : ""),
                     std::string(mode.reuse ? "run_queries with reuse_bounds: the index and the answers"
                                            : "run_queries: posing, the index and the answers") +
                         (mode.links ? ", as a short list" : "")});
    return out;
  }

 private:
  CrowdLeaves leaves_;
  const Posed* const& posed_;
  CrowdSession session_;
  bool by_links_ = false;  // how the last call was answered
};

// ------------------------------------------------------------------------------------------------------- contestants

// A set-up, asked in one way.
struct Contestant {
  std::size_t entrant;
  std::size_t mode;
  std::string name;
  std::string meaning;
  QueryKind kind;
  bool alone;
  bool candidates;
  bool ours;
  QueryDifferences small = {};  // from the judge, over all scenes
};

// A set-up of a peer, or cab on one instruction set.
struct Entrant {
  std::string name;
  Isa isa = Isa::kAuto;  // of cab
  QuerySetup setup;      // of a peer; without `make`: cab
  std::vector<QueryMode> modes;
};

std::vector<Entrant> make_entrants(const PeersOptions& options, const std::vector<Peer>& peers) {
  std::vector<Entrant> out;
  const Isa isa = CrowdSession({}, options.isa, 1).isa();
  out.push_back({std::string("cab ") + to_string(isa), isa, {}, CabQueries::modes()});
  if (isa != Isa::kScalar) out.push_back({"cab scalar", Isa::kScalar, {}, CabQueries::modes()});
  for (const Peer& peer : peers)
    for (const QuerySetup& setup : peer.query_setups)
      out.push_back({std::string(peer.name) + ' ' + setup.name, Isa::kAuto, setup, setup.modes});
  return out;
}

std::vector<Contestant> make_contestants(const std::vector<Entrant>& entrants) {
  std::vector<Contestant> out;
  for (std::size_t e = 0; e < entrants.size(); ++e)
    for (std::size_t m = 0; m < entrants[e].modes.size(); ++m) {
      const Entrant& entrant = entrants[e];
      const QueryMode& mode = entrant.modes[m];
      const std::string before = entrant.setup.meaning.empty() ? "" : entrant.setup.meaning + "; ";
      out.push_back({e, m, entrant.name + (mode.name.empty() ? "" : ", " + mode.name), before + mode.meaning, mode.kind,
                     entrant.setup.alone, mode.candidates, !entrant.setup.make});
    }
  return out;
}

// A crowd with all that is asked about it, posed frame by frame, and a world per entrant.
class Runners {
 public:
  Runners(const std::string& scene, std::uint32_t count, const std::array<std::uint32_t, 3>& queries,
          const std::vector<Entrant>& entrants)
      : crowd_(scenes::make_crowd(scene, count)),
        boxes_(crowd_),
        poser_(crowd_, Isa::kAuto, 1),
        frames_(pose_frames(crowd_)) {
    for (std::size_t k = 0; k < asked_.size(); ++k) asked_[k] = make_queries(frames_[0], kKinds[k], queries[k]);
    set_frame(0);
    const std::uint32_t most = *std::max_element(queries.begin(), queries.end());
    for (const Entrant& entrant : entrants) {
      if (entrant.setup.make)
        worlds_.push_back(entrant.setup.make(boxes_));
      else
        worlds_.push_back(std::make_unique<CabQueries>(crowd_, posed_, entrant.isa, most));
    }
  }

  // Poses the crowd for all. Returns the processor seconds of compute_boxes.
  double set_frame(std::uint32_t frame) {
    posed_ = &frames_[frame];
    double seconds = 0;
    std::uint32_t number = 0;
    for (std::size_t g = 0; g < crowd_.groups.size(); ++g) {
      const double start = processor_seconds();
      const std::uint32_t nodes = poser_.pose_boxes(*posed_, g, node_boxes_);
      seconds += processor_seconds() - start;
      const auto leaves = static_cast<std::uint32_t>(crowd_.groups[g].figure.leaves.size());
      for (std::uint32_t i = 0; i < crowd_.groups[g].count; ++i) {
        const double* const origin = (*posed_)[g].origins.data() + 3 * std::size_t{i};
        for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
          const Box& from = node_boxes_[std::size_t{i} * nodes + leaf];
          WorldBox<float>& to = boxes_.boxes[number++];
          for (std::size_t c = 0; c < 3; ++c) {
            to.center[c] = static_cast<float>(origin[c] + static_cast<double>(from.center[c]));
            to.half[c] = from.half[c];
            for (std::size_t k = 0; k < 3; ++k) to.axis[k][c] = from.axis[k][c];
          }
        }
      }
    }
    return seconds;
  }

  double update(std::size_t entrant) {
    const double start = processor_seconds();
    worlds_[entrant]->update(boxes_);
    return processor_seconds() - start;
  }

  // Processor seconds of a call, whose answers are then in answers().
  double answer(const Contestant& contestant) {
    worlds_[contestant.entrant]->prepare(contestant.mode);
    const double start = processor_seconds();
    worlds_[contestant.entrant]->answer(contestant.mode, asked(contestant.kind), answers_);
    return processor_seconds() - start;
  }

  // The answers of the last call, sorted.
  const Answers& sorted_answers(const Contestant& contestant) {
    if (contestant.ours)
      static_cast<const CabQueries&>(*worlds_[contestant.entrant]).read_answers(asked(contestant.kind), answers_);
    std::sort(answers_.overlaps.begin(), answers_.overlaps.end());
    return answers_;
  }

  const Answers& answers() const { return answers_; }
  const QuestionSet& asked(QueryKind kind) const {
    return asked_[static_cast<std::size_t>(std::find(std::begin(kKinds), std::end(kKinds), kind) - kKinds)];
  }
  const scenes::Crowd& crowd() const { return crowd_; }
  const Posed& posed() const { return *posed_; }

 private:
  scenes::Crowd crowd_;
  PosedBoxes boxes_;
  CrowdSession poser_;
  std::vector<Posed> frames_;
  const Posed* posed_ = nullptr;
  std::array<QuestionSet, 3> asked_;
  std::vector<Box> node_boxes_;
  std::vector<std::unique_ptr<CrowdQueries>> worlds_;
  Answers answers_;
};

// Looks at all leaves that are no farther than those that a point has as its nearest, and a little farther.
float looked_at(const Answers& answers, QueryKind kind, std::uint32_t query) {
  constexpr float kFarther = 0.01f;
  return kind == QueryKind::kPoint ? answers.distances[query] + kFarther : 0;
}

// Compares every set-up with the judge, after trees have been updated from frame to frame.
void verify(const std::string& scene, const std::vector<Entrant>& entrants, std::vector<Contestant>& contestants) {
  Runners runners(scene, kVerifiedCharacters, {kVerifiedRays, kVerifiedSpheres, kVerifiedPoints}, entrants);
  for (std::uint32_t f = 0; f < kFrameCount; ++f) {
    runners.set_frame(f);
    for (std::size_t e = 0; e < entrants.size(); ++e) runners.update(e);
  }
  const QueryCheck check(runners.crowd(), runners.posed());
  for (const QueryKind kind : kKinds) {
    const QuestionSet& asked = runners.asked(kind);
    std::vector<JudgedQuery> judged;
    for (Contestant& contestant : contestants) {
      if (contestant.kind != kind) continue;
      runners.answer(contestant);
      const Answers& answers = runners.sorted_answers(contestant);
      for (std::uint32_t q = 0; q < asked.ours.size(); ++q) {
        if (judged.size() <= q) judged.push_back(check.judge(asked.ours[q], looked_at(answers, kind, q)));
        add_differences(judged[q], kind, answers, q, contestant.small);
      }
    }
  }
}

// -------------------------------------------------------------------------------------------------------- the runs

struct Row {
  // Processor seconds of each round: cab's posing and index or the peer's update; sorting; the rest; all of them.
  std::vector<double> update, sort, search, total;
  std::uint64_t hits = 0;
  std::uint64_t differing = 0;   // queries whose answers differ from those of cab
  QueryDifferences judged = {};  // of the first of them
};

struct Run {
  std::string scene;
  std::uint32_t character_count;
  std::vector<double> posing;  // seconds of compute_boxes, of each round
  std::vector<Row> rows;       // of each contestant
  std::array<std::size_t, 3> query_counts;
};

// The row of cab that others of its kind are compared with.
std::size_t first_of(const std::vector<Contestant>& contestants, QueryKind kind) {
  return static_cast<std::size_t>(
      std::find_if(contestants.begin(), contestants.end(), [&](const Contestant& c) { return c.kind == kind; }) -
      contestants.begin());
}

bool differ(const Answers& a, const Answers& b, QueryKind kind, std::uint32_t query) {
  if (kind == QueryKind::kSphere) {
    const Span<const Overlap> one = overlaps_of(a, query), other = overlaps_of(b, query);
    return !std::equal(one.begin(), one.end(), other.begin(), other.end());
  }
  constexpr float kSame = 1e-4f;  // metres
  const float one = a.distances[query], other = b.distances[query];
  return std::isnan(one) || std::isnan(other) || (one < kNoHit) != (other < kNoHit) ||
         (one < kNoHit && std::fabs(one - other) > kSame);
}

// Compares the answers of all set-ups with those of cab, and the first that differ with the judge.
void compare(Runners& runners, const std::vector<Contestant>& contestants, Run& run) {
  const QueryCheck check(runners.crowd(), runners.posed());
  for (const QueryKind kind : kKinds) {
    const std::size_t first = first_of(contestants, kind);
    Answers ours;
    std::map<std::uint32_t, JudgedQuery> judged;
    for (std::size_t c = first; c < contestants.size(); ++c) {
      if (contestants[c].kind != kind) continue;
      Row& row = run.rows[c];
      runners.answer(contestants[c]);
      const Answers& answers = runners.sorted_answers(contestants[c]);
      if (c == first) ours = answers;
      row.hits = answers.overlaps.size();
      std::uint64_t begin_inside = 0;
      for (std::uint32_t q = 0; q < answers.distances.size(); ++q) {
        row.hits += answers.distances[q] < kNoHit;
        if (!differ(answers, ours, kind, q)) continue;
        // Some peers never say that a ray begins inside. Of these rays ten are judged too, beside the others.
        const bool begins_inside = kind == QueryKind::kRay && ours.distances[q] == 0;
        if (++(begins_inside ? begin_inside : row.differing) > kMostJudged) {
          row.judged.not_inside += begins_inside;
          continue;
        }
        auto known = judged.find(q);
        if (known == judged.end()) {
          known = judged.emplace(q, check.judge(runners.asked(kind).ours[q], looked_at(ours, kind, q))).first;
          add_differences(known->second, kind, ours, q, run.rows[first].judged);
        }
        add_differences(known->second, kind, answers, q, row.judged);
      }
    }
  }
}

Run measure(const std::string& scene, std::uint32_t count, const PeersOptions& options,
            const std::vector<Entrant>& entrants, const std::vector<Contestant>& contestants) {
  Run run;
  run.scene = scene;
  run.character_count = count;
  run.rows.resize(contestants.size());
  const std::uint32_t others = std::max(1U, options.rays / kPerRay);
  run.query_counts = {options.rays, others, others};
  Runners runners(scene, count, {options.rays, others, others}, entrants);
  ProgressBar bar(scene + " " + std::to_string(count), options.rounds + std::uint64_t{1});
  for (std::uint32_t f = 0; f < kFrameCount; ++f) {
    runners.set_frame(f);
    for (std::size_t e = 0; e < entrants.size(); ++e) runners.update(e);
  }
  compare(runners, contestants, run);
  bar.advance(1);
  for (std::uint32_t r = 0; r < options.rounds; ++r) {
    // One update that is not measured, since the turn before filled the caches, then one that is, then all questions.
    std::size_t c = 0;
    double posing = 0;
    for (std::size_t e = 0; e < entrants.size(); ++e) {
      const auto frame = [&](std::uint32_t k) {
        return kFrameOrder[(kFrameCount + 2 * r + k) % std::size(kFrameOrder)];
      };
      runners.set_frame(frame(0));
      runners.update(e);
      posing = runners.set_frame(frame(1));
      const double update = runners.update(e);
      for (; c < contestants.size() && contestants[c].entrant == e; ++c) {
        const double seconds = runners.answer(contestants[c]);
        const Answers& answers = runners.answers();
        Row& row = run.rows[c];
        row.update.push_back(update + answers.update_seconds);
        row.sort.push_back(answers.sort_seconds);
        row.search.push_back(seconds - answers.update_seconds - answers.sort_seconds);
        row.total.push_back(update + seconds);
      }
    }
    run.posing.push_back(posing);
    bar.advance(1);
  }
  return run;
}

// ------------------------------------------------------------------------------------------------------- the output

std::string micrometres(double metres) { return fixed(1e6 * metres, 1); }

void print_verification(const PeersOptions& options, const std::vector<Contestant>& contestants) {
  for (const QueryKind kind : kKinds) {
    std::cout << name_of(kind) << " beside the judge, " << kVerifiedCharacters << " characters of";
    for (const std::string& scene : options.scenes) std::cout << ' ' << scene;
    std::cout << ", " << contestants[first_of(contestants, kind)].small.queries
              << " queries; the error in micrometres:\n";
    TextTable table;
    table.add_row({"", "hits", "misses", "false hits", "inexact", "at threshold", "not inside", "largest error"});
    for (const Contestant& c : contestants) {
      if (c.kind != kind) continue;
      const QueryDifferences& d = c.small;
      table.add_row({c.name, std::to_string(d.hits), std::to_string(d.misses), std::to_string(d.false_hits),
                     std::to_string(d.inexact), std::to_string(d.threshold), std::to_string(d.not_inside),
                     kind == QueryKind::kSphere ? "" : micrometres(d.largest_error)});
    }
    table.print(std::cout);
    std::cout << '\n';
  }
}

// The fastest set-up of a peer that loses nothing and answers in full, or the number of contestants.
std::size_t best_peer(const Run& run, const std::vector<Contestant>& contestants, QueryKind kind, bool alone) {
  std::size_t best = contestants.size();
  for (std::size_t c = 0; c < contestants.size(); ++c) {
    const Contestant& which = contestants[c];
    if (which.kind != kind || which.ours || which.candidates || (alone && !which.alone)) continue;
    if (!which.small.is_right() || !run.rows[c].judged.is_right()) continue;
    if (best == contestants.size() || median(run.rows[c].total) < median(run.rows[best].total)) best = c;
  }
  return best;
}

void print_run(const Run& run, const std::vector<Contestant>& contestants) {
  std::cout << '\n'
            << run.scene << ", " << run.character_count << " characters, " << run.posing.size()
            << " rounds; processor ms, medians. Posing by compute_boxes, which peers are spared: "
            << fixed(1e3 * median(run.posing), 2) << " ms\n";
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    const QueryKind kind = kKinds[k];
    const std::size_t first = first_of(contestants, kind);
    std::cout << '\n' << run.query_counts[k] << ' ' << name_of(kind) << ":\n";
    TextTable table;
    table.add_row({"", "alone", "update", "sort", "query", "sum", "ratio", "least", "most", "query ratio", "hits",
                   "differ", "not inside", "judged", "misses", "false hits", "inexact"});
    for (std::size_t c = 0; c < contestants.size(); ++c) {
      if (contestants[c].kind != kind) continue;
      const Row& row = run.rows[c];
      std::vector<std::string> cells = {contestants[c].name, contestants[c].alone ? "yes" : ""};
      for (const std::vector<double>* seconds : {&row.update, &row.sort, &row.search, &row.total})
        cells.push_back(fixed(1e3 * median(*seconds), 2));
      const Spread all = ratio_of(row.total, run.rows[first].total);
      for (const double value : {all.median, all.least, all.most}) cells.push_back(fixed(value, 2));
      cells.push_back(fixed(ratio_of(row.search, run.rows[first].search).median, 2));
      for (const std::uint64_t n : {row.hits, row.differing, row.judged.not_inside, row.judged.queries,
                                    row.judged.misses, row.judged.false_hits, row.judged.inexact})
        cells.push_back(std::to_string(n));
      table.add_row(std::move(cells));
    }
    table.print(std::cout);
    for (const bool alone : {true, false})
      if (const std::size_t c = best_peer(run, contestants, kind, alone); c < contestants.size())
        std::cout << (alone ? "best peer alone: " : "best peer of all: ") << contestants[c].name << ", "
                  << fixed(ratio_of(run.rows[c].total, run.rows[first].total).median, 2) << " times ours\n";
  }
}

void add_counts(Json& json, const QueryDifferences& d) {
  json["judged"] = d.queries;
  json["misses"] = d.misses;
  json["false_hits"] = d.false_hits;
  json["inexact_hits"] = d.inexact;
  json["threshold_hits"] = d.threshold;
  json["not_inside"] = d.not_inside;
  json["largest_error"] = d.largest_error;
}

Json row_json(const Run& run, const std::vector<Contestant>& contestants, std::size_t c) {
  const Contestant& contestant = contestants[c];
  const Row& row = run.rows[c];
  const Row& ours = run.rows[first_of(contestants, contestant.kind)];
  Json json;
  json["scene"] = run.scene;
  json["queries"] = name_of(contestant.kind);
  json["query_count"] = run.query_counts[static_cast<std::size_t>(
      std::find(std::begin(kKinds), std::end(kKinds), contestant.kind) - kKinds)];
  json["characters"] = run.character_count;
  json["setup"] = contestant.name;
  json["alone"] = contestant.alone;
  json["candidates"] = contestant.candidates;
  json["rounds"] = row.total.size();
  add_spread(json, "seconds", spread_of(row.total));
  add_spread(json, "seconds_update", spread_of(row.update));
  add_spread(json, "seconds_sort", spread_of(row.sort));
  add_spread(json, "seconds_query", spread_of(row.search));
  add_spread(json, "ratio", ratio_of(row.total, ours.total));
  add_spread(json, "ratio_query", ratio_of(row.search, ours.search));
  json["seconds_posing_spared"] = contestant.ours ? 0 : median(run.posing);
  json["hits"] = row.hits;
  json["differing"] = row.differing;
  add_counts(json, row.judged);
  return json;
}

}  // namespace

int queries_command(const PeersOptions& options) {
  // Refused by name, so that a build without the library says the same.
  if (std::count(options.peers.begin(), options.peers.end(), "ode") > 0)
    throw UsageError("--peers: ode answers no queries; choose fcl, bullet, embree");
  std::vector<Peer> peers = choose_peers(options.peers);
  const auto answers_none = [](const Peer& peer) { return !peer.version.empty() && peer.query_setups.empty(); };
  peers.erase(std::remove_if(peers.begin(), peers.end(), answers_none), peers.end());
  OutputFile json_file(options.json_path), csv_file(options.csv_path);
  print_libraries(peers);
  std::cout << "alone: by the library's own tests; the sum of cab includes posing, that of others not\n";
  const std::vector<Entrant> entrants = make_entrants(options, peers);
  std::vector<Contestant> contestants = make_contestants(entrants);
  for (const Contestant& c : contestants)
    std::cout << "  " << name_of(c.kind) << ", " << c.name << ": " << c.meaning << '\n';
  std::cout << '\n';
  for (const std::string& scene : options.scenes) verify(scene, entrants, contestants);
  print_verification(options, contestants);
  PeerResults results;
  for (const Contestant& contestant : contestants) {
    Json row;
    row["setup"] = contestant.name;
    row["queries"] = name_of(contestant.kind);
    row["alone"] = contestant.alone;
    row["candidates"] = contestant.candidates;
    row["meaning"] = contestant.meaning;
    row["hits"] = contestant.small.hits;
    add_counts(row, contestant.small);
    results.verification.push_back(row);
    results.right = results.right && (!contestant.ours || contestant.small.is_ours_right());
  }
  const std::vector<std::uint32_t> counts =
      options.character_counts.empty() ? std::vector<std::uint32_t>{kDefaultCharacters} : options.character_counts;
  for (const std::string& scene : options.scenes)
    for (const std::uint32_t count : counts) {
      const Run run = measure(scene, count, options, entrants, contestants);
      print_run(run, contestants);
      std::cout.flush();
      for (std::size_t c = 0; c < contestants.size(); ++c) {
        results.rows.push_back(row_json(run, contestants, c));
        results.right = results.right && (!contestants[c].ours || run.rows[c].judged.is_ours_right());
      }
      for (const QueryKind kind : kKinds)
        for (const bool alone : {true, false})
          if (const std::size_t c = best_peer(run, contestants, kind, alone); c < contestants.size())
            results.best.push_back(
                {{"scene", scene},
                 {"queries", name_of(kind)},
                 {"characters", count},
                 {"alone", alone},
                 {"setup", contestants[c].name},
                 {"ratio_median", ratio_of(run.rows[c].total, run.rows[first_of(contestants, kind)].total).median}});
    }
  return write_results(results, peers, "answers", json_file, csv_file);
}

}  // namespace cab::perf
