// Recordings of skins: they hold what was given, replay to the same bits, and name the triangles that touch.
#include "perf/judge/oracle/random_skins.h"
#include "tests/engine/record/recorded_world.h"

#include <algorithm>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCount = 12;
constexpr std::uint32_t kFrames = 3;

// Instances of a random skin in an engine, near each other, in another pose in every frame.
class SkinWorld {
 public:
  SkinWorld(Random& random, SkinRegime regime) : rig_(random_skin(random, regime)), engine_(make_engine({})) {
    require(add_articulation(*engine_, rig_.desc(), &articulation_));
    batch_ = add_instances(*engine_, articulation_, kCount, BatchKind::kCharacters);
    for (std::uint32_t f = 0; f < kFrames; ++f)
      poses_.push_back(random_skin_poses(random, rig_, kCount, PoseFormat::kMatrix3x4Rows, 1, 0.1, 1));
  }

  const SkinRig& rig() const { return rig_; }

  void tell(record::Recorder& recorder) const {
    must(recorder, recorder.add_articulation(articulation_, rig_.desc(), {"skin", {}}));
    must(recorder, recorder.add_batch(batch_, {articulation_, kCount, BatchKind::kCharacters}));
  }

  // Runs a frame by triangles and records it. Returns its hits.
  std::vector<Hit> record(record::Recorder& recorder, std::uint32_t frame) const {
    const BatchInput input = poses_[frame].input(batch_);
    const PairRule rules[] = {{batch_, batch_, Pairing::kBetween}, {batch_, batch_, Pairing::kWithin}};
    FrameJob job;
    job.inputs = {&input, 1};
    job.rules = rules;
    job.policies.exact = Exact::kSurface;
    std::vector<Hit> hits;
    Status status = run_frame(*engine_, job);
    if (status == Status::kHitsOverflow) {
      hits.resize(job.hits_needed);
      job.hits = hits;
      status = run_frame(*engine_, job);
    }
    require(status);
    must(recorder, recorder.add_frame(job, frame));
    return hits;
  }

  std::vector<TouchingTriangles> triangles(std::uint32_t frame, const std::vector<Hit>& hits) const {
    const BatchInput input = poses_[frame].input(batch_);
    std::vector<TouchingTriangles> out(1);
    std::size_t found = 0;
    Status status = find_touching_triangles(*engine_, {&input, 1}, hits, out, &found);
    out.resize(found);
    if (status == Status::kHitsOverflow) status = find_touching_triangles(*engine_, {&input, 1}, hits, out, &found);
    require(status);
    return out;
  }

 private:
  SkinRig rig_;
  std::vector<Poses> poses_;
  EnginePtr engine_;
  ArticulationId articulation_;
  BatchId batch_;
};

template <class T>
bool same_span(Span<const T> a, Span<const T> b) {
  return a.size == b.size && std::equal(a.begin(), a.end(), b.begin());
}

void check_skin(const ArticulationDesc& read, const ArticulationDesc& given) {
  CHECK(same_span(read.skin.vertices, given.skin.vertices));
  CHECK(read.skin.influence_count == given.skin.influence_count);
  CHECK(same_span(read.skin.influence_links, given.skin.influence_links));
  CHECK(same_span(read.skin.influence_weights, given.skin.influence_weights));
  CHECK(same_span(read.skin.inverse_bind, given.skin.inverse_bind));
  REQUIRE(read.leaves.size == given.leaves.size);
  for (std::size_t leaf = 0; leaf < given.leaves.size; ++leaf) {
    CHECK(read.leaves[leaf].link == given.leaves[leaf].link);
    CHECK(same_span(read.leaves[leaf].triangles, given.leaves[leaf].triangles));
  }
}

TEST_CASE("a recording of skins holds them, replays to the same bits, and names the triangles that touch") {
  Random random(731);
  std::size_t hits_seen = 0, triangles_seen = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    CAPTURE(round);
    const SkinWorld world(random, static_cast<SkinRegime>(round % kSkinRegimeCount));
    const RecordingFile file("skins");
    std::vector<std::vector<Hit>> hits;
    record::Recorder recorder;
    record::RecorderOptions options;
    options.compress = round % 2 == 1;
    must(recorder, recorder.open(file.path(), options));
    world.tell(recorder);
    for (std::uint32_t f = 0; f < kFrames; ++f) hits.push_back(world.record(recorder, f));
    must(recorder, recorder.close());

    record::Recording recording;
    must(recording, recording.open(file.path()));
    REQUIRE(recording.articulation_count() == 1);
    check_skin(recording.articulation(0).desc, world.rig().desc());
    for (const Isa isa : available_isas()) {
      record::Player player;
      must(player, player.open(recording, {.isa = isa}));
      for (std::uint32_t f = 0; f < kFrames; ++f) {
        record::RecordedFrame frame;
        must(recording, recording.read_frame(f, &frame));
        CHECK_FALSE(frame.has_contacts);
        must(player, player.run(frame));
        CHECK(same_values(player.hits(), hits[f]));
        CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
        must(player, player.find_triangles(frame, frame.hits));
        const std::vector<TouchingTriangles> expected = world.triangles(f, hits[f]);
        CHECK(same_values(player.triangles(), expected));
        hits_seen += hits[f].size();
        triangles_seen += expected.size();
      }
    }
  }
  CHECK(hits_seen >= least_count(200, 20));
  CHECK(triangles_seen >= hits_seen);
}

TEST_CASE("a skin that is recorded again is not defined again") {
  Random random(732);
  const SkinWorld world(random, SkinRegime::kSmooth);
  const RecordingFile file("skins_again");
  for (std::uint32_t f = 0; f < 2; ++f) {
    record::Recorder recorder;
    record::RecorderOptions options;
    options.append = f > 0;
    must(recorder, recorder.open(file.path(), options));
    world.tell(recorder);
    world.record(recorder, f);
    must(recorder, recorder.close());
  }
  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.frame_count() == 2);
  CHECK(recording.articulation_count() == 1);
}

TEST_CASE("a player finds no triangles of hits that the frame does not have") {
  Random random(733);
  const SkinWorld world(random, SkinRegime::kSmooth);
  const RecordingFile file("skins_hits");
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  world.tell(recorder);
  world.record(recorder, 0);
  must(recorder, recorder.close());
  record::Recording recording;
  must(recording, recording.open(file.path()));
  record::RecordedFrame frame;
  must(recording, recording.read_frame(0, &frame));
  record::Player player;
  CHECK_FALSE(player.find_triangles(frame, {}));
  must(player, player.open(recording));
  must(player, player.find_triangles(frame, {}));
  CHECK(player.triangles().empty());
  Hit hit = {};
  hit.batch_a = hit.batch_b = {77};
  CHECK_FALSE(player.find_triangles(frame, {&hit, 1}));
  CHECK(std::string(player.error()).find("a hit is of a batch that the frame does not have") != std::string::npos);
  hit.batch_a = hit.batch_b = {recording.batch(0).slot};
  CHECK_FALSE(player.find_triangles(frame, {&hit, 1}));  // a link with itself
  CHECK(std::string(player.error()).find(to_string(Status::kBadPairs)) != std::string::npos);
}

}  // namespace
}  // namespace cab::tests
