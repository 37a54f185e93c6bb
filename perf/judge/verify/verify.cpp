// `cab verify`: runs rounds on any number of threads, sums their counts, and prints, saves and resumes them.
#include "perf/judge/verify/verify.h"

#include <cab/version.h>
#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "perf/base/report.h"
#include "perf/base/usage.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

// The number of violations whose input is kept and printed.
constexpr std::size_t kFindingsKept = 10;

// How often the file of --resume is written while rounds run.
constexpr double kSaveSeconds = 10;

// The largest figure of a file, since JSON has no infinity.
constexpr double kMostInJson = 1e300;

// The counts of one part: rows[regime * methods + method], seconds[regime] summed over threads. index: that of the part
// in verify_parts().
struct PartSums {
  std::size_t index;
  std::vector<Tally> rows;
  std::vector<double> seconds;
};

// The counts of all rounds before next_round, or of one round that ran alone.
struct Sums {
  std::uint64_t next_round = 0;
  std::vector<PartSums> parts;
  std::vector<std::string> findings;

  // Of the parts with these names; of all if there are none.
  explicit Sums(const std::vector<std::string>& names) {
    for (std::size_t p = 0; p < verify_parts().size(); ++p) {
      const VerifyPart& part = verify_parts()[p];
      if (!names.empty() && std::find(names.begin(), names.end(), part.name) == names.end()) continue;
      parts.push_back(
          {p, std::vector<Tally>(part.regimes.size() * part.methods.size()), std::vector<double>(part.regimes.size())});
    }
  }
  void add(const Sums& other) {
    for (std::size_t p = 0; p < parts.size(); ++p) {
      for (std::size_t r = 0; r < parts[p].rows.size(); ++r) parts[p].rows[r].add(other.parts[p].rows[r]);
      for (std::size_t r = 0; r < parts[p].seconds.size(); ++r) parts[p].seconds[r] += other.parts[p].seconds[r];
    }
    for (const std::string& finding : other.findings)
      if (findings.size() < kFindingsKept) findings.push_back(finding);
  }
  std::uint64_t violations() const {
    std::uint64_t out = 0;
    for (const PartSums& part : parts)
      for (const Tally& row : part.rows) out += row.violations;
    return out;
  }
};

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// The generator of one regime of one round. It is independent of those of other regimes and rounds.
oracle::Random random_of(std::uint64_t seed, std::uint64_t round, std::uint64_t part, std::uint64_t regime) {
  std::uint64_t state = seed;
  for (const std::uint64_t number : {round, part, regime}) state = oracle::Random(state).next_u64() ^ number;
  return oracle::Random(oracle::Random(state).next_u64());
}

Sums run_round(const Subject& subject, const VerifyOptions& options, std::uint64_t round) {
  const std::uint64_t seed = options.seed;
  Sums out(options.parts);
  for (PartSums& sums : out.parts) {
    const VerifyPart& part = verify_parts()[sums.index];
    for (std::size_t regime = 0; regime < part.regimes.size(); ++regime) {
      const auto start = Clock::now();
      Task task{
          &subject, regime, random_of(seed, round, sums.index, regime), std::vector<Tally>(part.methods.size()), {}};
      part.run(task);
      std::copy(task.tallies.begin(), task.tallies.end(),
                sums.rows.begin() + static_cast<std::ptrdiff_t>(regime * part.methods.size()));
      for (const std::string& finding : task.findings)
        out.findings.push_back(std::string(part.name) + ", " + part.regimes[regime] + ", seed " + std::to_string(seed) +
                               ", round " + std::to_string(round) + ": " + finding);
      sums.seconds[regime] = seconds_since(start);
    }
  }
  return out;
}

// ------------------------------------------------------------------------------------------- files

Json row_json(const std::string& regime, const std::string& method, const Tally& row) {
  Json json = {{"regime", regime}, {"method", method}};
  for (const NamedCount& each : kCounts) json[each.name] = row.*each.count;
  const auto finite = [](double value) { return std::clamp(value, -kMostInJson, kMostInJson); };
  for (const NamedValue& each : kMaxima) json[each.name] = finite(row.*each.value);
  for (const NamedValue& each : kWorstMerge) json[each.name] = finite(row.*each.value);
  return json;
}

Tally row_from(const Json& json) {
  Tally row;
  for (const NamedCount& each : kCounts) json.at(each.name).get_to(row.*each.count);
  for (const NamedValue& each : kMaxima) json.at(each.name).get_to(row.*each.value);
  for (const NamedValue& each : kWorstMerge) json.at(each.name).get_to(row.*each.value);
  return row;
}

