// diff_hits: what began and what ended, against sets.
#include "perf/harness/world.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Sorted hits of a few links, each link pair once, with random leaves.
std::vector<Hit> random_hits(Random& random) {
  std::vector<Hit> hits;
  for (std::uint32_t n = random.index(30); n > 0; --n) {
    Hit hit = {{1 + random.index(2)}, random.index(2), {2}, 2 + random.index(2), 0, 0, 0, 0};
    hit.link_a = static_cast<std::uint16_t>(random.index(2));
    hit.link_b = static_cast<std::uint16_t>(random.index(2));
    hit.leaf_a = static_cast<std::uint16_t>(random.index(9));
    hits.push_back(hit);
  }
  std::sort(hits.begin(), hits.end(), link_less);
  const auto same = [](const Hit& a, const Hit& b) { return link_key(a) == link_key(b); };
  hits.erase(std::unique(hits.begin(), hits.end(), same), hits.end());
  return hits;
}

Span<const Hit> span_of(const std::vector<Hit>& hits) { return hits; }

std::vector<Hit> only_in(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  std::vector<Hit> out;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out), link_less);
  return out;
}

}  // namespace

TEST_CASE("what only the second list has began, what only the first list has ended, and leaves do not matter") {
  std::size_t began_count = 0, ended_count = 0;
  for (std::uint64_t seed = 1; seed <= rounds(500); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const std::vector<Hit> previous = random_hits(random), current = random_hits(random);
    std::vector<Hit> began(current.size()), ended(previous.size());
    HitChanges changes;
    changes.began = began;
    changes.ended = ended;
    REQUIRE(diff_hits(span_of(previous), span_of(current), changes) == Status::kOk);
    began.resize(changes.began_count);
    ended.resize(changes.ended_count);
    CHECK(same_hits(began, only_in(current, previous)));
    CHECK(same_hits(ended, only_in(previous, current)));
    began_count += began.size();
    ended_count += ended.size();
  }
  CHECK(began_count >= least_count(1000, 500));
  CHECK(ended_count >= least_count(1000, 500));
}

TEST_CASE("lists that are too small are cut off, and both counts are complete") {
  Random random(8);
  std::vector<Hit> previous, current;
  while (only_in(previous, current).size() < 2 || only_in(current, previous).size() < 2) {
    previous = random_hits(random);
    current = random_hits(random);
  }
  const std::vector<Hit> all_began = only_in(current, previous), all_ended = only_in(previous, current);
  for (std::size_t room = 0; room < 2; ++room) {
    std::vector<Hit> began(2, Hit{}), ended(all_ended.size());
    HitChanges changes;
    changes.began = {began.data(), room};
    changes.ended = ended;
    CHECK(diff_hits(span_of(previous), span_of(current), changes) == Status::kHitsOverflow);
    CHECK(changes.began_count == all_began.size());
    CHECK(changes.ended_count == all_ended.size());
    CHECK(same_hits(ended, all_ended));
    CHECK(began[room].batch_a.value == 0);
    if (room) CHECK(link_key(began[0]) == link_key(all_began[0]));
  }
  HitChanges none;
  CHECK(diff_hits(span_of(previous), span_of(current), none) == Status::kHitsOverflow);
  CHECK(none.ended_count == all_ended.size());
}

TEST_CASE("lists that are not in the order of a frame, or without data, are refused") {
  Random random(9);
  std::vector<Hit> hits;
  while (hits.size() < 3) hits = random_hits(random);
  std::vector<Hit> twice = hits, turned = hits;
  twice[1] = twice[0];
  std::swap(turned[0], turned[2]);
  HitChanges changes;
  changes.began_count = 17;
  changes.ended_count = 4;
  for (const std::vector<Hit>& wrong : {twice, turned}) {
    CHECK(diff_hits(span_of(wrong), span_of(hits), changes) == Status::kUnsortedHits);
    CHECK(diff_hits(span_of(hits), span_of(wrong), changes) == Status::kUnsortedHits);
  }
  CHECK(diff_hits({nullptr, 2}, span_of(hits), changes) == Status::kUnsortedHits);
  changes.began = {nullptr, 1};
  CHECK(diff_hits(span_of(hits), span_of(hits), changes) == Status::kBadOutput);
  CHECK(changes.began_count == 17);
  CHECK(changes.ended_count == 4);
  HitChanges empty;
  CHECK(diff_hits({}, {}, empty) == Status::kOk);
}

}  // namespace cab::tests
