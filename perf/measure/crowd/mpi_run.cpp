#include "perf/measure/crowd/mpi_run.h"

#include <cab/cab.h>
#include <cab/mpi.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/hit_sum.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/measure/crowd/checkpoint.h"
#include "perf/measure/crowd/distributed_session.h"
#include "perf/measure/crowd/hit_file.h"
#include "perf/measure/crowd/rank_share.h"
#include "perf/measure/crowd/ranks.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKindNames[] = {"regions", "bounds", "requests", "poses"};  // in the order of RankTotals

void add_traffic(const mpi::Traffic& traffic, RankTotals& totals) {
  const mpi::MessageCount* const kinds[] = {&traffic.regions, &traffic.bounds, &traffic.requests, &traffic.poses};
  for (std::size_t k = 0; k < 4; ++k) {
    totals.messages[k] += kinds[k]->messages;
    totals.bytes[k] += kinds[k]->bytes;
  }
  totals.bounds_sent += traffic.bounds_sent;
  totals.poses_sent += traffic.poses_sent;
}

constexpr std::size_t kTotalsNumbers = sizeof(RankTotals) / sizeof(std::uint64_t);
static_assert(sizeof(RankTotals) % sizeof(std::uint64_t) == 0, "numbers of 64 bits alone");

std::vector<std::uint64_t> to_numbers(const std::vector<RankTotals>& totals) {
  std::vector<std::uint64_t> out(totals.size() * kTotalsNumbers);
  std::memcpy(out.data(), totals.data(), totals.size() * sizeof(RankTotals));
  return out;
}

std::vector<RankTotals> to_totals(const std::vector<std::uint64_t>& numbers) {
  std::vector<RankTotals> out(numbers.size() / kTotalsNumbers);
  std::memcpy(static_cast<void*>(out.data()), numbers.data(), out.size() * sizeof(RankTotals));
  return out;
}

// The bytes of the most memory that this process has had.
std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

// Where two texts of space-separated words first differ: "X, not Y".
std::string difference(const std::string& found, const std::string& expected) {
  const auto words_of = [](const std::string& text) {
    std::istringstream words(text);
    return std::vector<std::string>(std::istream_iterator<std::string>(words), {});
  };
  const std::vector<std::string> all_found = words_of(found), all_expected = words_of(expected);
  const auto [at, of] = std::mismatch(all_found.begin(), all_found.end(), all_expected.begin(), all_expected.end());
  constexpr std::size_t kMost = 60;
  const auto word = [](auto it, const std::vector<std::string>& words) {
    return it == words.end() ? std::string("nothing") : scenes::printable(it->substr(0, kMost));
  };
  return word(at, all_found) + ", not " + word(of, all_expected);
}

class Run {
 public:
  Run(const CrowdOptions& options, std::string program, const scenes::Crowd& crowd, const Ranks& ranks)
      : options_(options),
        program_(std::move(program)),
        crowd_(crowd),
        ranks_(ranks),
        session_(crowd, options, program_),
        share_(crowd, ranks) {}

  void run() {
    if (!options_.out_folder.empty()) resume();
    ProgressBar bar(ranks_.rank() == 0 ? "frames" : "", options_.frame_count);
    bar.advance(frame_);
    while (frame_ < options_.frame_count) {
      const double seconds = frame_ / kCrowdFramesPerSecond;
      // What follows from a frame alone is the same after a restart.
      if (frame_ % options_.checkpoint == 0) share_.cut(seconds);
      ranks_.together([&] { share_.pose(seconds); });
      run_frame();
      bar.advance(1);
      if (file_ && (frame_ % options_.checkpoint == 0 || frame_ == options_.frame_count)) keep();
    }
    all_ = gathered();
    const std::uint64_t own[] = {share_.count(), peak_memory()};
    const std::vector<std::uint64_t> numbers = ranks_.gather(own, 2, MPI_UINT64_T);
    for (std::size_t r = 0; r < all_.size(); ++r) {
      most_characters_ = std::max(most_characters_, numbers[2 * r]);
      peak_memory_ = std::max(peak_memory_, numbers[2 * r + 1]);
    }
  }

  // Every figure by its key, of all frames and ranks.
  Json to_json() const {
    Json json;
    json["cab_version"] = CAB_VERSION_STRING;
    json["scene"] = options_.scene;
    json["characters"] = crowd_.count();
    json["ranks"] = ranks_.count();
    json["most_characters_of_a_rank"] = most_characters_;
    json["frames"] = options_.frame_count;
    json["checkpoint"] = options_.checkpoint;
    json["frame_seconds_median"] = seconds_.empty() ? Json() : Json(median(seconds_));
    json["peak_bytes_of_a_rank"] = peak_memory_;
    const RankTotals sum = sum_of_all();
    json["hits"] = sum.hits;
    json["hits_sum"] = hex(sum.hits_sum);
    for (std::size_t k = 0; k < std::size(kKindNames); ++k) {
      json[std::string(kKindNames[k]) + "_messages"] = sum.messages[k];
      json[std::string(kKindNames[k]) + "_bytes"] = sum.bytes[k];
    }
    json["bounds_sent"] = sum.bounds_sent;
    json["poses_sent"] = sum.poses_sent;
    return json;
  }