// The document of both --json and --resume: what defines a run, and all its counts.
Json to_json(const VerifyOptions& options, Isa isa, const Sums& sums) {
  Json json = {{"version", CAB_VERSION_STRING},   {"seed", options.seed},
               {"isa", to_string(isa)},           {"rounds", options.round ? 1 : sums.next_round},
               {"violations", sums.violations()}, {"findings", sums.findings}};
  if (options.round) json["round"] = *options.round;
  for (const PartSums& each : sums.parts) {
    const VerifyPart& part = verify_parts()[each.index];
    Json rows = Json::array();
    for (std::size_t r = 0; r < each.rows.size(); ++r)
      rows.push_back(
          row_json(part.regimes[r / part.methods.size()], part.methods[r % part.methods.size()], each.rows[r]));
    json["parts"].push_back({{"part", part.name}, {"judged", part.judged}, {"rows", rows}, {"seconds", each.seconds}});
  }
  return json;
}

// Reads what an earlier run of the same seed, instruction set and rows has left.
Sums resume(const VerifyOptions& options, Isa isa) {
  const std::string& path = options.resume_path;
  Sums sums(options.parts);
  try {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot be read");
    const Json json = Json::parse(file);
    if (json.at("version") != CAB_VERSION_STRING) throw std::runtime_error("was written by another version of cab");
    if (json.at("seed") != options.seed) throw std::runtime_error("was written with another --seed");
    if (json.at("isa") != to_string(isa)) throw std::runtime_error("was written with another --isa");
    if (json.contains("round")) throw std::runtime_error("has the counts of one --round alone");
    json.at("rounds").get_to(sums.next_round);
    json.at("findings").get_to(sums.findings);
    const Json expected = to_json(options, isa, sums).at("parts");
    const auto is_same = [](const Json& left, const Json& right) { return left.at("part") == right.at("part"); };
    if (!std::equal(expected.begin(), expected.end(), json.at("parts").begin(), json.at("parts").end(), is_same))
      throw std::runtime_error("was written with other parts (--part)");
    for (std::size_t p = 0; p < sums.parts.size(); ++p) {
      const Json& part = json.at("parts").at(p);
      for (std::size_t r = 0; r < sums.parts[p].rows.size(); ++r) {
        const Json &row = part.at("rows").at(r), &wanted = expected.at(p).at("rows").at(r);
        if (row.at("regime") != wanted.at("regime") || row.at("method") != wanted.at("method"))
          throw std::runtime_error("has other rows");
        sums.parts[p].rows[r] = row_from(row);
      }
      part.at("seconds").get_to(sums.parts[p].seconds);
      if (sums.parts[p].seconds.size() != verify_parts()[sums.parts[p].index].regimes.size())
        throw std::runtime_error("has other rows");
    }
  } catch (const Json::exception&) {
    throw std::runtime_error(path + ": is no file of cab verify");
  } catch (const std::runtime_error& error) { throw std::runtime_error(path + ": " + error.what()); }
  return sums;
}

// ------------------------------------------------------------------------------------------ tables

// A column of a table: a count, or else a value, times a factor and with so many decimals.
struct Column {
  const char* title;
  std::uint64_t Tally::*count;
  double Tally::*value = nullptr;
  int decimals = 0;
  double factor = 1;
};

constexpr Column kViolations = {"violations", &Tally::violations}, kDiffering = {"differing", &Tally::differing},
                 kExcess = {"worst excess", nullptr, &Tally::excess, 2}, kAxes = {"axes, u", nullptr, &Tally::axes, 1},
                 kToFind = {"to find", &Tally::touching}, kHits = {"hits", &Tally::hits},
                 kLost = {"lost", &Tally::lost}, kExtra = {"extra", &Tally::false_positives},
                 kTouching = {"touching", &Tally::touching}, kOff = {"off, u", nullptr, &Tally::off, 2},
                 kWideAs = {"wide as", nullptr, &Tally::widest_gap, 3};

