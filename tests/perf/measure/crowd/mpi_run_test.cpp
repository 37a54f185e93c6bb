// `mpirun -n RANKS cab crowd --mpi`: the hits of one process, and what is left after a rank dies or a disk is full.
#include <doctest/doctest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <tuple>
#include <vector>

#include "perf/measure/crowd/hit_file.h"
#include "tests/perf/cli/spawn.h"
#include "tests/perf/measure/crowd/sources.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// The words before those of mpirun's programs. In containers tests run as root.
Words mpirun_words() {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  return {"--oversubscribe"};
}

Words program(int ranks, const Words& words) { return Words{"-n", std::to_string(ranks)} + words; }
Words cab_crowd(const Words& options) { return Words{CAB_COMMAND, "crowd"} + options; }

Outcome by_ranks(int ranks, const Words& options) {
  return spawn(CAB_MPIEXEC, mpirun_words() + program(ranks, cab_crowd(options)));
}

Json figures(const Outcome& outcome, const std::string& path) {
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  return Json::parse(read_text(path));
}

// The run that faults break off: enough frames that a rank is killed in the middle of it.
constexpr int kRanks = 3;
const Words kLong = {"--scene", "uniform", "--characters", "1000", "--frames", "300", "--checkpoint", "5", "--mpi"};

std::string hits_of(const std::string& folder, int rank) {
  return read_text(folder + "/rank-" + std::to_string(rank) + ".hits");
}

std::uint32_t frames_of(const std::string& folder) { return Json::parse(read_text(folder + "/state.json"))["frames"]; }

// A run of three ranks, of which rank 1 may write files of so many KiB. Messages go through sockets then, since shared
// memory is a file too.
Outcome with_full_disk(std::uint64_t blocks, const Words& words) {
  setenv("PMIX_MCA_gds", "hash", 1);
  const std::string script = "ulimit -f " + std::to_string(blocks) + "; exec \"$@\"";
  const Words job = mpirun_words() + Words{"--mca", "btl", "self,tcp"} + program(1, words) + Words{":"} +
                    program(1, Words{"bash", "-c", script, "rank"} + words) + Words{":"} + program(1, words);
  Outcome outcome = spawn(CAB_MPIEXEC, job);
  unsetenv("PMIX_MCA_gds");
  return outcome;
}

void check_same_hits(const std::string& a, const std::string& b) {
  for (int rank = 0; rank < kRanks; ++rank) {
    CAPTURE(rank);
    CHECK(hits_of(a, rank) == hits_of(b, rank));
  }
}

}  // namespace

TEST_CASE("cab crowd --mpi: in every scene the ranks together find the hits of one process") {
  const Sources sources;
  const TemporaryFolder folder;
  const std::string json = folder / "figures.json";
  const Words clips = {"--clip", sources.anna, "--clip", sources.bert};
  const std::vector<std::pair<std::string, Words>> scenes = {
      {"uniform", {}},
      {"jitter", {"--exact", "convex"}},
      {"spot", {}},
      {"line", {}},
      {"giant", {}},
      {"detailed", {}},
      {"ropes", {"--shape", "braided"}},
      {"rigs", {}},
      {"skins", {"--exact", "surface"}},
      {"mixed", {"--refit", "aabb_hull"}},
      {"churn", {}},
      {"city", {}},
      {"level", {}},
      {"level", {"--level", "triangles"}},
      {"far", {}},
      {"battle", clips},
      {"bottleneck", clips + Words{"--trajectories", sources.ways}}};
  for (const auto& [name, more] : scenes) {
    const std::string scene = name;  // clang captures no structured binding
    CAPTURE(scene);
    const std::string characters = scene == "spot" ? "40" : "200";
    const Words options = Words{"--scene", scene, "--characters", characters, "--frames", "3", "--json", json} + more;
    const Words alone = scene == "city" ? Words{"--at-rest", "moved"} : Words{};
    const Json one = figures(run_command("crowd", options + alone + Words{"--rounds", "1"}), json);
    for (const int ranks : {1, 3}) {
      const Json all = figures(by_ranks(ranks, options + Words{"--mpi", "--checkpoint", "2"}), json);
      CHECK(all["hits"] == one["hits"]);
      CHECK(all["hits_sum"] == one["hits_sum"]);
      CHECK(all["ranks"] == ranks);
      if (ranks == 1) CHECK(all["bounds_sent"] == 0);
    }
  }
}

