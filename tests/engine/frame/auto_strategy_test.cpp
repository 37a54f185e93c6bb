// What `auto` stands for, at both sides of each crossover (docs/policies.md, "Crossovers").
#include "engine/frame/auto_strategy.h"

#include "perf/harness/world.h"

#include <doctest/doctest.h>

#include <optional>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Links in a chain, or all on link 0. The leaves are given to the links in turn.
Rig rig_of(bool chain, std::uint32_t links, std::uint32_t leaves) {
  Rig rig;
  Random random(1);
  for (std::uint32_t link = 0; link < links; ++link)
    rig.parents.push_back(chain || link == 0 ? static_cast<std::int32_t>(link) - 1 : 0);
  for (std::uint32_t i = 0; i < leaves; ++i) rig.leaves.push_back({i % links, random_box(random, {}, 0.1, 0.2), {}});
  return rig;
}

// An engine with one batch of each rig, all of one kind, and a job over them.
struct Asked {
  EnginePtr engine = make_engine();
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  FrameJob job;

  Asked(BatchKind kind, const std::vector<Rig>& rigs, const Policies& policies) {
    for (const Rig& rig : rigs) {
      inputs.emplace_back();
      inputs.back().batch = add_instances(*engine, add_rig(*engine, rig), 1, kind);
    }
    job.inputs = inputs;
    job.policies = policies;
  }
};

Strategy for_characters(const std::vector<Rig>& rigs, const Policies& policies = {}) {
  const Asked asked(BatchKind::kCharacters, rigs, policies);
  return resolve_characters(*asked.engine, asked.job).strategy;
}

// One sequence whose instances are tested within themselves, or two such sequences against each other.
Strategy for_sequences(std::uint32_t leaves, Pairing pairing, const Policies& policies = {}) {
  const Rig rig = rig_of(true, leaves, leaves);
  const bool within = pairing == Pairing::kWithin;
  Asked asked(BatchKind::kSequence, within ? std::vector{rig} : std::vector{rig, rig}, policies);
  const PairRule rule = {{1}, {within ? 1u : 2u}, pairing};
  asked.job.rules = {&rule, 1};
  return resolve_sequences(*asked.engine, asked.job).strategy;
}

}  // namespace

TEST_CASE("auto takes rows up to 128 links of one chain, and a tree beyond") {
  CHECK(for_characters({rig_of(true, 128, 128)}) == Strategy::kRows);
  CHECK(for_characters({rig_of(true, 129, 129)}) == Strategy::kTree);
  CHECK(for_characters({rig_of(true, 129, 258)}) == Strategy::kTree);
}

TEST_CASE("auto takes no tree for links that branch") {
  CHECK(for_characters({rig_of(false, 129, 129)}) == Strategy::kRows);
  CHECK(for_characters({rig_of(false, 368, 368)}) == Strategy::kRows);
}

TEST_CASE("auto is chosen for each batch, and is what remains where batches differ") {
  const Asked asked(BatchKind::kCharacters, {rig_of(true, 129, 129), rig_of(false, 24, 49), rig_of(false, 24, 24)}, {});
  CHECK(resolve_characters(*asked.engine, asked.job).strategy == Strategy::kAuto);
  CHECK(asked.engine->batch({1}).strategy == Strategy::kTree);
  CHECK(asked.engine->batch({2}).strategy == Strategy::kLinks);
  CHECK(asked.engine->batch({3}).strategy == Strategy::kRows);
  CHECK(asked.engine->batch({2}).active == &asked.engine->batch({2}).link_bounds->links);
  CHECK(asked.engine->batch({3}).active == nullptr);  // binding an input sets it
  CHECK(for_characters({rig_of(true, 129, 129), rig_of(true, 130, 130)}) == Strategy::kTree);
}

TEST_CASE("auto takes links from 49 leaves on where some link has several") {
  CHECK(for_characters({rig_of(false, 24, 48)}) == Strategy::kRows);
  CHECK(for_characters({rig_of(false, 24, 49)}) == Strategy::kLinks);
  CHECK(for_characters({rig_of(false, 49, 49)}) == Strategy::kRows);
  CHECK(for_characters({rig_of(false, 64, 128)}) == Strategy::kLinks);
  CHECK(for_characters({rig_of(false, 65, 128)}) == Strategy::kLinks);
}