// Those between what was judged and the seconds.
std::vector<Column> columns_of(Columns columns) {
  switch (columns) {
    case Columns::kMerges:
      return {kViolations,
              kExcess,
              {"rounding", nullptr, &Tally::rounding, 2},
              {"of padding", nullptr, &Tally::padding, 2},
              {"used %", nullptr, &Tally::share, 1, 100},
              kAxes};
    case Columns::kBoxes: return {kViolations, kExcess, kAxes};
    case Columns::kShapes:
      return {kTouching,
              {"undecided", &Tally::undecided},
              {"in double", &Tally::still_undecided},
              {"false apart", &Tally::false_apart},
              {"false touching", &Tally::false_positives},
              kWideAs,
              kDiffering,
              {"contacts", &Tally::contacts},
              {"over 1 %", &Tally::above_1},
              {"over 10 %", &Tally::above_10},
              kViolations};
    case Columns::kQueries: return {kToFind, kHits, kLost, kExtra, kOff, kDiffering, kViolations};
    case Columns::kQuick:
      return {{"pairs", &Tally::pairs},
              {"in long double", &Tally::undecided},
              kToFind,
              kHits,
              kLost,
              kExtra,
              kDiffering,
              kViolations};
    case Columns::kMotions:
      return {kTouching,
              {"free", &Tally::free},
              {"colliding", &Tally::colliding},
              {"too close", &Tally::too_close},
              {"undecided", &Tally::undecided},
              {"missed", &Tally::lost},
              {"false", &Tally::false_positives},
              kViolations};
    case Columns::kRound:
      return {kTouching,  {"undecided", &Tally::undecided}, kLost, {"false touching", &Tally::false_positives},
              kWideAs,    {"contacts", &Tally::contacts},   kOff,  kDiffering,
              kViolations};
    case Columns::kDepths:
      return {kOff, {"over 1 %", &Tally::above_1}, {"over 10 %", &Tally::above_10}, kDiffering, kViolations};
    case Columns::kTriangles:
      return {kTouching,
              {"undecided", &Tally::undecided},
              kLost,
              {"false touching", &Tally::false_positives},
              {"wide as", nullptr, &Tally::widest_gap, 3},
              {"unclear", &Tally::unclear},
              kDiffering,
              kViolations};
    case Columns::kFrames:
      return {
          kTouching, {"misses", &Tally::lost}, {"false positives", &Tally::false_positives}, kDiffering, kViolations};
    case Columns::kPairs: break;
  }
  return {kTouching, {"misses", &Tally::violations}, {"false positives", &Tally::false_positives}, kDiffering};
}

std::vector<std::string> heading(const VerifyPart& part, const std::string& first) {
  std::vector<std::string> cells = {first, part.judged};
  for (const Column& column : columns_of(part.columns)) cells.emplace_back(column.title);
  cells.emplace_back("s");
  return cells;
}

std::vector<std::string> line(const VerifyPart& part, const std::string& name, const Tally& row,
                              const std::string& seconds) {
  std::vector<std::string> cells = {name, std::to_string(row.judged)};
  for (const Column& column : columns_of(part.columns)) {
    const double value = column.value != nullptr ? column.factor * row.*column.value : 0;
    cells.push_back(column.count != nullptr ? std::to_string(row.*column.count)
                    : value > -1e299        ? fixed(value, column.decimals)
                                            : "-");
  }
  cells.push_back(seconds);
  return cells;
}

void print_part(const VerifyPart& part, const PartSums& sums, std::ostream& out) {
  const std::size_t methods = part.methods.size();
  Tally all;
  double seconds = 0;
  TextTable by_regime, by_method;
  by_regime.add_row(heading(part, std::string(part.name) + " by regime"));
  for (std::size_t r = 0; r < part.regimes.size(); ++r) {
    Tally row;
    for (std::size_t m = 0; m < methods; ++m) row.add(sums.rows[r * methods + m]);
    by_regime.add_row(line(part, part.regimes[r], row, fixed(sums.seconds[r], 1)));
    all.add(row);
    seconds += sums.seconds[r];
  }
  by_regime.add_row(line(part, "all", all, fixed(seconds, 1)));
  by_method.add_row(heading(part, std::string(part.name) + " by method"));
  for (std::size_t m = 0; m < methods; ++m) {
    Tally row;
    for (std::size_t r = 0; r < part.regimes.size(); ++r) row.add(sums.rows[r * methods + m]);
    by_method.add_row(line(part, part.methods[m], row, "-"));
  }
  by_regime.print(out);
  out << '\n';
  by_method.print(out);
  out << '\n';
}

void print(std::uint64_t seed, Isa isa, std::uint64_t rounds, const Sums& sums, std::ostream& out) {
  for (const PartSums& part : sums.parts) print_part(verify_parts()[part.index], part, out);
  out << "Excess: how far a corner leaves its box, in ulps of size u (S + M), u = 2^-24; below 0 it is inside.\n"
         "Rounding, of padding: where rounding took the largest share of a merge's padding, which bounds it; in ulps.\n"
         "Undecided: by the kernels, in double: after the second pass. Wide as: the widest gap of a false touch, of "
         "2^-40. Of motions: too near to touching for the judge.\n"
         "Unclear: triangles within 1e-15 of touching, which the judge cannot tell; lost if they are called apart.\n"
         "Off: how far the point of a hit is from its leaf as given, in u of the lengths of leaf and query; how far a "
         "depth is from the true one, in u of the lengths of both shapes.\n"
      << "Seed " << seed << ", " << to_string(isa) << ", " << rounds << " rounds, " << sums.violations()
      << " violations.\n";
  for (const std::string& finding : sums.findings) out << "violation: " << finding << '\n';
  if (!sums.findings.empty()) out << "To replay round K alone: cab verify --seed " << seed << " --round K\n";
}