TEST_CASE("cab crowd --mpi: the files of all ranks, merged, are that of one rank") {
  const TemporaryFolder folder;
  const Words options = {"--scene", "level", "--characters", "300", "--frames", "4", "--mpi", "--out"};
  REQUIRE(by_ranks(1, options + Words{folder / "one"}).exit_code == 0);
  REQUIRE(by_ranks(kRanks, options + Words{folder / "all"}).exit_code == 0);
  std::string bytes;
  for (int rank = 0; rank < kRanks; ++rank) bytes += hits_of(folder / "all", rank);
  std::vector<perf::HitRecord> records(bytes.size() / sizeof(perf::HitRecord));
  std::memcpy(records.data(), bytes.data(), bytes.size());
  std::sort(records.begin(), records.end(), [](const perf::HitRecord& a, const perf::HitRecord& b) {
    const auto key = [](const perf::HitRecord& r) {
      return std::make_tuple(r.frame, r.hit.batch_a.value, r.hit.instance_a, r.hit.batch_b.value, r.hit.instance_b,
                             r.hit.link_a, r.hit.link_b);
    };
    return key(a) < key(b);
  });
  const std::string expected = hits_of(folder / "one", 0);
  REQUIRE(expected.size() == bytes.size());
  CHECK(std::memcmp(records.data(), expected.data(), expected.size()) == 0);
}

