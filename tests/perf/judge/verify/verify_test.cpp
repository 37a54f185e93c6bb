// `cab verify`: its counts depend on seed and rounds alone, and it finds every fault that is planted.
#include "perf/judge/verify/verify.h"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "kernels/gather_pairs.h"
#include "kernels/refit_tree.h"
#include "kernels/surface/test_surfaces.h"
#include "layout/error_bounds.h"
#include "perf/judge/oracle/convex_pairs.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

// The JSON that the command writes, without the times.
Json counts_in(const std::string& path) {
  Json json = Json::parse(read_text(path));
  for (Json& part : json["parts"]) part.erase("seconds");
  return json;
}

struct Run {
  Outcome outcome;
  Json counts;
};

Run run_verify(const Words& options) {
  const TemporaryFolder folder;
  const std::string path = folder / "counts.json";
  Words words = {"--json", path};
  words.insert(words.end(), options.begin(), options.end());
  Run run;
  run.outcome = run_command("verify", words);
  INFO(run.outcome.error);
  REQUIRE(run.outcome.exit_code == 0);
  run.counts = counts_in(path);
  return run;
}

const Json& part_of(const Json& counts, const std::string& name) {
  for (const Json& part : counts["parts"])
    if (part["part"] == name) return part;
  throw std::runtime_error("no part " + name);
}

// The outcome of a run with broken kernels or a broken engine: of two rounds, or of some of the parts that are given.
struct Verdict {
  int exit_code;
  std::string text;
  Json counts;
};

Verdict verify_broken(const perf::Subject& subject, const Words& parts = {}, std::uint64_t rounds_of_parts = 3) {
  const TemporaryFolder folder;
  perf::VerifyOptions options;
  options.rounds = parts.empty() ? 2 : rounds_of_parts;
  options.parts = parts;
  options.thread_count = 1;
  options.json_path = folder / "counts.json";
  std::ostringstream out;
  const int exit_code = perf::verify(options, subject, out);
  return {exit_code, out.str(), counts_in(options.json_path)};
}

perf::VerifyOptions one_round_of_merges(const std::string& state) {
  perf::VerifyOptions options;
  options.rounds = 1;
  options.parts = {"merges"};
  options.thread_count = 1;
  options.resume_path = state;
  return options;
}

// The regimes of a part in which a method has violations.
std::set<std::string> broken_regimes(const Json& part, const std::string& method) {
  std::set<std::string> out;
  for (const Json& row : part["rows"])
    if (row["method"] == method && row["violations"] > 0) out.insert(row["regime"]);
  return out;
}

std::uint64_t violations_outside(const Json& counts, const std::string& name, const std::string& method) {
  std::uint64_t out = 0;
  for (const Json& part : counts["parts"])
    for (const Json& row : part["rows"])
      if (part["part"] != name || (!method.empty() && row["method"] != method))
        out += row["violations"].get<std::uint64_t>();
  return out;
}

const kernel::KernelTable& genuine() { return *kernel::find_kernels(Isa::kScalar); }

// The CAB merge, made smaller by twice its padding.
void refit_without_padding(const kernel::RefitTile& tile) {
  genuine().refit_boxes[0][0](tile);
  const std::uint32_t leaves = static_cast<std::uint32_t>(tile.program->steps.size) + 1;
  for (std::uint32_t node = leaves; node < 2 * leaves - 1; ++node) {
    BoxTile& box = tile.nodes[node];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      float place = 0, size = 0;
      for (int k = 0; k < 3; ++k) {
        place = std::max(place, std::fabs(box.center[k][lane]));
        size += box.half[k][lane];
      }
      const float padding = kMergePadSize * size + kMergePadCenter * place + kMergePadTiny;
      for (int k = 0; k < 3; ++k) box.half[k][lane] -= 2 * padding;
    }
  }
}

std::uint32_t overlap_without_lane_3(const kernel::BoxPairs<BoxAos>& pairs) {
  return genuine().overlap_boxes[0](pairs) & ~8u;
}

Status boxes_with_small_roots(Engine& engine, const BatchInput& input, const Policies& policies,
                              Span<Box> boxes) noexcept {
  const Status status = compute_boxes(engine, input, policies, boxes);
  ArticulationInfo info;
  if (status != Status::kOk || articulation_info(engine, {1}, &info) != Status::kOk) return status;
  for (std::size_t root = info.node_count - 1; root < boxes.size; root += info.node_count)
    for (float& half : boxes[root].half) half *= 0.9999f;
  return status;
}