TEST_CASE("auto counts leaves instead of links where boxes are axis-aligned, and takes no links there") {
  for (const Refit refit : {Refit::kAabbHull, Refit::kAabbVertices}) {
    CHECK(for_characters({rig_of(true, 24, 128)}, {refit}) == Strategy::kRows);
    CHECK(for_characters({rig_of(true, 24, 129)}, {refit}) == Strategy::kTree);
    CHECK(for_characters({rig_of(false, 24, 49)}, {refit}) == Strategy::kRows);
  }
}

TEST_CASE("links become rows where no link has several leaves or boxes are axis-aligned, and tree in sequences") {
  const Policies links = {Refit::kCab, Strategy::kLinks}, aligned = {Refit::kAabbHull, Strategy::kLinks};
  CHECK(for_characters({rig_of(false, 4, 5)}, links) == Strategy::kLinks);
  CHECK(for_characters({rig_of(false, 4, 4)}, links) == Strategy::kRows);
  CHECK(for_characters({rig_of(false, 4, 5), rig_of(false, 4, 4)}, links) == Strategy::kAuto);
  CHECK(for_characters({rig_of(false, 4, 5)}, aligned) == Strategy::kRows);
  CHECK(for_sequences(4, Pairing::kWithin, links) == Strategy::kTree);
}

TEST_CASE("a sequence takes a tree where its leaf pairs exceed 64 and what its merges cost") {
  const struct {
    Refit refit;
    std::optional<std::uint32_t> most_within, most_between;  // leaves of each rig that are still tested by brute
  } rows[] = {{Refit::kCab, 22, 18}, {Refit::kAabbHull, 12, 8}, {Refit::kCovariance, 129, std::nullopt}};
  for (const auto& row : rows) {
    CAPTURE(static_cast<int>(row.refit));
    CHECK(for_sequences(*row.most_within, Pairing::kWithin, {row.refit}) == Strategy::kBrute);
    CHECK(for_sequences(*row.most_within + 1, Pairing::kWithin, {row.refit}) == Strategy::kTree);
    if (!row.most_between) continue;
    CHECK(for_sequences(*row.most_between, Pairing::kBetween, {row.refit}) == Strategy::kBrute);
    CHECK(for_sequences(*row.most_between + 1, Pairing::kBetween, {row.refit}) == Strategy::kTree);
  }
}

TEST_CASE("a sequence's pairs of ignored links do not count for a tree") {
  // 40 leaves have 780 pairs. A tree needs more than 8 * 39 + 64 = 376.
  for (const std::uint32_t tested : {376u, 377u}) {
    Rig rig = rig_of(true, 40, 40);
    std::uint32_t kept = 0;
    for (std::uint32_t a = 0; a < 40; ++a)
      for (std::uint32_t b = a + 1; b < 40; ++b)
        if (kept++ >= tested) rig.ignored.push_back({a, b});
    Asked asked(BatchKind::kSequence, {rig}, {});
    const PairRule rule = {{1}, {1}, Pairing::kWithin};
    asked.job.rules = {&rule, 1};
    CHECK(resolve_sequences(*asked.engine, asked.job).strategy == (tested == 376 ? Strategy::kBrute : Strategy::kTree));
  }
}

TEST_CASE("auto leaves a strategy that is named, and every other policy") {
  for (const Strategy named : {Strategy::kTree, Strategy::kRows, Strategy::kBrute}) {
    CHECK(for_characters({rig_of(false, 65, 130)}, {Refit::kCab, named}) == named);
    CHECK(for_sequences(4, Pairing::kWithin, {Refit::kCab, named}) == named);
  }
  const Policies policies = {Refit::kCovariance, Strategy::kAuto, Exact::kFcl, Extents::kLeaves, Sat::kFaces6};
  const Asked asked(BatchKind::kCharacters, {rig_of(false, 4, 4)}, policies);
  const Policies got = resolve_characters(*asked.engine, asked.job);
  CHECK(got.refit == policies.refit);
  CHECK(got.exact == policies.exact);
  CHECK(got.extents == policies.extents);
  CHECK(got.sat == policies.sat);
}

}  // namespace cab::tests