TEST_CASE("cab crowd --mpi: after a rank was killed, or a disk was full, the same command ends with the same hits") {
  const TemporaryFolder folder;
  const std::string reference = folder / "reference", killed = folder / "killed", full = folder / "full";
  const Outcome whole = by_ranks(kRanks, kLong + Words{"--out", reference});
  REQUIRE(whole.exit_code == 0);
  CHECK(frames_of(reference) == 300);

  {
    // Each rank writes its process's number before it becomes cab.
    const std::string script = "echo $$ >" + (folder / "pid") + ".$OMPI_COMM_WORLD_RANK; exec \"$@\"";
    const Words ranks =
        program(kRanks, Words{"bash", "-c", script, "rank"} + cab_crowd(kLong + Words{"--out", killed}));
    const pid_t job = start(CAB_MPIEXEC, mpirun_words() + ranks, folder / "killed.out", folder / "killed.error");
    const auto is_late = [end = std::chrono::steady_clock::now() + std::chrono::minutes(2)] {
      return std::chrono::steady_clock::now() > end;
    };
    // The file is there before the first frame, to say of which run the folder is.
    const auto has_frames = [&] { return std::filesystem::exists(killed + "/state.json") && frames_of(killed) > 0; };
    while (!has_frames() && !is_late()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(std::stoi(read_text((folder / "pid") + ".1")), SIGKILL);
    CHECK(exit_code_of(job) != 0);
    CHECK(read_text(folder / "killed.error").find("rank 1") != std::string::npos);
    CHECK(frames_of(killed) > 0);
    CHECK(frames_of(killed) < 300);
    const Outcome again = by_ranks(kRanks, kLong + Words{"--out", killed});
    CHECK(again.exit_code == 0);
    CHECK(again.error.find("going on behind them") != std::string::npos);
    check_same_hits(reference, killed);
  }

  {
    // Rank 1 may write a third of its file.
    const std::uint64_t blocks = hits_of(reference, 1).size() / 3 / 1024;
    const Outcome stopped = with_full_disk(blocks, cab_crowd(kLong + Words{"--out", full}));
    INFO(stopped.error);
    CHECK(stopped.exit_code != 0);
    CHECK(stopped.error.find("cab: rank 1: cannot write") != std::string::npos);
    CHECK(stopped.error.find("frames are on disk") != std::string::npos);
    const std::uint32_t frames = frames_of(full);
    CHECK(frames > 50);
    CHECK(frames < 150);
    for (int rank = 0; rank < kRanks; ++rank) CHECK(hits_of(reference, rank).rfind(hits_of(full, rank), 0) == 0);
    CHECK(by_ranks(kRanks, kLong + Words{"--out", full}).exit_code == 0);
    check_same_hits(reference, full);
  }

  // A run that has ended only tells once more what it found.
  const Outcome again = by_ranks(kRanks, kLong + Words{"--out", reference});
  CHECK(again.exit_code == 0);
  const std::string sum = "sum over all frames' hits: ";
  CHECK(again.out.substr(again.out.find(sum)) == whole.out.substr(whole.out.find(sum)));

  // A folder goes with its run.
  const Outcome fewer = by_ranks(2, kLong + Words{"--out", reference});
  CHECK(fewer.exit_code != 0);
  CHECK(fewer.error.find("is of a run with 3 ranks, not 2") != std::string::npos);
  const Outcome other = by_ranks(kRanks, kLong + Words{"--refit", "covariance", "--out", reference});
  CHECK(other.exit_code != 0);
  CHECK(other.error.find("is of another run") != std::string::npos);
  write_text(reference + "/state.json", "{");
  const Outcome broken = by_ranks(kRanks, kLong + Words{"--out", reference});
  CHECK(broken.exit_code != 0);
  CHECK(broken.error.find("is no checkpoint of this version") != std::string::npos);
}

TEST_CASE("cab crowd --mpi: a folder has one run at a time, and says of which run it is before the first frame") {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  const Words options = {"--scene", "uniform", "--characters", "600", "--frames", "2", "--mpi", "--out", out};
  const Words other = options + Words{"--refit", "covariance"};
  const auto refuses = [](const Outcome& outcome, const std::string& told) {
    INFO(outcome.error);
    CHECK(outcome.exit_code != 0);
    CHECK(outcome.error.find(told) != std::string::npos);
  };
  // No hit of rank 1 fits its disk.
  refuses(with_full_disk(1, cab_crowd(options)), "the first 0 frames are on disk");
  CHECK(frames_of(out) == 0);
  refuses(by_ranks(kRanks, other), "is of another run (refit=cab, not refit=covariance)");
  {
    const perf::HitFile held(out + "/rank-0.hits");
    refuses(by_ranks(kRanks, options), "cab: rank 0: another run writes to " + out + "/rank-0.hits");
  }
  CHECK(by_ranks(kRanks, options).exit_code == 0);
}

TEST_CASE("cab crowd --mpi: damage in a folder is told at a restart, and stays") {
  const TemporaryFolder folder;
  const std::string out = folder / "out", hits = out + "/rank-1.hits", state = out + "/state.json";
  const Words options = {"--scene", "uniform", "--characters", "600", "--frames", "2", "--mpi", "--out", out};
  REQUIRE(by_ranks(kRanks, options).exit_code == 0);
  const std::string good_hits = read_text(hits), good_state = read_text(state);
  REQUIRE(good_hits.size() > sizeof(perf::HitRecord));
  const auto refuses = [&](const std::string& told) {
    const Outcome outcome = by_ranks(kRanks, options);
    INFO(outcome.error);
    CHECK(outcome.exit_code != 0);
    CHECK(outcome.error.find(told) != std::string::npos);
  };
  std::string changed = good_hits;
  changed[changed.size() / 2] = static_cast<char>(changed[changed.size() / 2] ^ 1);
  write_text(hits, changed);
  refuses("cab: rank 1: " + hits + " is damaged");
  CHECK(read_text(hits) == changed);
  write_text(hits, good_hits);

  write_text(state, good_state.substr(0, good_state.find("\"frames\"")) + "\"frames\": -1" +
                        good_state.substr(good_state.find(",", good_state.find("\"frames\""))));
  refuses("frames is no number from 0 on");
  std::filesystem::remove(state);
  refuses("has hits, in rank-");
  CHECK(read_text(hits) == good_hits);
  write_text(state, good_state);
  CHECK(by_ranks(kRanks, options).exit_code == 0);
}

// docs/scale.md, "The model": what a metre of border between two regions of `uniform` sends in one frame.
struct Border {
  double bounds, poses;  // characters
  double bytes() const { return 24 * bounds + (4 + 4 + 448 + 24) * poses; }
};
Border model(double density, double width) {
  constexpr double kLargestWidth = 1.4;
  const double reach = 2 * width * density;
  return {density * (width + kLargestWidth) / 2, density * (width - (1 - std::exp(-reach * width)) / reach)};
}

TEST_CASE("cab crowd --mpi: what ranks send is within 1.3 of the model") {
  constexpr double kWithin = 1.3;
  const TemporaryFolder folder;
  const std::string json = folder / "figures.json";
  for (const double area : {.25, 1.0}) {
    CAPTURE(area);
    constexpr double kCharacters = 40000, kFrames = 2;
    const Words options = {"--scene",  "uniform", "--characters", "40000", "--area", std::to_string(area),
                           "--frames", "2",       "--json",       json};
    const Json one = figures(run_command("crowd", options + Words{"--rounds", "1"}), json);
    const double width = std::sqrt(one["candidates"].get<double>() / kFrames / kCharacters * area / 2);
    const Border expected = model(1 / area, width);
    for (const int ranks : {2, 4}) {
      CAPTURE(ranks);
      const Json all = figures(by_ranks(ranks, options + Words{"--mpi", "--checkpoint", "1"}), json);
      const double metres = (ranks == 2 ? 1 : 2) * std::sqrt(kCharacters * area) * kFrames;
      const auto ratio = [metres](double measured, double by_metre) { return measured / metres / by_metre; };
      const double bytes =
          all["bounds_bytes"].get<double>() + all["requests_bytes"].get<double>() + all["poses_bytes"].get<double>();
      for (const double off : {ratio(all["bounds_sent"], expected.bounds), ratio(all["poses_sent"], expected.poses),
                               ratio(bytes, expected.bytes())}) {
        CHECK(off < kWithin);
        CHECK(off > 1 / kWithin);
      }
    }
  }
}

TEST_CASE("cab crowd --mpi: ranks with different options, and a folder that cannot be made, are refused on all") {
  const TemporaryFolder folder;
  const Words one = {"--scene", "uniform", "--characters", "100", "--mpi"};
  const Words other = {"--scene", "uniform", "--characters", "101", "--mpi"};
  const Outcome differ =
      spawn(CAB_MPIEXEC, mpirun_words() + program(1, cab_crowd(one)) + Words{":"} + program(1, cab_crowd(other)));
  CHECK(differ.exit_code != 0);
  CHECK(differ.error.find("cab: rank 1: its options are not those of rank 0: characters=101, not characters=100\n") !=
        std::string::npos);

  // A folder on one rank alone: without an answer, that rank would wait for the others.
  const std::string out = folder / "out";
  const Outcome one_folder = spawn(CAB_MPIEXEC, mpirun_words() + program(1, cab_crowd(one + Words{"--out", out})) +
                                                    Words{":"} + program(1, cab_crowd(one)));
  CHECK(one_folder.exit_code != 0);
  CHECK(one_folder.error.find("cab: rank 1: its options are not those of rank 0: out=, not out=" + out + "\n") !=
        std::string::npos);
  CHECK(!std::filesystem::exists(out));

  write_text(folder / "file", "");
  const Outcome no_folder = by_ranks(2, one + Words{"--out", folder / "file"});
  CHECK(no_folder.exit_code != 0);
  CHECK(no_folder.error.find("cab: rank 0: ") != std::string::npos);
  CHECK(no_folder.error.find("file") != std::string::npos);

  const Outcome excluded = run_command("crowd", one + Words{"--rounds", "3"});
  CHECK(excluded.exit_code == 2);
  CHECK(excluded.error.find("--rounds") != std::string::npos);
  CHECK(run_command("crowd", {"--scene", "uniform", "--out", folder / "x"}).exit_code == 2);
}

}  // namespace cab::tests