// Overwrites the last of several hits with the one before it, in frames with these policies.
template <Strategy strategy, Exact exact>
Status frame_without_its_last_hit(Engine& engine, FrameJob& job) noexcept {
  const Status status = run_frame(engine, job);
  if (status == Status::kOk && job.policies.strategy == strategy && job.policies.exact == exact && job.hit_count > 1)
    job.hits[job.hit_count - 1] = job.hits[job.hit_count - 2];
  return status;
}

// The sum of a count over the rows of a part.
std::uint64_t sum_of(const Json& part, const std::string& count) {
  std::uint64_t out = 0;
  for (const Json& row : part["rows"]) out += row[count].get<std::uint64_t>();
  return out;
}

kernel::ConvexAnswer shapes_apart_in_lane_3(const kernel::ConvexBlock& block) {
  kernel::ConvexAnswer answer = genuine().test_convex_pairs(block);
  answer.apart |= 8u;
  answer.touching &= ~8u;
  return answer;
}

kernel::ConvexAnswer all_apart(const kernel::ConvexBlock&, std::uint32_t) { return {1, 0}; }
kernel::ConvexAnswer none_decided(const kernel::ConvexBlock&, std::uint32_t) { return {0, 0}; }

Status frame_with_depths_times(float factor, Engine& engine, FrameJob& job) noexcept {
  const Status status = run_frame(engine, job);
  for (std::size_t hit = 0; status == Status::kOk && hit < std::min(job.hit_count, job.contacts.size); ++hit)
    job.contacts[hit].depth *= factor;
  return status;
}

Status frame_with_shallow_contacts(Engine& engine, FrameJob& job) noexcept {
  return frame_with_depths_times(0.999f, engine, job);
}

Status frame_with_contacts_without_depth(Engine& engine, FrameJob& job) noexcept {
  return frame_with_depths_times(NAN, engine, job);
}

Status rows_with_a_wider_margin(Engine& engine, FrameJob& job) noexcept {
  const float margin = job.margin;
  if (job.policies.strategy == Strategy::kRows) job.margin = 2 * margin + 0.1f;
  const Status status = run_frame(engine, job);
  job.margin = margin;
  return status;
}

// Gives the root an infinite axis.
void refit_with_an_infinite_axis(const kernel::RefitTile& tile) {
  genuine().refit_boxes[0][0](tile);
  tile.nodes[2 * tile.program->steps.size].axis[0][0][0] = HUGE_VALF;
}

// Depths of so many parts of 100 000.
template <int parts>
void depths_off(const kernel::ConvexBlock& block, kernel::ConvexContacts& found) {
  genuine().contact_pairs(block, found);
  for (double& depth : found.depth) depth *= parts / 1e5;
}

void depths_off_within_margins(const kernel::ConvexBlock& block, kernel::ConvexContacts& found) {
  (block.margin[0] > 0 ? depths_off<99999> : genuine().contact_pairs)(block, found);
}

void normals_aside(const kernel::ConvexBlock& block, kernel::ConvexContacts& found) {
  genuine().contact_pairs(block, found);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) std::swap(found.normal[0][lane], found.normal[1][lane]);
}

// By a ten-thousandth of itself, and by a little for frames without one.
Status frame_with_a_wider_margin(Engine& engine, FrameJob& job) noexcept {
  const float margin = job.margin;
  job.margin = 1.0001f * margin + 1e-5f;
  const Status status = run_frame(engine, job);
  job.margin = margin;
  return status;
}

Status frame_with_another_leaf(Engine& engine, FrameJob& job) noexcept {
  const Status status = run_frame(engine, job);
  if (status == Status::kOk && job.hit_count > 0) job.hits[0].leaf_a ^= 1;
  return status;
}

Status frame_without_contact(Engine& engine, FrameJob& job) noexcept {
  const Status status = run_frame(engine, job);
  if (status == Status::kOk && job.report == Report::kInContact)
    std::fill_n(job.inputs[0].in_contact.data, job.inputs[0].in_contact.size, std::uint8_t{0});
  return status;
}

// Overwrites hits with those before them, if they are of the same query.
Status queries_without_a_hit(Engine& engine, QueryJob& job) noexcept {
  const Status status = run_queries(engine, job);
  for (std::size_t hit = job.hit_count; status == Status::kOk && hit-- > 1;)
    if (job.hits[hit].query == job.hits[hit - 1].query) job.hits[hit] = job.hits[hit - 1];
  return status;
}

// Moves hits a thousandth farther away.
Status queries_too_late(Engine& engine, QueryJob& job) noexcept {
  const Status status = run_queries(engine, job);
  for (std::size_t hit = 0; status == Status::kOk && hit < job.hit_count; ++hit) job.hits[hit].distance *= 1.001f;
  return status;
}

