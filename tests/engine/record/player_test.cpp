// A recording in the tree, made with AVX-512, replays to one hash everywhere.
#include "tests/engine/record/recorded_world.h"

#include "layout/bit_hash.h"

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Made by `cab record --scene level --characters 12 --frames 0:5 --exact convex`. docs/recording.md says when to
// make it anew.
constexpr std::uint64_t kGoldenHash = 0x825cf8c1f7f4f0abu;

TEST_CASE("the recording in the tree replays to its hash with every instruction set and policy of speed") {
  record::Recording recording;
  must(recording, recording.open(CAB_GOLDEN_RECORDING));
  CHECK(recording.problems().empty());
  CHECK(std::string(recording.info().isa) == "avx512");
  CHECK(recording.frame_count() == 5);
  for (const Isa isa : available_isas())
    for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kBrute}) {
      CAPTURE(to_string(isa));
      EngineDesc desc;
      desc.isa = isa;
      record::Player player;
      must(player, player.open(recording, desc));
      cab::BitHash hash;
      record::RecordedFrame frame;
      std::size_t hits = 0;
      for (std::uint32_t f = 0; f < recording.frame_count(); ++f) {
        must(recording, recording.read_frame(f, &frame));
        Policies policies = frame.job.policies;
        policies.strategy = strategy;
        must(player, player.run(frame, &policies));
        const std::uint64_t of_frame = record::hash_hits(player.hits(), player.contacts());
        CHECK(of_frame == frame.hash);
        hash.add(of_frame);
        hits += player.hits().size;
      }
      CHECK(hits > 100);
      CHECK(hash.value() == kGoldenHash);
    }
}

TEST_CASE("a player says what it cannot run") {
  record::Player player;
  record::RecordedFrame frame;
  CHECK_FALSE(player.run(frame));
  record::Recording recording;
  must(recording, recording.open(CAB_GOLDEN_RECORDING));
  must(player, player.open(recording));
  must(recording, recording.read_frame(0, &frame));
  Policies policies = frame.job.policies;
  policies.exact = Exact::kNone;
  must(player, player.run(frame, &policies));
  CHECK(player.contacts().empty());
  CHECK(player.hits().size >= frame.hits.size);
  frame.job.margin = -1;
  CHECK_FALSE(player.run(frame));
  CHECK(std::string(player.error()).find("margin") != std::string::npos);
}

}  // namespace
}  // namespace cab::tests
