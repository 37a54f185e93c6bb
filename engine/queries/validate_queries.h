// The checks of queries, before any is answered.
#pragma once

#include <cab/query.h>

namespace cab {

// Returns the index of the first query that is not valid, or the number of queries.
std::size_t first_bad_query(const QueryJob& job);

}  // namespace cab