// Says of the first query that it finds the opposite.
Status queries_found_wrongly(Engine& engine, QueryJob& job) noexcept {
  const Status status = run_queries(engine, job);
  if (status == Status::kOk && !job.found.empty() && job.queries[0].want == QueryWant::kAny) job.found[0] ^= 1;
  return status;
}

// As one instruction set would answer otherwise.
Status queries_by_isa(Engine& engine, QueryJob& job) noexcept {
  const Status status = run_queries(engine, job);
  if (engine_isa(engine) != Isa::kScalar && status == Status::kOk && job.hit_count > 0) job.hits[0].leaf ^= 0x8000;
  return status;
}

// Hands triangles on, but for some.
struct SomeTaker {
  void* taker;
  TakeTouching take;
};
void triangles_without_some(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin,
                            SkinCache& cache, FrameStats& stats, void* taker, TakeTouching take) {
  SomeTaker some = {taker, take};
  find_touching_triangles(frame, a, b, margin, cache, stats, &some, [](void* of, std::uint32_t x, std::uint32_t y) {
    const SomeTaker& to = *static_cast<SomeTaker*>(of);
    return (x + y) % 4 == 3 || to.take(to.taker, x, y);
  });
}

// Says of the first triangles of every two leaves that they touch.
void triangles_with_the_first(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin,
                              SkinCache& cache, FrameStats& stats, void* taker, TakeTouching take) {
  find_touching_triangles(frame, a, b, margin, cache, stats, taker, take);
  take(taker, 0, 0);
}

// Leaves more pairs undecided than it must.
bool surfaces_with_more_error(const kernel::SurfacePair& pair, void* taker, kernel::TakeTriangles take) {
  kernel::SurfacePair other = pair;
  other.error *= 64;
  return genuine().test_surfaces(other, taker, take);
}

// Puts the first vertex an ulp away.
void skin_with_a_wrong_vertex(const kernel::SkinLeaf& args) {
  genuine().skin_leaf(args);
  float& x = args.out->vertices[0];
  x = std::nextafter(x, HUGE_VALF);
}

// Gives motions of one answer another one.
template <MotionAnswer kind, MotionAnswer instead>
Status motions_answered_wrongly(CollisionChecker& checker, Span<const double> from, Span<const double> to,
                                Span<MotionAnswer> answers, MotionSearch& search) {
  const Status status = checker.check_motions(from, to, answers, search);
  for (MotionAnswer& answer : answers)
    if (answer == kind) answer = instead;
  return status;
}

// Says of all first moments that they are at the beginning, or at the end.
template <int at>
Status motions_touch_at(CollisionChecker& checker, Span<const double> from, Span<const double> to,
                        Span<MotionAnswer> answers, MotionSearch& search) {
  const Status status = checker.check_motions(from, to, answers, search);
  for (double& moment : search.first_moments) moment = at;
  return status;
}

}  // namespace