  void print() const {
    std::cout << options_.scene << ": " << crowd_.count() << " characters on " << ranks_.count() << " ranks, "
              << options_.frame_count << " frames\n";
    const RankTotals sum = sum_of_all();
    const auto per_frame = [&](std::uint64_t all) { return fixed(static_cast<double>(all) / options_.frame_count, 1); };
    TextTable table;
    table.add_row({"sent per frame, all ranks", "messages", "bytes"});
    for (std::size_t k = 0; k < std::size(kKindNames); ++k)
      table.add_row({kKindNames[k], per_frame(sum.messages[k]), per_frame(sum.bytes[k])});
    table.print(std::cout);
    std::cout << "characters per frame whose bounds were sent: " << per_frame(sum.bounds_sent)
              << ", whose poses were sent: " << per_frame(sum.poses_sent)
              << "\nmost characters of a rank: " << most_characters_
              << ", most memory of a rank: " << fixed(static_cast<double>(peak_memory_) / (1 << 20), 0) << " MB\n";
    if (!seconds_.empty()) {
      const Spread spread = spread_of(seconds_);
      std::cout << "frame, on the slowest rank: " << fixed(1e3 * spread.median, 3) << " ms, "
                << fixed(1e3 * spread.least, 3) << " to " << fixed(1e3 * spread.most, 3) << '\n';
    }
    std::cout << "hits per frame: " << per_frame(sum.hits) << "\nsum over all frames' hits: " << hex(sum.hits_sum)
              << '\n';
  }

 private:
  RankTotals sum_of_all() const {
    const std::vector<std::uint64_t> numbers = to_numbers(all_);
    std::vector<std::uint64_t> sum(kTotalsNumbers);
    for (std::size_t i = 0; i < numbers.size(); ++i) sum[i % kTotalsNumbers] += numbers[i];
    return to_totals(sum).front();
  }

  std::string state_path() const { return options_.out_folder + "/state.json"; }

  // What an earlier run has left, or nothing.
  std::optional<Checkpoint> read_state() const {
    std::optional<Checkpoint> found = read_checkpoint(state_path());
    if (!found) return found;
    if (found->program != program_)
      throw std::runtime_error(state_path() + " is of another run (" + difference(found->program, program_) +
                               "); choose another folder, or remove it");
    if (found->ranks.size() != static_cast<std::size_t>(ranks_.count()))
      throw std::runtime_error(state_path() + " is of a run with " + std::to_string(found->ranks.size()) +
                               " ranks, not " + std::to_string(ranks_.count()));
    if (found->frames > options_.frame_count)
      throw std::runtime_error(state_path() + " is damaged: it has " + std::to_string(found->frames) + " frames of " +
                               std::to_string(options_.frame_count));
    return found;
  }

  // Refuses hits of which no state says from which run they are.
  void refuse_hits_without_state() const {
    for (const auto& entry : std::filesystem::directory_iterator(options_.out_folder)) {
      const std::string name = entry.path().filename().string();
      if (name.rfind("rank-", 0) == 0 && entry.path().extension() == ".hits" && entry.is_regular_file() &&
          entry.file_size() > 0)
        throw std::runtime_error(options_.out_folder + " has hits, in " + scenes::printable(name) +
                                 ", but no state.json; choose another folder, or remove them");
    }
  }

  // Opens this rank's file, where a checkpoint says that an earlier run has come to.
  void resume() {
    ranks_.together([&] { std::filesystem::create_directories(options_.out_folder); });
    const std::string path = options_.out_folder + "/rank-" + std::to_string(ranks_.rank()) + ".hits";
    // Rank 0 before the others: of two runs that begin at once one goes on, and one that is refused makes no files.
    std::optional<Checkpoint> found;
    ranks_.together([&] {
      if (ranks_.rank() != 0) return;
      file_ = std::make_unique<HitFile>(path);
      found = read_state();
    });
    ranks_.together([&] {
      if (ranks_.rank() != 0) file_ = std::make_unique<HitFile>(path);
    });
    Checkpoint checkpoint = found.value_or(Checkpoint());
    std::uint32_t state[] = {found ? 1u : 0u, checkpoint.frames};
    MPI_Bcast(state, 2, MPI_UINT32_T, 0, MPI_COMM_WORLD);
    checkpoint.ranks.resize(static_cast<std::size_t>(ranks_.count()));
    std::vector<std::uint64_t> numbers = to_numbers(checkpoint.ranks);
    MPI_Bcast(numbers.data(), static_cast<int>(numbers.size()), MPI_UINT64_T, 0, MPI_COMM_WORLD);
    totals_ = to_totals(numbers)[static_cast<std::size_t>(ranks_.rank())];
    frame_ = state[1];
    ranks_.together([&] {
      if (state[0] == 0) refuse_hits_without_state();
      file_->go_on_behind(totals_.hits, totals_.hits_sum);
    });
    // From now on the folder says of which run it is.
    if (state[0] == 0) keep();
    // A finished run has the shares of its last frame, whose sizes are printed.
    const std::uint32_t next = std::min(frame_, options_.frame_count - 1);
    if (next % options_.checkpoint != 0 || next < frame_)
      share_.cut((next - next % options_.checkpoint) / kCrowdFramesPerSecond);
    if (ranks_.rank() == 0 && frame_ > 0)
      std::cerr << "note: " << state_path() << " has " << frame_ << " frames; going on behind them\n";
  }

