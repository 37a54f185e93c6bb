// The hits that a query keeps, against all of them sorted.
#include "engine/queries/hit_buffer.h"

#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Hits of one query, of different links, with few distances, so that many are equal.
std::vector<QueryHit> any_hits(oracle::Random& random, std::uint32_t count) {
  std::vector<QueryHit> out;
  const std::uint32_t distances = 1 + random.index(20);
  for (std::uint32_t i = 0; i < count; ++i) {
    QueryHit hit = {};
    hit.distance = 0.5f * static_cast<float>(random.index(distances)) - 2;
    hit.batch = {1 + i % 2};
    hit.instance = i / 2 % 5;
    hit.link = static_cast<std::uint16_t>(i / 10);
    hit.leaf = static_cast<std::uint16_t>(random.index(100));
    out.push_back(hit);
  }
  if (random.chance(0.3)) {  // hits that have no distance come in their order
    for (QueryHit& hit : out) hit.distance = 0;
    std::sort(out.begin(), out.end(), precedes);
    return out;
  }
  for (std::size_t i = out.size(); i > 1; --i) std::swap(out[i - 1], out[random.index(static_cast<std::uint32_t>(i))]);
  return out;
}

bool is_same(const QueryHit& a, const QueryHit& b) { return !precedes(a, b) && !precedes(b, a) && a.leaf == b.leaf; }

}  // namespace

TEST_CASE("hit buffer: the first hits are kept, as many as are wanted, whatever order they come in") {
  oracle::Random random(71);
  for (std::uint64_t round = rounds(3000); round > 0; --round) {
    const std::uint32_t count = random.index(40);
    const std::vector<QueryHit> hits = any_hits(random, count);
    const std::uint32_t wanted = random.chance(0.2) ? ~0u : random.index(12), places = random.index(45);
    std::vector<QueryHit> storage(places + 1);
    storage[places].query = 77;  // after the buffer
    HitBuffer kept({storage.data(), places}, wanted);
    std::vector<QueryHit> sorted;
    for (const QueryHit& hit : hits) {
      CHECK(kept.has_all_wanted() == (sorted.size() >= wanted));
      kept.add(hit);
      sorted.push_back(hit);
      std::sort(sorted.begin(), sorted.end(), precedes);
      // What is farther than this is not wanted: never nearer than the last hit that is.
      const bool is_full = wanted > 0 && sorted.size() >= wanted && places >= wanted;
      CHECK(kept.most() == (is_full ? sorted[wanted - 1].distance : kInfinity));
    }
    CAPTURE(count);
    CAPTURE(wanted);
    CAPTURE(places);
    CHECK(kept.count() == std::min<std::size_t>(count, wanted));
    CHECK(kept.is_complete() == (kept.count() <= places));
    CHECK(storage[places].query == 77);
    if (!kept.is_complete()) continue;
    kept.sort();
    for (std::size_t i = 0; i < kept.count(); ++i) CHECK(is_same(storage[i], sorted[i]));
  }
}

TEST_CASE("hit buffer: hits are in the order of distance, batch, instance and link") {
  const auto hit = [](float distance, std::uint32_t batch, std::uint32_t instance, std::uint16_t link) {
    QueryHit out = {};
    out.distance = distance;
    out.batch = {batch};
    out.instance = instance;
    out.link = link;
    return out;
  };
  const QueryHit in_order[] = {hit(-1, 9, 9, 9), hit(0, 1, 7, 7), hit(0, 2, 0, 8),
                               hit(0, 2, 0, 9),  hit(0, 2, 1, 0), hit(3, 1, 0, 0)};
  for (std::size_t a = 0; a < std::size(in_order); ++a)
    for (std::size_t b = 0; b < std::size(in_order); ++b) CHECK(precedes(in_order[a], in_order[b]) == (a < b));
}

TEST_CASE("hit buffer: without storage, or with nothing wanted, hits are counted and none is stored") {
  HitBuffer none({nullptr, 0}, 5);
  HitBuffer nothing({nullptr, 0}, 0);
  for (int i = 0; i < 7; ++i) {
    QueryHit hit = {};
    hit.link = static_cast<std::uint16_t>(i);
    none.add(hit);
    nothing.add(hit);
  }
  CHECK(none.count() == 5);
  CHECK(!none.is_complete());
  CHECK(none.most() == kInfinity);
  CHECK(nothing.has_all_wanted());
  CHECK(nothing.count() == 0);
  CHECK(nothing.is_complete());
}

}  // namespace cab::tests