TEST_CASE("a short run finds nothing, covers every row, and is the same on one thread and on two") {
  const Run one = run_verify({"--rounds", "2", "--seed", "5", "--threads", "1"});
  CHECK(one.counts["violations"] == 0);
  CHECK(one.counts["rounds"] == 2);
  for (const Json& part : one.counts["parts"]) {
    for (const Json& row : part["rows"]) {
      CAPTURE(row.dump());
      CHECK(row["judged"] > 0);
      if (part["part"] == "merges") {
        CHECK(row["judged"] == 2 * 32 * 16 * 3);  // rounds, tiles, lanes, merges
        CHECK(row["share_of_padding"] < 1);
        CHECK(row["share_of_padding"] > 0);
        CHECK(row["excess_ulps"] < 0);
      }
      if (part["part"] == "trees") CHECK(row["excess_ulps"] < 0);
      if (part["part"] == "shapes") {
        CHECK(row["judged"] == 2 * 2 * 16);
        CHECK(row["false_apart"] == 0);
        CHECK(row["differing"] == 0);
      }
      if (part["part"] == "overlaps") {
        CHECK(row["judged"] == 2 * 120 * 16);
        CHECK(row["touching"] > 2 * 120 * 16 / 2);
        CHECK(row["false_positives"] > 0);
      }
    }
  }
  // By ten regimes, and every oriented refit with both extents.
  CHECK(part_of(one.counts, "merges")["rows"].size() ==
        10 * 2 * std::extent_v<decltype(kernel::KernelTable::refit_boxes)>);
  // By twelve regimes, as leaves and as inner boxes, by every sat.
  CHECK(part_of(one.counts, "overlaps")["rows"].size() ==
        12 * 2 * std::extent_v<decltype(kernel::KernelTable::overlap_boxes)>);
  // By twelve regimes, and every two kinds but two half spaces.
  constexpr std::size_t kKinds = std::size(oracle::kCaseKinds);
  const Json& shapes = part_of(one.counts, "shapes");
  CHECK(shapes["rows"].size() == 12 * (kKinds * (kKinds + 1) / 2 - 1));
  CHECK(sum_of(shapes, "touching") > 0);
  CHECK(sum_of(shapes, "undecided") > 0);
  CHECK(sum_of(shapes, "contacts") > 0);
  // By ten regimes: six kinds about boxes and about shapes; each kind about boxes by what it wants.
  const Json& queries = part_of(one.counts, "queries");
  CHECK(queries["rows"].size() == 10 * 12);
  for (const char* name : {"queries", "rays", "spheres", "points", "boxes", "capsules", "regions"}) {
    const Json& part = part_of(one.counts, name);
    CHECK(sum_of(part, "touching") > 0);
    CHECK(sum_of(part, "hits") > 0);
    for (const char* none : {"lost", "false_positives", "differing"}) CHECK(sum_of(part, none) == 0);
    if (&part == &queries) continue;
    CHECK(part["rows"].size() == 10 * 3);
    CHECK(sum_of(part, "pairs") > 100 * sum_of(part, "judged") / 10);
    CHECK(sum_of(part, "undecided") > 0);
    CHECK(sum_of(part, "undecided") < sum_of(part, "pairs") / 10);
  }
  for (const Json& row : queries["rows"]) CHECK(row["off_u"] < 128);
  // By five regimes and three formats of poses.
  const Json& surfaces = part_of(one.counts, "surfaces");
  CHECK(surfaces["rows"].size() == 5 * 3);
  for (const Json& row : surfaces["rows"]) {
    CHECK(row["judged"] > 1000);
    CHECK(row["excess_ulps"] <= 0);
  }
  // By five regimes and seven ways of putting two leaves together.
  const Json& triangles = part_of(one.counts, "triangles");
  CHECK(triangles["rows"].size() == 5 * 7);
  CHECK(sum_of(triangles, "touching") > sum_of(triangles, "judged") / 20);
  for (const char* some : {"undecided", "undecided_by_judge"}) {
    CHECK(sum_of(triangles, some) > 0);
    CHECK(sum_of(triangles, some) < sum_of(triangles, "judged"));
  }
  for (const char* none : {"lost", "differing"}) CHECK(sum_of(triangles, none) == 0);
  for (const Json& row : triangles["rows"]) CHECK(row["widest_gap"] < 1);
  CHECK(one.outcome.out.find("0 violations") != std::string::npos);
  CHECK(run_verify({"--rounds", "2", "--seed", "5", "--threads", "2"}).counts == one.counts);
  CHECK(run_verify({"--rounds", "2", "--seed", "6", "--threads", "2"}).counts != one.counts);
}

TEST_CASE("the counts are the same on every instruction set") {
  Json expected = run_verify({"--rounds", "1", "--isa", "scalar"}).counts;
  expected.erase("isa");
  for (std::uint8_t i = 0; i < kIsaCount; ++i) {
    const Isa isa = static_cast<Isa>(i);
    if (isa == Isa::kAuto || !isa_available(isa)) continue;
    CAPTURE(to_string(isa));
    Json counts = run_verify({"--rounds", "1", "--isa", to_string(isa)}).counts;
    CHECK(counts["isa"] == to_string(isa));
    counts.erase("isa");
    CHECK(counts == expected);
  }
}

TEST_CASE("a run that is resumed ends as one that was not interrupted") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  const Json whole = run_verify({"--rounds", "2", "--threads", "2"}).counts;
  CHECK(run_verify({"--rounds", "1", "--resume", state}).counts["rounds"] == 1);
  CHECK(run_verify({"--rounds", "1", "--resume", state, "--threads", "2"}).counts == whole);
  CHECK(counts_in(state) == whole);
}

TEST_CASE("a part that runs alone counts what it counts among all, however often it is stopped") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  const Json whole = run_verify({"--rounds", "2", "--seed", "3"}).counts;
  const Words alone = {"--rounds", "1", "--part", "shapes", "--seed", "3", "--resume", state, "--threads"};
  const auto one_round = [&alone](const std::string& threads) {
    Words words = alone;
    words.push_back(threads);
    return run_verify(words).counts;
  };
  one_round("2");
  const Json counts = one_round("1");
  CHECK(counts["rounds"] == 2);
  CHECK(counts["parts"].size() == 1);
  CHECK(counts["parts"][0] == part_of(whole, "shapes"));
  const Outcome wrong = spawn(CAB_COMMAND, {"verify", "--part", "hulls"});
  CHECK(wrong.exit_code == 2);
  CHECK(wrong.error.find("--part: 'hulls' is not merges, overlaps, trees, frames, shapes, queries, rays, motions, "
                         "spheres, points, boxes, capsules, regions, surfaces, round, depths or triangles") !=
        std::string::npos);
}

