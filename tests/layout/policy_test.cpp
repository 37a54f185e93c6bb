// The table of policies: the only place that names them.
#include <cab/policy.h>

#include <doctest/doctest.h>

#include <cstring>
#include <set>
#include <string>
#include <utility>

namespace {

using namespace cab;

constexpr std::uint32_t kRefitRow = 0, kStrategyRow = 1, kExactRow = 2, kExtentsRow = 3, kSatRow = 4;
constexpr std::uint32_t kCounts[] = {kRefitCount, kStrategyCount, kExactCount, kExtentsCount, kSatCount};

}  // namespace

TEST_CASE("every policy value is read back as it was set by name, and alone") {
  const auto table = policy_table();
  REQUIRE(table.size == 5);
  for (std::uint32_t row = 0; row < table.size; ++row) {
    CHECK(table[row].value_count == kCounts[row]);
    for (std::uint32_t value = 0; value < table[row].value_count; ++value) {
      CAPTURE(table[row].values[value].name);
      Policies policies;
      const Policies before = policies;
      CHECK(policy_set(policies, row, table[row].values[value].name));
      CHECK(policy_get(policies, row) == value);
      CHECK(table[row].values[value].value == value);
      for (std::uint32_t other = 0; other < table.size; ++other) {
        if (other == row) continue;
        CHECK(policy_get(policies, other) == policy_get(before, other));
      }
    }
  }
}

TEST_CASE("the rows of the table are the fields of Policies, and their values the enumerators") {
  Policies policies;
  CHECK(policy_set(policies, kRefitRow, "aabb_hull"));
  CHECK(policies.refit == Refit::kAabbHull);
  CHECK(policy_set(policies, kRefitRow, "cab"));
  CHECK(policies.refit == Refit::kCab);
  CHECK(policy_set(policies, kStrategyRow, "brute"));
  CHECK(policies.strategy == Strategy::kBrute);
  CHECK(policy_set(policies, kStrategyRow, "tree"));
  CHECK(policies.strategy == Strategy::kTree);
  CHECK(policy_set(policies, kExactRow, "fcl"));
  CHECK(policies.exact == Exact::kFcl);
  CHECK(policy_set(policies, kExactRow, "none"));
  CHECK(policies.exact == Exact::kNone);
  CHECK(policy_set(policies, kExtentsRow, "leaves"));
  CHECK(policies.extents == Extents::kLeaves);
  CHECK(policy_set(policies, kSatRow, "faces_6"));
  CHECK(policies.sat == Sat::kFaces6);
  CHECK(policy_set(policies, kSatRow, "all_15"));
  CHECK(policies.sat == Sat::kAll15);
  const std::pair<const char*, Refit> refits[] = {
      {"cab", Refit::kCab},     {"cab_sum", Refit::kCabSum},     {"covariance", Refit::kCovariance},
      {"best3", Refit::kBest3}, {"aabb_hull", Refit::kAabbHull}, {"aabb_vertices", Refit::kAabbVertices}};
  for (const auto& [name, refit] : refits) {
    CHECK(policy_set(policies, kRefitRow, name));
    CHECK(policies.refit == refit);
  }
  CHECK(policy_set(policies, kStrategyRow, "links"));
  CHECK(policies.strategy == Strategy::kLinks);
}

TEST_CASE("a name that is no value of the field is refused and changes nothing") {
  const auto table = policy_table();
  for (std::uint32_t row = 0; row <= table.size; ++row) {
    for (const char* const name : {"", "no such policy", "CAB", "tre", "treee", "fcl ", "best4"}) {
      CAPTURE(row);
      CAPTURE(name);
      Policies policies = {Refit::kAabbHull, Strategy::kBrute, Exact::kFcl};
      const Policies before = policies;
      CHECK_FALSE(policy_set(policies, row, name));
      CHECK(std::memcmp(&policies, &before, sizeof(Policies)) == 0);
    }
  }
  Policies policies;
  CHECK_FALSE(policy_set(policies, kRefitRow, nullptr));
  CHECK_FALSE(policy_set(policies, kRefitRow, "tree"));  // a value of another field
  CHECK_FALSE(policy_set(policies, static_cast<std::uint32_t>(-1), "tree"));
  CHECK(policy_get(policies, 5) == 0);
  CHECK(policy_get(policies, static_cast<std::uint32_t>(-1)) == 0);
}

TEST_CASE("every field and every value has a meaning and a name of its own") {
  std::set<std::string> fields;
  for (const PolicyField& field : policy_table()) {
    CHECK(fields.insert(field.name).second);
    CHECK(std::strlen(field.meaning) > 0);
    CHECK(field.value_count >= 2);
    CHECK(field.use_count == (field.name == std::string("refit") ? 2 : field.value_count));
    std::set<std::string> values;
    for (std::uint32_t value = 0; value < field.value_count; ++value) {
      CHECK(values.insert(field.values[value].name).second);
      CHECK(std::strlen(field.values[value].meaning) > 0);
    }
  }
}

TEST_CASE(
    "every preset has a name, a meaning and policies of its own, asks for no exact test, and is set by its name") {
  std::set<std::string> names, rows;
  for (const PolicyPreset& preset : preset_table()) {
    CAPTURE(preset.name);
    CHECK(names.insert(preset.name).second);
    CHECK(std::strlen(preset.meaning) > 0);
    std::string row;
    for (std::uint32_t field = 0; field < policy_table().size; ++field) {
      const std::uint32_t value = policy_get(preset.policies, field);
      REQUIRE(value < policy_table()[field].value_count);
      row += std::string(policy_table()[field].values[value].name) + " ";
    }
    CHECK(rows.insert(row).second);
    CHECK(preset.policies.exact == Exact::kNone);
    Policies policies = {Refit::kAabbVertices, Strategy::kBrute, Exact::kFcl, Extents::kLeaves, Sat::kFaces6};
    CHECK(preset_set(policies, preset.name));
    CHECK(std::memcmp(&policies, &preset.policies, sizeof(Policies)) == 0);
  }
  Policies balanced = {Refit::kAabbVertices, Strategy::kBrute, Exact::kFcl, Extents::kLeaves, Sat::kFaces6};
  CHECK(preset_set(balanced, "balanced"));
  const Policies defaults;
  CHECK(std::memcmp(&balanced, &defaults, sizeof(Policies)) == 0);
}

TEST_CASE("a name that is no preset is refused and changes nothing") {
  for (const char* const name : {"", "tigh", "tightt", "Tight", "fast", "cab", static_cast<const char*>(nullptr)}) {
    Policies policies = {Refit::kAabbHull, Strategy::kBrute, Exact::kFcl};
    const Policies before = policies;
    CHECK_FALSE(preset_set(policies, name));
    CHECK(std::memcmp(&policies, &before, sizeof(Policies)) == 0);
  }
}
