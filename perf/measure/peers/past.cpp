// `cab peers --past`: shots at past moments, as a shooter's server judges them. No other library here keeps moments, so
// the engine is measured alone, beside the judge.
#include "perf/measure/peers/past.h"

#include <cab/cab.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/processor_time.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/judge/oracle/random.h"
#include "perf/measure/peers/query_check.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kBoxes = 20, kTicks = 64;  // of a player; that are kept
constexpr std::uint32_t kTicksPerRound = 30;

// Players on a square, ticks in a second, shots in a call, calls in a tick, and how many shots are judged by brute
// force over all leaves.
struct Plan {
  std::uint32_t players;
  double side;  // metres
  std::uint32_t rate, shots, calls, judged;
};
constexpr Plan kPlans[] = {{100, 60, 64, 64, 8, 256}, {100, 20, 64, 64, 8, 256}, {1000, 190, 60, 2000, 1, 32}};

struct Moment {
  double time;
  scenes::PosedGroup posed;
};

// The players at a time between the first and the last of some moments, by docs/rewind.md, in double until the end.
scenes::PosedGroup between(const std::deque<Moment>& kept, double time) {
  const auto to = std::find_if(kept.begin() + 1, kept.end() - 1, [&](const Moment& m) { return m.time >= time; });
  const Moment &a = *(to - 1), &b = *to;
  const double t = std::clamp((time - a.time) / (b.time - a.time), 0.0, 1.0);
  scenes::PosedGroup out = a.posed;
  for (std::size_t i = 0; i < out.origins.size(); ++i) out.origins[i] += t * (b.posed.origins[i] - a.posed.origins[i]);
  for (std::size_t link = 0; link < out.poses.size(); link += 7) {
    double from[7], into[7], length_from = 0, length_into = 0, cosine = 0, length = 0;
    for (std::size_t f = 0; f < 7; ++f) {
      from[f] = static_cast<double>(a.posed.poses[link + f]);
      into[f] = static_cast<double>(b.posed.poses[link + f]);
      if (f >= 4) continue;
      length_from += from[f] * from[f];
      length_into += into[f] * into[f];
      cosine += from[f] * into[f];
    }
    for (std::size_t f = 0; f < 4; ++f) {
      from[f] /= std::sqrt(length_from);
      into[f] /= std::copysign(std::sqrt(length_into), cosine);
    }
    for (std::size_t f = 0; f < 7; ++f) from[f] += t * (into[f] - from[f]);
    for (std::size_t f = 0; f < 4; ++f) length += from[f] * from[f];
    for (std::size_t f = 0; f < 7; ++f)
      out.poses[link + f] = static_cast<float>(f < 4 ? from[f] / std::sqrt(length) : from[f]);
  }
  return out;
}

// Players with a history, and who shoots at whom.
class Game {
 public:
  Game(const Plan& plan, Isa isa) : plan_(plan), random_(5), hits_(plan.shots) {
    scenes::CrowdSources sources;
    sources.rig_links = kBoxes;
    sources.area = plan.side * plan.side / plan.players;
    crowd_ = scenes::make_rigs(plan.players, sources);
    EngineDesc desc;
    desc.isa = isa;
    desc.thread_count = 1;
    engine_ = make_engine(desc);
    const BatchDesc batch = {add_character(*engine_, crowd_.groups[0].figure), plan.players};
    require(add_batch(*engine_, batch, &players_), "players");
    ReserveDesc room;
    room.queries = plan.shots;
    require(reserve(*engine_, room), "room for shots");
    require(add_history(*engine_, {players_, kTicks}, &history_), "history");
  }

  const scenes::Crowd& crowd() const { return crowd_; }
  const std::deque<Moment>& kept() const { return kept_; }

  // Moves the players on and records them. Returns the processor seconds of the recording.
  double record() {
    kept_.push_back({++tick_ / static_cast<double>(plan_.rate), {}});
    if (kept_.size() > kTicks) kept_.pop_front();
    Moment& now = kept_.back();
    crowd_.groups[0].pose(now.time, scenes::Chosen::all(plan_.players), now.posed);
    const double start = processor_seconds();
    require(record_tick(*engine_, history_, input_of(now.posed, players_), now.time), "tick");
    return processor_seconds() - start;
  }