TEST_CASE("a state of another seed, version or part, or of something else, is refused and left as it is") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  const Words first = {"--rounds", "1", "--part", "merges", "--resume", state};
  const auto again = [&first](const Words& more = {}) {
    Words words = {"verify"};
    words.insert(words.end(), first.begin(), first.end());
    words.insert(words.end(), more.begin(), more.end());
    return spawn(CAB_COMMAND, words);
  };
  run_verify(first);
  const std::string before = read_text(state);
  const Outcome other = again({"--seed", "2"});
  CHECK(other.exit_code == 1);
  CHECK(other.error.find("another --seed") != std::string::npos);
  CHECK(read_text(state) == before);
  const Outcome parts = again({"--part", "shapes"});
  CHECK(parts.exit_code == 1);
  CHECK(parts.error.find("other parts (--part)") != std::string::npos);
  Json aged = Json::parse(before);
  aged["version"] = "0.0.1";
  write_text(state, aged.dump());
  const Outcome old = again();
  CHECK(old.exit_code == 1);
  CHECK(old.error.find("another version of cab") != std::string::npos);
  CHECK(Json::parse(read_text(state)) == aged);
  CHECK(spawn(CAB_COMMAND, {"verify", "--round", "1", "--part", "merges", "--json", state}).exit_code == 0);
  const std::string of_one = read_text(state);
  CHECK(Json::parse(of_one)["rounds"] == 1);
  const Outcome alone = again();
  CHECK(alone.exit_code == 1);
  CHECK(alone.error.find("has the counts of one --round alone") != std::string::npos);
  CHECK(read_text(state) == of_one);
  write_text(state, "{\"version\": 1");
  const Outcome broken = again();
  CHECK(broken.exit_code == 1);
  CHECK(broken.error.find("is no file of cab verify") != std::string::npos);
}

TEST_CASE("a run that found an infinite figure is resumed") {
  kernel::KernelTable table = genuine();
  table.refit_boxes[0][0] = refit_with_an_infinite_axis;
  perf::Subject subject;
  subject.kernels = &table;
  const TemporaryFolder folder;
  const perf::VerifyOptions options = one_round_of_merges(folder / "state.json");
  std::ostringstream out;
  CHECK(perf::verify(options, subject, out) == 1);
  CHECK(perf::verify(options, subject, out) == 1);
  CHECK(counts_in(options.resume_path)["rounds"] == 2);
}

TEST_CASE("a state that cannot be written is refused before the first round") {
  static bool has_merged = false;
  kernel::KernelTable table = genuine();
  table.refit_boxes[0][0] = [](const kernel::RefitTile& tile) {
    has_merged = true;
    genuine().refit_boxes[0][0](tile);
  };
  perf::Subject subject;
  subject.kernels = &table;
  const TemporaryFolder folder;
  perf::VerifyOptions options = one_round_of_merges(folder / "no/state.json");
  std::ostringstream out;
  const std::string why = "cannot write " + options.resume_path + ": No such file or directory";
  CHECK_THROWS_WITH_AS(perf::verify(options, subject, out), why.c_str(), const std::runtime_error&);
  CHECK(!has_merged);
  options.resume_path = folder / "state.json";
  CHECK(perf::verify(options, subject, out) == 0);
  CHECK(has_merged);
}

TEST_CASE("a merge that misses its children by an ulp or more is found in every regime, with its input") {
  kernel::KernelTable table = genuine();
  table.refit_boxes[0][0] = refit_without_padding;
  perf::Subject subject;
  subject.kernels = &table;
  const Verdict verdict = verify_broken(subject);
  CHECK(verdict.exit_code == 1);
  CHECK(broken_regimes(part_of(verdict.counts, "merges"), "cab, children").size() == 10);
  CHECK(violations_outside(verdict.counts, "merges", "cab, children") == 0);
  CHECK(verdict.text.find("violation: merges, limbs, seed 1, round 0: a child sticks out") != std::string::npos);
  CHECK(verdict.text.find("half (") != std::string::npos);
}