  void run_frame() {
    const double start = MPI_Wtime();
    const mpi::DistributedJob job = session_.run(share_, options_.policies);
    seconds_.push_back(ranks_.most(MPI_Wtime() - start));
    const RankTotals before = totals_;
    totals_.hits += job.hit_list.size;
    totals_.hits_sum += hits_sum(frame_, job.hit_list);
    add_traffic(job.traffic, totals_);
    if (file_) append(before, job.hit_list);
    ++frame_;
  }

  // A frame that cannot be written on some rank is taken back on all; those before it stay.
  void append(const RankTotals& before, Span<const Hit> hits) {
    try {
      ranks_.together([&] { file_->append(frame_, hits); });
    } catch (const AgreedFailure& failure) {
      totals_ = before;
      ranks_.together([&] { file_->cut_to(totals_.hits * sizeof(HitRecord)); });
      keep();
      throw AgreedFailure(std::string(failure.what()) + "; the first " + std::to_string(frame_) +
                          " frames are on disk, and the same command goes on behind them");
    }
  }

  // All frames so far are on the disks of all ranks before rank 0 says so.
  void keep() {
    ranks_.together([&] { file_->sync(); });
    Checkpoint checkpoint = {program_, frame_, gathered()};
    ranks_.together([&] {
      if (ranks_.rank() == 0) write_checkpoint(state_path(), checkpoint);
    });
  }

  std::vector<RankTotals> gathered() const {
    const std::vector<std::uint64_t> own = to_numbers({totals_});
    return to_totals(ranks_.gather(own.data(), own.size(), MPI_UINT64_T));
  }

  const CrowdOptions& options_;
  const std::string program_;
  const scenes::Crowd& crowd_;
  const Ranks& ranks_;
  DistributedSession session_;
  RankShare share_;
  std::unique_ptr<HitFile> file_;  // null: hits are only counted
  std::uint32_t frame_ = 0;
  RankTotals totals_;
  std::vector<double> seconds_;                          // of each frame of this process, on the slowest rank
  std::vector<RankTotals> all_;                          // of all ranks, at the end
  std::uint64_t most_characters_ = 0, peak_memory_ = 0;  // of a rank, likewise
};

// A number of what the groups are and of how some characters stand, which tells clips apart that differ between ranks.
std::uint64_t crowd_hash(const scenes::Crowd& crowd) {
  std::vector<scenes::PosedGroup> posed(crowd.groups.size());
  constexpr std::uint32_t kSome[] = {0, 1, 2, 3, 4, 5, 6, 7};
  for (std::size_t g = 0; g < posed.size(); ++g) {
    const std::size_t count = std::min<std::size_t>(std::size(kSome), crowd.groups[g].count);
    crowd.groups[g].pose(1, scenes::Chosen::of({kSome, count}), posed[g]);
  }
  return scenes::pose_hash(posed);
}

void run_on_all(const CrowdOptions& options, const std::string& program,
                const std::function<scenes::Crowd(bool quiet)>& make) {
  const Ranks ranks;
  // What decides where a rank writes and reads must be the same too, or one would wait for the others.
  const std::string own =
      program + " out=" + options.out_folder + " json=" + options.json_path + " csv=" + options.csv_path;
  const std::string first = ranks.text_of(0, own);
  ranks.together([&] {
    if (own != first) throw std::runtime_error("its options are not those of rank 0: " + difference(own, first));
  });
  std::optional<OutputFile> json, csv;
  ranks.together([&] {
    json.emplace(ranks.rank() == 0 ? options.json_path : "");
    csv.emplace(ranks.rank() == 0 ? options.csv_path : "");
  });
  scenes::Crowd crowd;
  ranks.together([&] { crowd = make(ranks.rank() != 0); });
  Run run(options, program + " crowd=" + hex(crowd_hash(crowd)), crowd, ranks);
  run.run();
  ranks.together([&] {
    if (ranks.rank() != 0) return;
    run.print();
    const Json figures = run.to_json();
    write_json(*json, figures);
    write_csv(*csv, {figures});
  });
}

}  // namespace

int run_by_mpi(const CrowdOptions& options, const std::string& program,
               const std::function<scenes::Crowd(bool quiet)>& make) {
  MPI_Init(nullptr, nullptr);
  int rank = 0, exit_code = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  try {
    run_on_all(options, program, make);
  } catch (const AgreedFailure& failure) {
    if (rank == 0) std::cerr << "cab: " << failure.what() << '\n';
    exit_code = 1;
  } catch (const std::exception& error) {
    // The others do not know of it, and would wait for this rank.
    std::cerr << "cab: rank " << rank << ": " << error.what() << std::endl;
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  MPI_Finalize();
  return exit_code;
}

}  // namespace cab::perf
