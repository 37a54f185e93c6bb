// Random worlds in an engine whose frames are recorded, and what is true of the recording.
#pragma once

#include <cab/record.h>
#include <cab/replay.h>
#include <doctest/doctest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "perf/harness/random_world.h"
#include "tests/rounds.h"

namespace cab::tests {

// A file that goes with the test. Tests may run at the same time, so each needs a name of its own, and so may two runs
// of one test.
class RecordingFile {
 public:
  explicit RecordingFile(const std::string& name)
      : path_((std::filesystem::temp_directory_path() /
               ("cab_test_" + name + "_" + std::to_string(std::random_device()()) + ".cab"))
                  .string()) {
    std::filesystem::remove(path_);
  }
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;
  ~RecordingFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  const char* path() const { return path_.c_str(); }
  std::vector<std::uint8_t> bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void write(const std::vector<std::uint8_t>& bytes) const {
    std::ofstream file(path_, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

 private:
  std::string path_;
};

// Checks a call of a recorder, recording or player, and shows its error.
template <class Object>
void must(const Object& object, bool ok) {
  INFO(std::string(object.error()));
  REQUIRE(ok);
}

// One frame that was recorded, with all that the recording must say of it.
struct WrittenFrame {
  oracle::World world;
  Policies policies;
  oracle::Outcome outcome;
};

// Tells a recorder what make_engine_for added to an engine: the batch of member m has the bare slot m + 1.
inline void tell(record::Recorder& recorder, const oracle::World& world) {
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    const oracle::Member& member = world.members[m];
    must(recorder, recorder.add_articulation({m + 1}, member.rig.desc(), {"rig", {}}));
    must(recorder, recorder.add_batch({m + 1}, {{m + 1}, member.poses.instance_count, member.kind}, {"member", {}}));
  }
}

// Runs a frame of a world, and records it.
inline oracle::Outcome run_recorded(Engine& engine, record::Recorder& recorder, const oracle::World& world,
                                    const Policies& policies, double time) {
  oracle::Outcome outcome = oracle::run_on(engine, world, policies);
  std::vector<BatchInput> inputs;
  for (std::size_t m = 0; m < world.members.size(); ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs.back().flags = outcome.flags[m];
    inputs.back().layers = world.members[m].layers;
    inputs.back().layer_masks = world.members[m].layer_masks;
  }
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = policies;
  job.margin = world.margin;
  job.min_depth = world.min_depth;
  job.hits = outcome.hits;
  job.contacts = outcome.contacts;
  job.hit_count = outcome.hits.size();
  job.stats = outcome.stats;
  must(recorder, recorder.add_frame(job, time));
  return outcome;
}

// Whether an array of a recorded frame is the one that was given: bit for bit, without gaps.
template <class T>
bool same_values(Span<const T> read, const std::vector<T>& given) {
  return read.size == given.size() &&
         (read.empty() || std::memcmp(read.data, given.data(), read.size * sizeof(T)) == 0);
}

inline bool same_hits_and_contacts(Span<const Hit> hits, Span<const Contact> contacts, const oracle::Outcome& outcome) {
  return same_values(hits, outcome.hits) && same_values(contacts, outcome.contacts);
}

}  // namespace cab::tests