// ------------------------------------------------------------------------------------------ rounds

// Gives rounds to threads, and adds up their counts in the order of their numbers. So the sums do not depend on the
// number of threads.
class Rounds {
 public:
  Rounds(const VerifyOptions& options, const Subject& subject, Sums& sums)
      : options_(options),
        subject_(subject),
        sums_(sums),
        next_(sums.next_round),
        end_(options.rounds ? next_ + *options.rounds : UINT64_MAX),
        limit_(60 * options.minutes),
        bar_("verify", options.rounds ? *options.rounds : static_cast<std::uint64_t>(limit_)) {}

  void run(unsigned thread_count) {
    std::vector<std::thread> threads;
    for (unsigned t = 1; t < thread_count; ++t) threads.emplace_back([this] { work(); });
    work();
    for (std::thread& thread : threads) thread.join();
    if (failed_) std::rethrow_exception(failed_);
  }

 private:
  void work() {
    try {
      for (;;) {
        std::uint64_t round;
        {
          const std::lock_guard lock(mutex_);
          const bool late = !options_.rounds && seconds_since(start_) >= limit_;
          if (next_ == end_ || late || failed_) return;
          round = next_++;
        }
        Sums one = run_round(subject_, options_, round);
        const std::lock_guard lock(mutex_);
        done_.emplace(round, std::move(one));
        add_up();
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failed_ = std::current_exception();
    }
  }

  void add_up() {
    for (auto first = done_.begin(); first != done_.end() && first->first == sums_.next_round; first = done_.begin()) {
      sums_.add(first->second);
      ++sums_.next_round;
      done_.erase(first);
      if (options_.rounds) bar_.advance(1);
    }
    const auto seconds = static_cast<std::uint64_t>(seconds_since(start_));
    if (!options_.rounds) bar_.advance(seconds - shown_seconds_);
    shown_seconds_ = seconds;
    if (options_.resume_path.empty() || seconds_since(saved_) < kSaveSeconds) return;
    write_json(options_.resume_path, to_json(options_, subject_.kernels->isa, sums_));
    saved_ = Clock::now();
  }

  const VerifyOptions& options_;
  const Subject& subject_;
  Sums& sums_;
  std::mutex mutex_;
  std::map<std::uint64_t, Sums> done_;  // rounds that wait for one before them
  std::uint64_t next_, end_;
  double limit_;  // seconds
  ProgressBar bar_;
  std::uint64_t shown_seconds_ = 0;
  Clock::time_point start_ = Clock::now(), saved_ = start_;
  std::exception_ptr failed_;
};

unsigned thread_count_of(const VerifyOptions& options) {
  return options.thread_count != 0 ? options.thread_count : std::max(1u, std::thread::hardware_concurrency());
}

}  // namespace

int verify(const VerifyOptions& options, const Subject& subject, std::ostream& out) {
  OutputFile counts(options.json_path);
  const Isa isa = subject.kernels->isa;
  Sums sums(options.parts);
  std::uint64_t rounds;
  if (options.round) {
    sums.add(run_round(subject, options, *options.round));
    rounds = 1;
  } else {
    const bool resumes = !options.resume_path.empty() && std::filesystem::exists(options.resume_path);
    if (resumes) sums = resume(options, isa);
    if (!options.resume_path.empty()) FileAside{options.resume_path};  // throws now what the first save would throw
    Rounds(options, subject, sums).run(thread_count_of(options));
    if (!options.resume_path.empty()) write_json(options.resume_path, to_json(options, isa, sums));
    rounds = sums.next_round;
  }
  print(options.seed, isa, rounds, sums, out);
  write_json(counts, to_json(options, isa, sums));
  return sums.violations() == 0 ? 0 : 1;
}

int verify_command(const VerifyOptions& options) {
  check_outputs({{"--json", options.json_path}, {"--resume", options.resume_path}}, {});
  Subject subject;
  subject.kernels = kernel::find_kernels(options.isa);
  return verify(options, subject, std::cout);
}

}  // namespace cab::perf