TEST_CASE("a round that is run alone gives the violations that it gave among others") {
  kernel::KernelTable table = genuine();
  table.overlap_boxes[0] = overlap_without_lane_3;
  perf::Subject subject;
  subject.kernels = &table;
  perf::VerifyOptions options;
  options.parts = {"overlaps"};
  options.round = 1;
  std::ostringstream alone, other;
  CHECK(perf::verify(options, subject, alone) == 1);
  options.round = 0;
  perf::verify(options, subject, other);
  const auto finding = [](const std::string& text) {
    const std::size_t at = text.find("violation: overlaps");
    return at == std::string::npos ? std::string() : text.substr(at, text.find('\n', at) - at);
  };
  CHECK(finding(alone.str()).find("round 1") != std::string::npos);
  CHECK(finding(other.str()) == finding(verify_broken(subject, {"overlaps"}).text));
  CHECK(finding(other.str()) != "");
}

TEST_CASE("pairs that are lost are found in every regime, as leaves and as inner boxes") {
  kernel::KernelTable table = genuine();
  table.overlap_boxes[0] = overlap_without_lane_3;
  perf::Subject subject;
  subject.kernels = &table;
  const Verdict verdict = verify_broken(subject, {"merges", "overlaps"});
  CHECK(verdict.exit_code == 1);
  for (const char* use : {"leaves", "inner boxes"})
    CHECK(broken_regimes(part_of(verdict.counts, "overlaps"), use).size() == 12);
  CHECK(violations_outside(verdict.counts, "overlaps", "") == 0);
}

TEST_CASE("a hierarchy whose root is a little too small is found for every kind of articulation") {
  perf::Subject subject;
  subject.kernels = &genuine();
  subject.compute_boxes = boxes_with_small_roots;
  const Verdict verdict = verify_broken(subject, {"merges", "trees"});
  CHECK(verdict.exit_code == 1);
  CHECK(broken_regimes(part_of(verdict.counts, "trees"), "cab, leaves").size() == 5);
  CHECK(violations_outside(verdict.counts, "trees", "") == 0);
}

TEST_CASE("a hit that is lost is found, and is counted as a difference between strategies") {
  perf::Subject subject;
  subject.kernels = &genuine();
  subject.run_frame = frame_without_its_last_hit<Strategy::kTree, Exact::kNone>;
  const Verdict verdict = verify_broken(subject, {"trees", "frames"});
  CHECK(verdict.exit_code == 1);
  const Json& frames = part_of(verdict.counts, "frames");
  CHECK(broken_regimes(frames, "tree, cab, children").size() > 0);
  CHECK(broken_regimes(frames, "brute, cab").empty());
  CHECK(violations_outside(verdict.counts, "frames", "") == 0);
  for (const Json& row : frames["rows"])
    if (row["method"] == "tree, cab, children" && row["violations"] > 0) CHECK(row["differing"] > 0);
}

TEST_CASE("what rows find beyond brute is a violation") {
  perf::Subject subject;
  subject.kernels = &genuine();
  subject.run_frame = rows_with_a_wider_margin;
  const Verdict verdict = verify_broken(subject, {"frames"});
  CHECK(verdict.exit_code == 1);
  CHECK(verdict.text.find("rows and brute find other links; method rows") != std::string::npos);
  for (const Json& row : part_of(verdict.counts, "frames")["rows"])
    CHECK((row["violations"] > 0) == (row["method"].get<std::string>().rfind("rows", 0) == 0));
}

TEST_CASE("shapes that a kernel calls apart though they touch are found for every two kinds and in every regime") {
  kernel::KernelTable table = genuine();
  table.test_convex_pairs = shapes_apart_in_lane_3;
  perf::Subject subject;
  subject.kernels = &table;
  const Verdict verdict = verify_broken(subject, {"shapes"});
  CHECK(verdict.exit_code == 1);
  std::set<std::string> kinds, regimes;
  for (const Json& row : part_of(verdict.counts, "shapes")["rows"]) {
    if (row["false_apart"] == 0) continue;
    CHECK(row["differing"] > 0);
    kinds.insert(row["method"]);
    regimes.insert(row["regime"]);
  }
  constexpr std::size_t kKinds = std::size(oracle::kCaseKinds);
  CHECK(kinds.size() == kKinds * (kKinds + 1) / 2 - 1);
  CHECK(regimes.size() == 12);
  CHECK(verdict.text.find("violation: shapes, regular, seed 1, round 0: ") != std::string::npos);
}

TEST_CASE("wrong answers in double are found: apart for shapes that touch, and none for shapes that are far apart") {
  perf::Subject subject;
  subject.kernels = &genuine();
  subject.answer_in_double = all_apart;
  const Json apart = verify_broken(subject, {"shapes"}).counts["parts"][0];
  CHECK(sum_of(apart, "false_apart") > 0);
  CHECK(sum_of(apart, "violations") == sum_of(apart, "false_apart"));
  subject.answer_in_double = none_decided;
  const Json none = verify_broken(subject, {"shapes"}).counts["parts"][0];
  CHECK(sum_of(none, "still_undecided") == sum_of(none, "undecided"));
  CHECK(sum_of(none, "false_apart") == 0);
  CHECK(sum_of(none, "violations") > 0);
  double widest = 0;
  for (const Json& row : none["rows"]) widest = std::max(widest, row["widest_gap"].get<double>());
  CHECK(widest > 1);
}

