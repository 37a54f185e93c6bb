// The checks of queries, before any is answered.
#pragma once

#include <cab/query.h>

namespace cab {

struct Engine;

// What the first query that is refused is refused for: kBadQuery, or kUnknownBatch for the instance that it leaves out.
struct BadQuery {
  Status status = Status::kOk;  // kOk: no query is refused
  std::size_t index = 0;
};
BadQuery first_bad_query(const Engine& engine, const QueryJob& job);

}  // namespace cab