  // A player shoots from 1.6 m up at about where another is, and saw the others up to a second ago.
  std::vector<Query> shots() {
    const Moment& now = kept_.back();
    std::vector<Query> out(plan_.shots);
    for (Query& shot : out) {
      const auto from = static_cast<std::uint32_t>(random_.index(plan_.players));
      const std::size_t to = (from + 1 + random_.index(plan_.players - 1)) % plan_.players;
      shot.time = random_.uniform(std::max(now.time - 1, kept_.front().time), now.time);
      shot.position[2] = 1.6;
      for (std::size_t c = 0; c < 2; ++c) {
        shot.position[c] = now.posed.origins[3 * std::size_t{from} + c];
        const double aim = now.posed.origins[3 * to + c] + random_.uniform(-0.6, 0.6);
        shot.direction[c] = static_cast<float>(aim - shot.position[c]);
      }
      shot.direction[2] = static_cast<float>(random_.uniform(-1.4, 0.2));
      shot.length = 100;
      shot.ignored_batch = players_;
      shot.ignored_instance = from;
    }
    return out;
  }

  // The hits stay until the next call.
  Span<const QueryHit> ask(Span<const Query> shots) {
    QueryJob job;
    job.queries = shots;
    job.histories = {&history_, 1};
    job.hits = {hits_.data(), hits_.size()};
    require(run_queries(*engine_, job), "shots");
    return {hits_.data(), job.hit_count};
  }

 private:
  Plan plan_;
  oracle::Random random_;
  scenes::Crowd crowd_;
  oracle::EnginePtr engine_;
  BatchId players_;
  HistoryId history_;
  std::deque<Moment> kept_;
  std::uint32_t tick_ = 0;
  std::vector<QueryHit> hits_;
};

struct Row {
  Plan plan;
  std::vector<double> record, shot, tick;  // processor seconds: of a recording, per shot of a call, of all in a tick
  std::uint64_t differing = 0;             // shots that alone are answered by other bits
  QueryDifferences judged = {};

  double core_share() const { return median(tick) * plan.rate; }
  bool is_right() const { return differing == 0 && judged.is_ours_right(); }
};

// Whether two hits of one query are the same bit by bit.
bool is_same(QueryHit a, QueryHit b) {
  return a.instance == b.instance && a.link == b.link && a.leaf == b.leaf && a.inside == b.inside &&
         std::memcmp(&a.distance, &b.distance, sizeof a.distance) == 0 &&
         std::memcmp(a.point, b.point, sizeof a.point) == 0 && std::memcmp(a.normal, b.normal, sizeof a.normal) == 0;
}

// Compares a call's answers with those of a call for each shot, and `judged` of them with the judge's.
void check(Game& game, std::uint32_t judged, Row& row) {
  const std::vector<Query> shots = game.shots();
  const Span<const QueryHit> found = game.ask({shots.data(), shots.size()});
  const std::vector<QueryHit> hits(found.begin(), found.end());
  const CrowdLeaves leaves(game.crowd());
  Answers answers;
  answers.clear(shots.size());
  auto hit = hits.begin();
  for (std::uint32_t i = 0; i < shots.size(); ++i) {
    const bool is_hit = hit != hits.end() && hit->query == i;
    const Span<const QueryHit> alone = game.ask({&shots[i], 1});
    row.differing += alone.size != is_hit || (is_hit && !is_same(*hit, alone[0]));
    if (!is_hit) continue;
    answers.distances[i] = hit->distance;
    answers.leaves[i] = leaves.number_of(hit->batch.value - 1, hit->instance, hit->leaf);
    ++hit;
  }
  for (std::uint32_t i = 0; i < std::min<std::size_t>(judged, shots.size()); ++i) {
    const QueryCheck judge(game.crowd(), {between(game.kept(), shots[i].time)});
    add_differences(judge.judge(shots[i], 0), QueryKind::kRay, answers, i, row.judged);
  }
}