TEST_CASE("contacts that are a thousandth too shallow are found") {
  perf::Subject subject;
  subject.kernels = &genuine();
  subject.run_frame = frame_with_shallow_contacts;
  const Verdict verdict = verify_broken(subject, {"shapes"});
  CHECK(verdict.exit_code == 1);
  CHECK(verdict.text.find("does not part the shapes") != std::string::npos);
}

TEST_CASE("depths that are too large or too small, and normals along which they do not part, are found for all kinds") {
  kernel::KernelTable table = genuine();
  perf::Subject subject;
  subject.kernels = &table;
  for (const auto broken : {depths_off<100001>, depths_off<99999>, normals_aside}) {
    table.contact_pairs = broken;
    const Verdict verdict = verify_broken(subject, {"depths"}, 1);
    CHECK(verdict.exit_code == 1);
    std::set<std::string> kinds;
    for (const Json& row : verdict.counts["parts"][0]["rows"])
      if (row["violations"] > 0) kinds.insert(row["method"]);
    CHECK(kinds.size() == 10);
  }
  CHECK(sum_of(verify_broken(subject, {"depths"}, 1).counts["parts"][0], "differing") > 0);
  table.contact_pairs = depths_off_within_margins;
  const Verdict within = verify_broken(subject, {"depths"}, 1);
  CHECK(within.exit_code == 1);
  CHECK(within.text.find("a margin changes contacts") != std::string::npos);
}

TEST_CASE("hits of balls and capsules that are lost, named wrongly, too many or off, and lost contact, are found") {
  perf::Subject subject;
  subject.kernels = &genuine();
  const auto wrong = [&subject](decltype(subject.run_frame) run_frame) {
    subject.run_frame = run_frame;
    const Verdict verdict = verify_broken(subject, {"round"}, 8);
    CHECK(verdict.exit_code == 1);
    CHECK(verdict.text.find("violation: round, ") != std::string::npos);
    return verdict.counts["parts"][0];
  };
  const Json lost = wrong(frame_without_its_last_hit<Strategy::kAuto, Exact::kConvex>);
  CHECK(broken_regimes(lost, "without boxes").size() == 7);
  CHECK(sum_of(lost, "lost") > 0);
  CHECK(sum_of(lost, "differing") > 0);
  const Json wide = wrong(frame_with_a_wider_margin);
  CHECK(sum_of(wide, "false_positives") > 0);
  CHECK(sum_of(wide, "lost") == 0);
  CHECK(broken_regimes(wide, "in contact").size() > 3);
  CHECK(broken_regimes(wrong(frame_with_another_leaf), "by boxes").size() == 7);
  CHECK(broken_regimes(wrong(frame_with_shallow_contacts), "without boxes").size() > 3);
  CHECK(broken_regimes(wrong(frame_with_contacts_without_depth), "without boxes").size() == 7);
  CHECK(broken_regimes(wrong(frame_without_contact), "in contact").size() == 7);
}

TEST_CASE("hits of queries that are lost, too far, or found by one instruction set alone, are found") {
  perf::Subject subject;
  subject.kernels = &genuine();
  const Words kParts = {"queries", "rays", "spheres", "points", "boxes", "capsules", "regions"};
  subject.run_queries = queries_without_a_hit;
  const Verdict lost = verify_broken(subject, kParts, 1);
  CHECK(lost.exit_code == 1);
  for (const Json& part : lost.counts["parts"]) {
    CHECK(sum_of(part, "lost") > 0);
    CHECK(sum_of(part, "violations") > 0);
  }
  CHECK(lost.text.find("violation: queries, aimed, seed 1, round 0: ") != std::string::npos);
  subject.run_queries = queries_too_late;
  const Verdict late = verify_broken(subject, kParts);
  CHECK(broken_regimes(part_of(late.counts, "queries"), "rays").size() > 5);
  for (const char* part : {"rays", "points"}) CHECK(broken_regimes(part_of(late.counts, part), "all").size() > 5);
  subject.run_queries = queries_found_wrongly;
  const Verdict found = verify_broken(subject, kParts, 1);
  for (const Json& part : found.counts["parts"]) CHECK(sum_of(part, "violations") > 0);
  for (const char* part : {"rays", "spheres", "points", "boxes", "capsules", "regions"}) {
    CHECK(broken_regimes(part_of(found.counts, part), "any").size() > 5);
    CHECK(broken_regimes(part_of(found.counts, part), "all").empty());
  }
  if (isa_available(Isa::kAuto) && kernel::find_kernels(Isa::kAuto)->isa == Isa::kScalar) return;
  subject.run_queries = queries_by_isa;
  const Verdict by_isa = verify_broken(subject, kParts, 1);
  for (const Json& part : by_isa.counts["parts"]) CHECK(sum_of(part, "differing") > 0);
}

