// The sum of what frames or calls of queries, or the workers of one, counted.
#pragma once

#include <cab/query.h>
#include <cab/types.h>

namespace cab {

// Adds every count and every second of `part` to `sum`.
inline void add_stats(FrameStats& sum, const FrameStats& part) {
  sum.candidates += part.candidates;
  sum.box_tests += part.box_tests;
  sum.leaf_pairs += part.leaf_pairs;
  sum.exact_tests += part.exact_tests;
  sum.false_positives += part.false_positives;
  sum.instances_masked += part.instances_masked;
  sum.instances_beyond_bounds += part.instances_beyond_bounds;
  sum.instances_resting += part.instances_resting;
  sum.hits_kept += part.hits_kept;
  sum.leaves_skinned += part.leaves_skinned;
  sum.leaves_replaced += part.leaves_replaced;
  sum.seconds_update += part.seconds_update;
  sum.seconds_broad += part.seconds_broad;
  sum.seconds_test += part.seconds_test;
  sum.seconds_query += part.seconds_query;
  sum.seconds_contact += part.seconds_contact;
  sum.seconds_total += part.seconds_total;
  sum.instances_posed += part.instances_posed;
  sum.candidates_apart += part.candidates_apart;
  sum.seconds_bound += part.seconds_bound;
  sum.seconds_sort += part.seconds_sort;
  sum.seconds_filter += part.seconds_filter;
  sum.seconds_write += part.seconds_write;
}

inline void add_stats(QueryStats& sum, const QueryStats& part) {
  sum.nodes += part.nodes;
  sum.instances += part.instances;
  sum.leaf_tests += part.leaf_tests;
  sum.exact_tests += part.exact_tests;
  sum.leaves_skinned += part.leaves_skinned;
  sum.leaves_replaced += part.leaves_replaced;
  sum.instances_posed += part.instances_posed;
  sum.instances_masked += part.instances_masked;
  sum.clamped += part.clamped;
  sum.seconds_bound += part.seconds_bound;
  sum.seconds_index += part.seconds_index;
  sum.seconds_search += part.seconds_search;
  sum.seconds_total += part.seconds_total;
}

}  // namespace cab
