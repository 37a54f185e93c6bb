// A random world of characters with queries, for the verification of queries.
#pragma once

#include "perf/harness/world.h"
#include "perf/judge/oracle/query_judge.h"
#include "perf/judge/oracle/random_queries.h"
#include "perf/judge/verify/parts.h"

#include <vector>

namespace cab::perf {

// What the world is made of, and what is asked about it. Batch m + 1 is that of member m.
struct QueryWorld {
  oracle::World world;
  oracle::KeptParts kept;
  oracle::QueryScene scene;
  oracle::RandomQueries about;

  // One to three batches of a few characters each, some far from the world's origin, some of odd sizes and with plates,
  // needles and mirrored links.
  QueryWorld(oracle::Random& random, bool with_shapes);
  QueryWorld(const QueryWorld&) = delete;
  QueryWorld& operator=(const QueryWorld&) = delete;
};

// What a call has answered. It points into the world and into itself.
struct QueryAnswer {
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
  QueryJob job;

  QueryAnswer() = default;
  QueryAnswer(const QueryAnswer&) = delete;
  QueryAnswer& operator=(const QueryAnswer&) = delete;

  // The hits of one query. begin: where they begin; it is moved to their end.
  Span<const QueryHit> hits_of(std::size_t query, std::size_t& begin) const;
};

// Asks an engine of an instruction set all queries, with room for all hits. Throws if the call is refused.
void ask_queries(const Task& task, Isa isa, const QueryWorld& made, Exact exact, QueryAnswer& out);

// Counts a violation of a method for each other instruction set that does not answer with the same bits.
void compare_isas(Task& task, std::size_t method, const QueryWorld& made, Exact exact, const QueryAnswer& answer);

// A query as text with all digits, so that it can be asked again elsewhere.
std::string to_text(const Query& query);

}  // namespace cab::perf
