// Runs queries against targets, and counts and times what they do.
#pragma once

#include <cab/query.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/tools/query/targets.h"

namespace cab::perf {

// The most hits of all queries in one frame. They take two gigabytes.
inline constexpr std::size_t kMaxQueryHits = std::size_t{1} << 25;

// Queries of one kind that follow each other, from one file or made at random.
struct QuerySource {
  std::string name;  // the file's path, or "random"
  QueryKind kind = QueryKind::kRay;
  std::size_t first = 0, count = 0;
};

// The queries of all sources, in their order.
struct AskedQueries {
  std::vector<Query> queries;
  std::vector<QuerySource> sources;

  void add(std::string name, QueryKind kind, std::vector<Query> more);
};

// What the queries of one source gave, in all frames.
struct QueryCounts {
  std::uint64_t found = 0;  // queries that found a link
  std::uint64_t hits = 0;
};

// An instance that is masked, and why.
struct MaskedTarget {
  std::uint32_t frame, instance;
  std::size_t group;
  MaskReason reason;
};

struct QueryFigures {
  std::vector<QueryCounts> counts;  // by source
  QueryStats stats;                 // counts: the sum of all frames, once
  std::vector<QueryStats> rounds;   // times: the sum of the frames of each round
  std::uint64_t hits_hash = 0;      // of all frames: which queries found something, and all hits
  std::optional<MaskedTarget> first_masked;
};

// The answers of one frame. found has one byte per query.
struct QueryAnswers {
  std::uint32_t frame;
  Span<const QueryHit> hits;
  Span<const std::uint8_t> found;
};

struct QuerySessionOptions {
  Exact exact = Exact::kNone;
  FrameRange frames = {0, 1};
  std::uint32_t rounds = 1;
  std::size_t most_hits = kMaxQueryHits;  // in one frame
};

// Asks in every frame, once to count and to warm up, and then once per round. on_answers is called once per frame. Hits
// that do not fit their buffer are asked for again. Throws std::runtime_error if the engine refuses a call, if there
// are more than most_hits, or if a round differs from the first.
QueryFigures measure_queries(Targets& targets, const AskedQueries& asked, const QuerySessionOptions& options,
                             const std::function<void(const QueryAnswers&)>& on_answers);

}  // namespace cab::perf