TEST_CASE("motions called free that touch, touching or too close that do not, and wrong first moments are found") {
  perf::Subject subject;
  subject.kernels = &genuine();
  const Verdict right = verify_broken(subject, {"motions"}, 8);
  CHECK(right.exit_code == 0);
  const Json& motions = right.counts["parts"][0];
  for (const char* some : {"free", "colliding", "too_close", "touching"}) CHECK(sum_of(motions, some) > 0);
  CHECK(sum_of(motions, "undecided") < sum_of(motions, "judged") / 10);
  const auto wrong = [&subject](decltype(subject.check_motions) check_motions) {
    subject.check_motions = check_motions;
    const Verdict verdict = verify_broken(subject, {"motions"}, 8);
    CHECK(verdict.exit_code == 1);
    CHECK(verdict.text.find("violation: motions, ") != std::string::npos);
    CHECK(verdict.text.find(", seed 1, round ") != std::string::npos);
    return verdict.counts["parts"][0];
  };
  using Answer = MotionAnswer;
  const Json missed = wrong(motions_answered_wrongly<Answer::kColliding, Answer::kFree>);
  CHECK(sum_of(missed, "lost") == sum_of(motions, "touching"));
  CHECK(sum_of(missed, "false_positives") == 0);
  const Json alarms = wrong(motions_answered_wrongly<Answer::kFree, Answer::kColliding>);
  CHECK(sum_of(alarms, "false_positives") > 0);
  CHECK(sum_of(alarms, "lost") == 0);
  CHECK(sum_of(wrong(motions_answered_wrongly<Answer::kFree, Answer::kTooClose>), "violations") > 0);
  CHECK(sum_of(wrong(motions_answered_wrongly<Answer::kColliding, Answer::kTooClose>), "violations") > 0);
  for (const Json& moments : {wrong(motions_touch_at<0>), wrong(motions_touch_at<1>)}) {
    CHECK(broken_regimes(moments, "first, 1e-3").size() > 1);
    CHECK(broken_regimes(moments, "any, 1e-3").empty());
  }
}

TEST_CASE("triangles that are lost, or far apart and found, or by one instruction set alone, are found") {
  perf::Subject subject;
  subject.kernels = &genuine();
  const Json right = verify_broken(subject, {"triangles"}, 1).counts["parts"][0];
  CHECK(sum_of(right, "violations") == 0);
  subject.find_touching_triangles = triangles_without_some;
  const Verdict lost = verify_broken(subject, {"triangles"}, 1);
  CHECK(lost.exit_code == 1);
  CHECK(sum_of(lost.counts["parts"][0], "lost") > sum_of(right, "touching") / 8);
  CHECK(sum_of(lost.counts["parts"][0], "differing") == 0);
  CHECK(lost.text.find("violation: triangles, smooth, seed 1, round 0: triangles that touch are called apart; A: (") !=
        std::string::npos);
  subject.find_touching_triangles = triangles_with_the_first;
  const Json extra = verify_broken(subject, {"triangles"}, 1).counts["parts"][0];
  CHECK(sum_of(extra, "lost") == 0);
  CHECK(sum_of(extra, "false_positives") > sum_of(right, "false_positives"));
  for (const char* method : {"near", "corner", "along a plane", "one instance", "margin"})
    CHECK(broken_regimes(extra, method).size() > 2);
  subject.find_touching_triangles = perf::Subject().find_touching_triangles;
  kernel::KernelTable table = genuine();
  table.test_surfaces = surfaces_with_more_error;
  subject.kernels = &table;
  const Json differing = verify_broken(subject, {"triangles"}, 1).counts["parts"][0];
  CHECK(sum_of(differing, "differing") > 0);
  CHECK(sum_of(differing, "lost") == 0);
  CHECK(sum_of(differing, "violations") > 0);
  table = genuine();
  table.skin_leaf = skin_with_a_wrong_vertex;
  CHECK(sum_of(verify_broken(subject, {"triangles"}, 1).counts["parts"][0], "violations") > 0);
}

}  // namespace cab::tests