Row measure(const Plan& plan, const PeersOptions& options) {
  Row row;
  row.plan = plan;
  Game game(plan, options.isa);
  ProgressBar bar(std::to_string(plan.players) + " players", kTicks + options.rounds * kTicksPerRound + plan.judged);
  for (std::uint32_t tick = 0; tick < kTicks + options.rounds * kTicksPerRound; ++tick) {
    double seconds = game.record();
    const double record = seconds;
    for (std::uint32_t call = 0; call < plan.calls; ++call) {
      const std::vector<Query> shots = game.shots();
      const double start = processor_seconds();
      game.ask({shots.data(), shots.size()});
      const double asked = processor_seconds() - start;
      seconds += asked;
      if (tick >= kTicks) row.shot.push_back(asked / plan.shots);
    }
    bar.advance(1);
    if (tick < kTicks) continue;  // the ring fills
    row.record.push_back(record);
    row.tick.push_back(seconds);
  }
  while (row.judged.queries < plan.judged) check(game, plan.judged, row);
  return row;
}

Json row_json(const Row& row) {
  Json json;
  json["players"] = row.plan.players;
  json["side"] = row.plan.side;
  json["ticks_per_second"] = row.plan.rate;
  json["shots_per_call"] = row.plan.shots;
  json["shots_per_tick"] = row.plan.shots * row.plan.calls;
  add_spread(json, "seconds_record", spread_of(row.record));
  add_spread(json, "seconds_shot", spread_of(row.shot));
  add_spread(json, "seconds_tick", spread_of(row.tick));
  json["core_share"] = row.core_share();
  json["differing_alone"] = row.differing;
  json["judged"] = row.judged.queries;
  json["hits"] = row.judged.hits;
  json["misses"] = row.judged.misses;
  json["false_hits"] = row.judged.false_hits;
  json["inexact_hits"] = row.judged.inexact;
  json["threshold_hits"] = row.judged.threshold;
  json["not_inside"] = row.judged.not_inside;
  return json;
}

}  // namespace

int past_command(const PeersOptions& options) {
  OutputFile json_file(options.json_path), csv_file(options.csv_path);
  std::cout << "shots at any time of the last second; players of " << kBoxes << " boxes, " << kTicks
            << " ticks kept; one thread; processor time, medians of " << options.rounds * kTicksPerRound << " ticks:\n";
  TextTable table;
  table.add_row({"", "shots", "record, us", "a shot, us", "least", "most", "a tick, us", "of a core, %", "judged",
                 "hits", "misses", "false hits", "inexact", "at threshold", "differ alone"});
  std::vector<Json> rows;
  bool is_right = true;
  for (const Plan& plan : kPlans) {
    const Row row = measure(plan, options);
    const std::string side = fixed(plan.side, 0);
    const Spread shot = spread_of(row.shot);
    std::vector<std::string> cells = {
        std::to_string(plan.players) + " players, " + side + " x " + side + " m, " + std::to_string(plan.rate) + " Hz",
        std::to_string(plan.calls) + " x " + std::to_string(plan.shots), fixed(1e6 * median(row.record), 1)};
    for (const double value : {shot.median, shot.least, shot.most}) cells.push_back(fixed(1e6 * value, 2));
    cells.push_back(fixed(1e6 * median(row.tick), 0));
    cells.push_back(fixed(100 * row.core_share(), 1));
    for (const std::uint64_t count : {row.judged.queries, row.judged.hits, row.judged.misses, row.judged.false_hits,
                                      row.judged.inexact, row.judged.threshold, row.differing})
      cells.push_back(std::to_string(count));
    table.add_row(std::move(cells));
    rows.push_back(row_json(row));
    is_right = is_right && row.is_right();
  }
  table.print(std::cout);
  write_json(json_file, {{"runs", rows}});
  write_csv(csv_file, rows);
  return is_right ? 0 : 1;
}

}  // namespace cab::perf
