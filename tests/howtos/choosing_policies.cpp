// Policies trade speed for accuracy; instruction sets change speed alone. How to choose them, and what stays the same.
#include <cab/world.h>

#include <cstdio>
#include <cstring>
#include <vector>

// 100 fighters hold their spears level. Each spear points a little further round than the one before.
static std::vector<cab::Hit> hits_of_spears(const cab::Policies& policies, cab::Isa isa = cab::Isa::kAuto) {
  constexpr std::uint32_t kCount = 100;
  cab::EngineDesc desc;
  desc.isa = isa;
  const std::int32_t parents[] = {-1};
  const cab::Leaf leaf = {0, cab::axis_aligned_box({.9f, 1, 0}, {.9f, .05f, .05f}), {}};
  cab::World world(desc);
  cab::BatchId spears;
  cab::exit_on_error(world.add_batch({parents, {}, {&leaf, 1}, {}}, kCount, &spears));
  cab::exit_on_error(world.add_rule({spears, spears}));

  std::vector<float> poses;
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const std::uint32_t row = i / 10, column = i % 10;
    poses.insert(poses.end(), {0, static_cast<float>(i) / kCount, 0, 1, 0, 0, 0});  // the quaternion is normalized
    origins.insert(origins.end(), {1.2 * column, 0, 1.2 * row});
  }
  world.input(spears)->poses.data = poses.data();
  world.input(spears)->origins = origins;
  world.job().policies = policies;
  cab::exit_on_error(world.run());
  return {world.hits().begin(), world.hits().end()};
}

static bool same(const std::vector<cab::Hit>& a, const std::vector<cab::Hit>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(cab::Hit)) == 0;
}

int main() {
  // The defaults, on the best instruction set that this CPU and this build have.
  const std::vector<cab::Hit> expected = hits_of_spears({});
  bool right = !expected.empty();
  std::printf("%zu hits on", expected.size());
  for (std::uint32_t i = 1; i < cab::kIsaCount; ++i) {  // 0 is kAuto
    const auto isa = static_cast<cab::Isa>(i);
    if (!cab::isa_available(isa)) continue;  // create_engine would answer kIsaNotAvailable
    std::printf(" %s", cab::to_string(isa));
    right = right && same(hits_of_spears({}, isa), expected);
  }

  // quote
  // Strategies find the same hits in different times. The default, kAuto, picks one by the number of links and leaves.
  cab::Policies brute;
  brute.strategy = cab::Strategy::kBrute;
  // end quote
  right = right && same(hits_of_spears(brute), expected);

  // By their faces alone, boxes may be reported that are slightly apart; all that overlap are reported.
  cab::Policies faces;
  faces.sat = cab::Sat::kFaces6;
  right = right && hits_of_spears(faces).size() >= expected.size();

  // quote
  // A preset sets every field. It answers false if no preset has this name.
  cab::Policies tight;
  right = right && cab::preset_set(tight, "tight");
  // end quote
  right = right && same(hits_of_spears(tight), expected);

  // quote
  // A settings file holds names. policy_table lists them, each with its meaning.
  std::printf("\n");
  const cab::Span<const cab::PolicyField> table = cab::policy_table();
  for (std::uint32_t field = 0; field < table.size; ++field) {
    std::printf("%s=%s ", table[field].name, table[field].values[cab::policy_get(tight, field)].name);
    if (std::strcmp(table[field].name, "strategy") == 0) right = right && cab::policy_set(tight, field, "tree");
  }
  // end quote
  std::printf("\n");
  return right && tight.strategy == cab::Strategy::kTree ? 0 : 1;
}
