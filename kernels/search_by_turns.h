// Several searches of one index by turns: what one of them reads next comes from memory while the others go on.
#pragma once

#include "kernels/search_ray.h"
#include "kernels/search_round.h"

namespace cab::kernel {

// Tests the instance that a search has come to, if it has, and takes it to the next one.
template <class V, class Search>
CAB_INLINE SearchStop take_turn(const SearchedIndex& index, Search& search) {
  SearchWay& way = search.way;
  if (way.is_within) {
    const PosedCluster& cluster = index.clusters[way.at.node];
    if (cluster.generation != index.generation) return SearchStop::kPose;
    double apart[3];
    if (looks_at<V>(index, search.filter, cluster, way.at.lane, apart)) {
      way.tested += !way.is_counted;
      way.is_counted = true;
      const SearchStop stop = test_leaves<V>(cluster, apart, search);
      if (stop != SearchStop::kGoesOn) return stop;
    }
  }
  if (!walk_on<V>(
          index.nodes, walk_of<V>(search.lanes), [&search](float entry) { return search.lanes.skips(entry); },
          ReadAhead{index}, way.walk, &way.at))
    return SearchStop::kEnd;
  way.is_within = true;
  way.is_counted = false;
  way.tile = 0;
  read_ahead(index, way.at);
  return SearchStop::kGoesOn;
}

// Goes on with searches, one to sixteen, until each has stopped.
template <class V, class Search>
CAB_INLINE void search_by_turns(const SearchedIndex& index, Search* const* searches, std::uint32_t count) {
  Search* going[kLanes];
  for (std::uint32_t i = 0; i < count; ++i) going[i] = searches[i];
  while (count > 0) {
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      Search* const search = going[i];
      search->stop = take_turn<V>(index, *search);
      going[left] = search;
      left += search->stop == SearchStop::kGoesOn;
    }
    count = left;
  }
}
template <class V>
void search_rays(const SearchedIndex& index, RaySearch* const* rays, std::uint32_t count) {
  search_by_turns<V>(index, rays, count);
}
template <class V>
void search_points(const SearchedIndex& index, PointSearch* const* points, std::uint32_t count) {
  search_by_turns<V>(index, points, count);
}

}  // namespace cab::kernel
