// What `cab query` accepts.
#pragma once

#include <cab/query.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/base/options.h"
#include "perf/tools/query/query_file.h"
#include "perf/tools/run/run_world.h"

namespace cab::perf {

struct QueryOptions {
  WorldOptions world;
  std::string scene;  // empty: the files
  std::uint32_t character_count = 10000;
  std::optional<std::uint32_t> frame = 0;                      // empty: the last one
  bool all_frames = false;                                     // instead of one, unless there is a range
  std::optional<FrameRange> frames;                            // instead of one
  std::array<std::vector<std::string>, kFileKindCount> paths;  // files of queries, by kind
  std::uint32_t random_count = 0;                              // of rays, if there are no files of queries
  std::uint32_t seed = 1;
  Exact exact = Exact::kNone;
  QueryWant want = QueryWant::kClosest;
  std::uint32_t max_hits = 0xffffffff;
  bool with_depth = false;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  std::uint32_t rounds = 3;
  std::string out_path;   // empty: no file
  std::string json_path;  // empty: no file
};
Command add_query(CLI::App& app);
int query_command(const QueryOptions& options);

// The words of --want, in the order of QueryWant.
inline constexpr std::array<const char*, kQueryWantCount> kWantNames = {"any", "closest", "all"};

}  // namespace cab::perf
