// What a host gives a recorder is what a reader gets, and frames come out of it to the same bits.
#include "tests/engine/record/recorded_world.h"

#include <algorithm>
#include <limits>

#include "engine/record/chunk.h"

#ifdef __linux__
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#endif

namespace cab::tests {
namespace {

using namespace cab::oracle;

// A world of characters in which poses change from frame to frame, or stay.
World another_moment(Random& random, const World& world) {
  World out = world;
  for (Member& member : out.members) {
    if (random.chance(0.3)) continue;
    PoseRange range;
    range.origins = !member.poses.origins.empty();
    range.orientations = !member.poses.orientations.empty();
    member.poses = random_poses(random, member.rig, member.poses.instance_count, member.poses.format, range);
  }
  if (random.chance(0.2)) out.margin = 0.01f;
  return out;
}

World any_world(Random& random) {
  World world;
  add_characters(random, world, 12);
  if (random.chance(0.5)) add_layers(random, world);
  world.contacts = random.chance(0.5);
  if (random.chance(0.2)) world.members[0].poses.data[3] = std::numeric_limits<float>::quiet_NaN();
  return world;
}

Policies any_policies(Random& random, bool contacts) {
  Policies policies;
  for (std::uint32_t f = 0; f < policy_table().size; ++f)
    policy_set(policies, f, policy_table()[f].values[random.index(policy_table()[f].value_count)].name);
  if (policies.exact == Exact::kFcl || contacts) policies.exact = Exact::kConvex;
  return policies;
}

void check_frame(record::Recording& recording, std::uint32_t index, const WrittenFrame& written) {
  record::RecordedFrame frame;
  must(recording, recording.read_frame(index, &frame));
  CHECK(frame.time == index * 0.5);
  CHECK(frame.job.margin == written.world.margin);
  CHECK(frame.job.inputs.size == written.world.members.size());
  CHECK(std::memcmp(&frame.job.policies, &written.policies, sizeof(Policies)) == 0);
  REQUIRE(frame.job.rules.size == written.world.rules.size());
  for (std::size_t r = 0; r < frame.job.rules.size; ++r) {
    CHECK(frame.job.rules[r].a.value == written.world.rules[r].a.value);
    CHECK(frame.job.rules[r].b.value == written.world.rules[r].b.value);
    CHECK(frame.job.rules[r].pairing == written.world.rules[r].pairing);
  }
  std::vector<std::uint32_t> masked;
  for (std::uint32_t m = 0; m < written.world.members.size(); ++m) {
    const Member& member = written.world.members[m];
    const BatchInput& input = frame.job.inputs[m];
    CHECK(input.batch.value == m + 1);
    CHECK(input.poses.format == member.poses.format);
    CHECK(same_values({input.poses.data, member.poses.data.size()}, member.poses.data));
    CHECK(same_values(input.origins, member.poses.origins));
    CHECK(same_values(input.orientations, member.poses.orientations));
    CHECK(same_values(input.layers, member.layers));
    CHECK(same_values(input.layer_masks, member.layer_masks));
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      if (written.outcome.flags[m][i] != 0) masked.insert(masked.end(), {m, i});
  }
  CHECK(same_values(frame.masked, masked));
  CHECK(same_hits_and_contacts(frame.hits, frame.contacts, written.outcome));
  CHECK(frame.stats.box_tests == written.outcome.stats.box_tests);
  CHECK(frame.stats.false_positives == written.outcome.stats.false_positives);
}

TEST_CASE("a recording of random worlds holds what was given, and replays to the same bits on every instruction set") {
  Random random(701);
  std::size_t hits = 0;
  for (std::uint64_t round = 0; round < rounds(40); ++round) {
    CAPTURE(round);
    World world = any_world(random);
    const RecordingFile file("random_worlds");
    const bool compressed = random.chance(0.5);
    std::vector<WrittenFrame> written;
    {
      const EnginePtr engine = make_engine_for(world);
      record::Recorder recorder;
      record::RecorderOptions options;
      options.title = "random \"worlds\" \xe2\x80\xa6";
      options.up = 'y';
      options.isa = Isa::kScalar;
      options.compress = compressed;
      must(recorder, recorder.open(file.path(), options));
      tell(recorder, world);
      for (std::uint32_t f = 0; f < 12; ++f) {
        world = another_moment(random, world);
        const Policies policies = any_policies(random, world.contacts);
        Outcome outcome = run_recorded(*engine, recorder, world, policies, f * 0.5);
        written.push_back({world, policies, std::move(outcome)});
        if (random.chance(0.2)) must(recorder, recorder.flush());
      }
      must(recorder, recorder.close());
      CHECK(recorder.frame_count() == 12);
      CHECK(recorder.byte_count() == file.bytes().size());
    }
    record::Recording recording;
    must(recording, recording.open(file.path()));
    CHECK(recording.problems().empty());
    CHECK(recording.whole_bytes() == file.bytes().size());
    CHECK(std::string(recording.info().title) == "random \"worlds\" \xe2\x80\xa6");
    CHECK(std::string(recording.info().isa) == "scalar");
    CHECK(recording.info().up == 'y');
    REQUIRE(recording.frame_count() == written.size());
    for (const std::uint32_t f : {5u, 0u, 11u, 10u, 3u}) check_frame(recording, f, written[f]);
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      record::Player player;
      must(player, player.open(recording, desc));
      for (std::uint32_t f = 0; f < written.size(); ++f) {
        record::RecordedFrame frame;
        must(recording, recording.read_frame(f, &frame));
        must(player, player.run(frame));
        CHECK(same_hits_and_contacts(player.hits(), player.contacts(), written[f].outcome));
        CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
        hits += player.hits().size;
      }
    }
  }
  CHECK(hits > 100);
}

// The frames of moments, by an engine in which each sequence is a character.
TEST_CASE("every moment of sequences is a frame of characters") {
  Random random(702);
  std::size_t hits = 0;
  for (std::uint64_t round = 0; round < rounds(30); ++round) {
    CAPTURE(round);
    World world;
    add_frames(random, world, 12);
    world.contacts = random.chance(0.5);
    Policies policies = any_policies(random, world.contacts);
    const RecordingFile file("moments");
    record::Recorder recorder;
    record::RecorderOptions options;
    options.seconds_per_frame = 0.25;
    must(recorder, recorder.open(file.path(), options));
    tell(recorder, world);
    const EnginePtr engine = make_engine_for(world);
    const Outcome all = run_recorded(*engine, recorder, world, policies, 7);
    must(recorder, recorder.close());

    std::uint32_t moments = 1;
    for (const Member& member : world.members) moments = std::max(moments, member.poses.instance_count);
    record::Recording recording;
    must(recording, recording.open(file.path()));
    REQUIRE(recording.frame_count() == moments);
    record::Player player;
    must(player, player.open(recording));
    std::size_t found = 0;
    for (std::uint32_t m = 0; m < moments; ++m) {
      record::RecordedFrame frame;
      must(recording, recording.read_frame(m, &frame));
      CHECK(frame.time == 7 + m * 0.25);
      must(player, player.run(frame));
      CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
      found += frame.hits.size;
    }
    // What fixed objects touch alone is once in the job, and in every frame.
    std::size_t expected = 0;
    for (const Hit& hit : all.hits) {
      const auto is_fixed = [&](BatchSlot slot) { return world.members[slot.value - 1].poses.instance_count == 1; };
      expected += is_fixed(hit.batch_a) && is_fixed(hit.batch_b) ? moments : 1;
    }
    CHECK(found == expected);
    hits += found;
  }
  CHECK(hits >= least_count(100, 30));
}

// A rig of one link with one box, `half` large.
Rig cube(float half) {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half, half, half}}, {}}};
  return rig;
}

// Records frames of cubes in a row, which touch their neighbours.
struct CubeRow {
  Rig rig = cube(0.5f);
  EnginePtr engine = make_engine();
  ArticulationId articulation = add_rig(*engine, rig);
  std::vector<float> poses;
  std::vector<Hit> hits = std::vector<Hit>(64);
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;

  BatchId add(record::Recorder& recorder, std::uint32_t count) {
    const BatchDesc desc = {articulation, count, BatchKind::kCharacters};
    BatchId id;
    require(add_batch(*engine, desc, &id));
    must(recorder, recorder.add_articulation(articulation, rig.desc()));
    must(recorder, recorder.add_batch(id, desc));
    return id;
  }
  FrameJob run(BatchId batch, std::uint32_t count) {
    poses.clear();
    for (std::uint32_t i = 0; i < count; ++i)
      poses.insert(poses.end(), {0, 0, 0, 1, 0.75f * static_cast<float>(i), 0, 0});
    inputs.assign(1, {});
    inputs[0].batch = batch;
    inputs[0].poses.data = poses.data();
    rules = {{batch, batch, Pairing::kBetween}};
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.hits = hits;
    require(run_frame(*engine, job));
    return job;
  }
};

TEST_CASE("a batch may take the slot of one that was removed") {
  const RecordingFile file("slots");
  CubeRow row;
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  for (const std::uint32_t count : {3u, 5u, 5u, 2u}) {
    const BatchId batch = row.add(recorder, count);
    CHECK(slot_of(batch).value == 1);
    must(recorder, recorder.add_frame(row.run(batch, count), 0));
    require(remove_batch(*row.engine, batch));
  }
  must(recorder, recorder.close());
  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.articulation_count() == 1);
  CHECK(recording.batch_count() == 3);  // the third is the second again
  record::Player player;
  must(player, player.open(recording));
  const std::size_t expected[] = {2, 4, 4, 1};
  for (const std::uint32_t f : {0u, 1u, 2u, 3u, 0u, 3u, 1u}) {
    record::RecordedFrame frame;
    must(recording, recording.read_frame(f, &frame));
    must(player, player.run(frame));
    CHECK(frame.hits.size == expected[f]);
    CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
  }
}

// A character beside two tiles of a level that stream in and out of one slot.
TEST_CASE("a batch that comes back to its slot is written once") {
  const RecordingFile file("tiles");
  CubeRow row;
  constexpr std::size_t kTriangles = 1000;
  std::vector<std::uint32_t> corners;
  std::vector<float> triangles[2];
  for (std::uint32_t v = 0; v < 3 * kTriangles; ++v) {
    corners.push_back(v);
    for (const std::size_t tile : {0u, 1u})
      triangles[tile].insert(triangles[tile].end(),
                             {tile == 0 ? 0.0f : 9.0f, v % 3 == 1 ? 0.1f : 0.0f, v % 3 == 2 ? 0.1f : 0.0f});
  }
  std::uint32_t frame_count = 0;
  const auto record_tiles = [&](bool append, int switches) {
    record::Recorder recorder;
    record::RecorderOptions options;
    options.append = append;
    must(recorder, recorder.open(file.path(), options));
    const BatchId character = row.add(recorder, 1);
    for (int s = 0; s < switches; ++s, ++frame_count) {
      StaticDesc level;
      level.vertices = triangles[frame_count % 2];
      level.triangles = corners;
      BatchId tile;
      require(add_static_batch(*row.engine, level, &tile));
      CHECK(slot_of(tile).value == 2);
      must(recorder, recorder.add_static_batch(tile, level));
      row.hits.resize(2 * kTriangles);
      row.run(character, 1);
      row.inputs.emplace_back();
      row.inputs[1].batch = tile;
      row.rules = {{character, tile, Pairing::kBetween}};
      FrameJob job;
      job.inputs = row.inputs;
      job.rules = row.rules;
      job.hits = row.hits;
      require(run_frame(*row.engine, job));
      CHECK(job.hit_count == (frame_count % 2 == 0 ? kTriangles : 0));
      must(recorder, recorder.add_frame(job, frame_count));
      if (s % 3 == 2) must(recorder, recorder.flush());
      require(remove_batch(*row.engine, tile));
    }
    must(recorder, recorder.close());
    require(remove_batch(*row.engine, character));
  };
  record_tiles(false, 7);
  record_tiles(true, 6);

  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.articulation_count() == 1);
  CHECK(recording.batch_count() == 3);
  REQUIRE(recording.frame_count() == 13);
  record::Player player;
  must(player, player.open(recording));
  for (const std::uint32_t f : {0u, 1u, 2u, 3u, 12u, 11u, 5u, 6u, 7u, 8u, 10u, 4u, 9u}) {
    record::RecordedFrame frame;
    must(recording, recording.read_frame(f, &frame));
    REQUIRE(frame.job.inputs.size == 2);
    CHECK(frame.job.inputs[1].batch.value == 2 + f % 2);
    must(player, player.run(frame));
    CHECK(player.hits().size == (f % 2 == 0 ? kTriangles : 0));
    CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
  }
}

TEST_CASE("a recording is appended to, behind what is whole") {
  const RecordingFile file("append");
  CubeRow row;
  const auto record_one = [&](bool append, std::uint32_t count) {
    record::Recorder recorder;
    record::RecorderOptions options;
    options.append = append;
    must(recorder, recorder.open(file.path(), options));
    const BatchId batch = row.add(recorder, count);
    must(recorder, recorder.add_frame(row.run(batch, count), count));
    must(recorder, recorder.close());
    require(remove_batch(*row.engine, batch));
    return recorder.frame_count();
  };
  CHECK(record_one(true, 4) == 1);  // there is none yet
  const std::size_t first = file.bytes().size();
  CHECK(record_one(true, 4) == 2);
  CHECK(record_one(true, 6) == 3);
  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.articulation_count() == 1);
  CHECK(recording.batch_count() == 2);

  std::vector<std::uint8_t> bytes = file.bytes();
  bytes.resize(bytes.size() - record::kChunkHeaderBytes - 5);  // of the mark of the end, and of the payload
  file.write(bytes);
  CHECK(record_one(true, 3) == 3);  // the third frame was cut off
  must(recording, recording.open(file.path()));
  CHECK(recording.problems().empty());
  record::Player player;
  must(player, player.open(recording));
  const std::size_t expected[] = {3, 3, 2};
  for (std::uint32_t f = 0; f < 3; ++f) {
    record::RecordedFrame frame;
    must(recording, recording.read_frame(f, &frame));
    must(player, player.run(frame));
    CHECK(player.hits().size == expected[f]);
    CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
  }
  CHECK(record_one(false, 4) == 1);
  CHECK(file.bytes().size() == first);
}

TEST_CASE("rounded poses are recorded as they ran, and poses that are not rounded are refused") {
  constexpr float kStep = 1.0f / 1024;
  Random random(703);
  const RecordingFile file("rounded");
  for (std::uint64_t round = 0; round < rounds(20); ++round) {
    World world;
    add_characters(random, world, 12);
    for (Member& member : world.members) {
      PoseRange range;
      range.origins = range.orientations = true;
      member.poses =
          random_poses(random, member.rig, member.poses.instance_count, PoseFormat::kQuaternionTranslation, range);
    }
    const EnginePtr engine = make_engine_for(world);
    record::Recorder recorder;
    record::RecorderOptions options;
    options.pose_step = kStep;
    must(recorder, recorder.open(file.path(), options));
    tell(recorder, world);
    FrameJob job;
    std::vector<BatchInput> inputs = {world.members[0].poses.input({1})};
    job.inputs = inputs;
    CHECK_FALSE(recorder.add_frame(job, 0));
    CHECK(std::string(recorder.error()).find("round_poses") != std::string::npos);
    for (Member& member : world.members) CHECK(record::round_poses(member.poses.data, kStep));
    const Outcome outcome = run_recorded(*engine, recorder, world, {}, 0);
    must(recorder, recorder.close());
    record::Recording recording;
    must(recording, recording.open(file.path()));
    CHECK(recording.info().pose_step == kStep);
    REQUIRE(recording.frame_count() == 1);
    record::RecordedFrame frame;
    must(recording, recording.read_frame(0, &frame));
    for (std::size_t m = 0; m < world.members.size(); ++m) {
      const std::vector<float>& given = world.members[m].poses.data;
      CHECK(same_values({frame.job.inputs[m].poses.data, given.size()}, given));
    }
    CHECK(same_hits_and_contacts(frame.hits, frame.contacts, outcome));
  }
}

// Of links that the engine does not read a pose masks nothing, whatever it is.
TEST_CASE("what is masked for its pose is so in a recording of rounded poses, and changes no hit") {
  constexpr float kStep = 1.0f / 1024;
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  Random random(708);
  const RecordingFile file("masked");
  std::size_t masked = 0, hits = 0;
  for (std::uint64_t round = 0; round < rounds(40); ++round) {
    CAPTURE(round);
    World world;
    add_characters(random, world, 12);
    for (Member& member : world.members) {
      PoseRange range;
      range.origins = range.orientations = true;
      Poses& poses = member.poses =
          random_poses(random, member.rig, member.poses.instance_count, PoseFormat::kQuaternionTranslation, range);
      CHECK(record::round_poses(poses.data, kStep));
      if (random.chance(0.7))
        poses.data[random.index(static_cast<std::uint32_t>(poses.data.size()))] = random.chance(0.5) ? nan : infinite;
    }
    const EnginePtr engine = make_engine_for(world);
    record::Recorder recorder;
    record::RecorderOptions options;
    options.pose_step = kStep;
    must(recorder, recorder.open(file.path(), options));
    tell(recorder, world);
    const Outcome outcome = run_recorded(*engine, recorder, world, any_policies(random, false), 0);
    must(recorder, recorder.close());
    record::Recording recording;
    must(recording, recording.open(file.path()));
    record::RecordedFrame frame;
    must(recording, recording.read_frame(0, &frame));
    record::Player player;
    must(player, player.open(recording));
    must(player, player.run(frame));
    CHECK(same_hits_and_contacts(player.hits(), player.contacts(), outcome));
    CHECK(player.stats().instances_masked == outcome.stats.instances_masked);
    CHECK(frame.masked.size == 2 * outcome.stats.instances_masked);
    masked += outcome.stats.instances_masked;
    hits += outcome.hits.size();
  }
  CHECK(masked >= least_count(20, 40));
  CHECK(hits >= least_count(20, 40));
}

TEST_CASE("an instance that is not in the frame is not masked in it") {
  const RecordingFile file("unlisted");
  CubeRow row;
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  const BatchId batch = row.add(recorder, 4);
  FrameJob job = row.run(batch, 4);
  row.poses[7 + 4] = row.poses[3 * 7 + 4] = std::numeric_limits<float>::quiet_NaN();
  std::uint8_t flags[4] = {};
  row.inputs[0].flags = {flags, 4};
  const std::uint32_t listed[] = {0, 2, 3};
  for (const int f : {0, 1, 2}) {
    if (f == 1) row.inputs[0].instances = listed;
    if (f == 2) row.inputs[0].instances = {};
    if (f == 2) row.inputs[0].count = 3;
    require(run_frame(*row.engine, job));
    must(recorder, recorder.add_frame(job, f));
  }
  must(recorder, recorder.close());
  CHECK(flags[1] != 0);  // since the first frame
  record::Recording recording;
  must(recording, recording.open(file.path()));
  const std::vector<std::uint32_t> masked[] = {{0, 1, 0, 3}, {0, 3}, {0, 1}};
  for (const std::uint32_t f : {0u, 1u, 2u}) {
    record::RecordedFrame frame;
    must(recording, recording.read_frame(f, &frame));
    CHECK(same_values(frame.masked, masked[f]));
    CHECK(frame.stats.instances_masked == masked[f].size() / 2);
  }
}

TEST_CASE("static bodies and levels of detail are recorded") {
  const RecordingFile file("levels");
  Random random(704);
  const EnginePtr engine = make_engine();
  const Rig rig = random_rig(random, Topology::kTree, 9, 2);
  const ArticulationId fine = add_rig(*engine, rig);
  const Poses poses = random_poses(random, rig, 8, PoseFormat::kMatrix3x4Rows, {0.5, false, true, {}});
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  must(recorder, recorder.add_articulation(fine, rig.desc()));
  const BatchDesc fine_desc = {fine, 8, BatchKind::kCharacters};
  BatchId fine_batch, level_batch, coarse_batch;
  require(add_batch(*engine, fine_desc, &fine_batch));
  must(recorder, recorder.add_batch(fine_batch, fine_desc));

  const float triangle[] = {-9, -9, 0, 9, -9, 0, 0, 9, 0.1f};
  const std::uint32_t corners[] = {0, 1, 2};
  ConvexPart ball;
  ball.kind = ShapeKind::kSphere;
  ball.size[0] = 0.5f;
  StaticBody body;
  body.box = cube(0.5f).leaves[0].box;
  body.parts = {&ball, 1};
  StaticDesc level;
  level.bodies = {&body, 1};
  level.vertices = triangle;
  level.triangles = corners;
  require(add_static_batch(*engine, level, &level_batch));
  must(recorder, recorder.add_static_batch(level_batch, level, {"level", {}}));

  for (const LodKind kind : {LodKind::kReach, LodKind::kNodes}) {
    LodDesc lod;
    lod.of = fine;
    lod.kind = kind;
    lod.max_leaves = 3;
    lod.rest_poses = poses.input({1}).poses;
    lod.joint_play = 10;
    ArticulationId coarse;
    require(add_lod(*engine, lod, &coarse));
    must(recorder, recorder.add_lod(coarse, lod));
    const BatchDesc desc = {coarse, 8, BatchKind::kCharacters};
    require(add_batch(*engine, desc, &coarse_batch));
    must(recorder, recorder.add_batch(coarse_batch, desc));

    const std::uint32_t near[] = {0, 2, 3}, far[] = {1, 4, 7};
    std::vector<BatchInput> inputs = {poses.input(fine_batch), poses.input(coarse_batch), {}};
    inputs[0].instances = near;
    inputs[1].instances = far;
    inputs[2].batch = level_batch;
    const std::vector<PairRule> rules = {{fine_batch, coarse_batch, Pairing::kBetween},
                                         {fine_batch, level_batch, Pairing::kBetween},
                                         {coarse_batch, coarse_batch, Pairing::kBetween}};
    std::vector<Hit> hits(4096);
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.hits = hits;
    require(run_frame(*engine, job));
    CHECK(job.hit_count > 0);
    must(recorder, recorder.add_frame(job, 1));
  }
  must(recorder, recorder.close());

  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.articulation_count() == 3);
  CHECK(recording.articulation(2).is_lod);
  CHECK(recording.articulation(2).lod.kind == LodKind::kNodes);
  CHECK(recording.batch(1).is_static);
  CHECK(recording.batch(1).instance_count == 2);
  CHECK(recording.batch(1).static_desc.bodies[0].parts[0].kind == ShapeKind::kSphere);
  record::Player player;
  must(player, player.open(recording));
  for (std::uint32_t f = 0; f < 2; ++f) {
    record::RecordedFrame frame;
    must(recording, recording.read_frame(f, &frame));
    REQUIRE(frame.job.inputs[0].instances.size == 3);
    CHECK(frame.job.inputs[0].instances[2] == 3);
    must(player, player.run(frame));
    CHECK(player.hits().size == frame.hits.size);
    CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
  }
}

TEST_CASE("what cannot be recorded is refused in words, and the file stays whole") {
  const RecordingFile file("refused");
  record::Recorder recorder;
  const auto refuses = [&](bool ok, const std::string& words) {
    CHECK_FALSE(ok);
    INFO(recorder.error());
    CHECK(std::string(recorder.error()).find(words) != std::string::npos);
  };
  CHECK(std::string(recorder.error()).empty());
  refuses(recorder.add_frame({}, 0), "no recording is open");
  refuses(recorder.open("/nowhere/at/all.cab"), "/nowhere/at/all.cab: cannot be opened for writing");
  record::RecorderOptions options;
  options.pose_step = 0.001f;
  refuses(recorder.open(file.path(), options), "power of two");
  options = {};
  options.metres_per_unit = -1;
  refuses(recorder.open(file.path(), options), "seconds_per_frame and metres_per_unit are finite");
  options = {};
  options.up = 'u';
  refuses(recorder.open(file.path(), options), "up is x, y or z");
  CubeRow row;
  must(recorder, recorder.open(file.path()));
  const BatchId batch = row.add(recorder, 3);
  refuses(recorder.add_batch({9}, {{77}, 1, BatchKind::kCharacters}), "was not told");
  refuses(recorder.add_lod({9}, {}), "was not told");
  const char* const names[] = {"one", "two"};
  refuses(recorder.add_articulation({9}, row.rig.desc(), {"cube", names}), "not each one");
  FrameJob job = row.run(batch, 3);
  job.report = Report::kInContact;
  refuses(recorder.add_frame(job, 0), "in_contact");
  job.report = Report::kHits;
  row.rules[0].resting = Resting::kSkipped;
  refuses(recorder.add_frame(job, 0), "rests");
  row.rules[0].resting = Resting::kReported;
  row.rules[0].b = {55};
  refuses(recorder.add_frame(job, 0), "was not told");
  row.rules[0].b = batch;
  for (const double time : {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()})
    refuses(recorder.add_frame(job, time), "the time of a frame must be finite");
  must(recorder, recorder.add_batch({8}, {row.articulation, 4, BatchKind::kSequence}));
  row.inputs.push_back(row.inputs[0]);
  row.inputs[1].batch = {8};
  job.inputs = row.inputs;
  refuses(recorder.add_frame(job, 0), "sequences beside characters");
  row.inputs.pop_back();
  job.inputs = row.inputs;
  must(recorder, recorder.add_frame(job, 0));
  must(recorder, recorder.close());
  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.frame_count() == 1);
  CHECK(recording.problems().empty());
}

TEST_CASE("sequences of different lengths end at their own moments") {
  Random random(705);
  const RecordingFile file("unequal");
  const EnginePtr engine = make_engine();
  const Rig rig = random_rig(random, Topology::kChain, 4, 2);
  const ArticulationId articulation = add_rig(*engine, rig);
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  must(recorder, recorder.add_articulation(articulation, rig.desc()));
  const std::uint32_t counts[] = {3, 40, 1}, rooms[] = {5, 40, 9};
  std::vector<Poses> poses;
  std::vector<BatchInput> inputs;
  std::vector<BatchId> ids(3);
  for (std::size_t b = 0; b < 3; ++b) {
    const BatchDesc desc = {articulation, rooms[b], BatchKind::kSequence};
    require(add_batch(*engine, desc, &ids[b]));
    must(recorder, recorder.add_batch(ids[b], desc));
    poses.push_back(random_poses(random, rig, rooms[b], PoseFormat::kMatrix3x4Rows, {0.4, true, true, {}}));
  }
  for (std::size_t b = 0; b < 3; ++b) {
    inputs.push_back(poses[b].input(ids[b]));
    inputs.back().count = counts[b];
  }
  const std::vector<PairRule> rules = {{ids[0], ids[2], Pairing::kBetween}, {ids[1], ids[2], Pairing::kBetween}};
  std::vector<Hit> hits(4096);
  FrameJob job;
  job.inputs = inputs;
  job.rules = rules;
  job.hits = hits;
  require(run_frame(*engine, job));
  must(recorder, recorder.add_frame(job, 0));
  must(recorder, recorder.close());
  record::Recording recording;
  must(recording, recording.open(file.path()));
  REQUIRE(recording.frame_count() == 40);
  record::Player player;
  must(player, player.open(recording));
  std::size_t found = 0;
  for (std::uint32_t m = 0; m < 40; ++m) {
    record::RecordedFrame frame;
    must(recording, recording.read_frame(m, &frame));
    CHECK(frame.job.inputs.size == (m < 3 ? 3 : 2));
    must(player, player.run(frame));
    CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
    found += frame.hits.size;
  }
  CHECK(found == job.hit_count);
  CHECK(found > 40);
}

TEST_CASE("of a job with a moment that is refused no frame is recorded") {
  Random random(706);
  const RecordingFile file("half");
  const Rig rig = random_rig(random, Topology::kChain, 2, 1);
  Poses poses = random_poses(random, rig, 8, PoseFormat::kQuaternionTranslation, {});
  record::Recorder recorder;
  record::RecorderOptions options;
  options.pose_step = 1.0f / 1024;
  must(recorder, recorder.open(file.path(), options));
  must(recorder, recorder.add_articulation({1}, rig.desc()));
  must(recorder, recorder.add_batch({1}, {{1}, 8, BatchKind::kSequence}));
  CHECK(record::round_poses(poses.data, options.pose_step));
  poses.pose(5, 1)[4] += 0.0001f;
  const BatchInput input = poses.input({1});
  FrameJob job;
  job.inputs = {&input, 1};
  CHECK_FALSE(recorder.add_frame(job, 0));
  CHECK(recorder.frame_count() == 0);
  must(recorder, recorder.close());
}

TEST_CASE("a frame that is refused leaves nothing in the file") {
  Random random(707);
  const RecordingFile file("refused_frames");
  const Rig rig = random_rig(random, Topology::kChain, 2, 1);
  record::RecorderOptions options;
  options.pose_step = 1.0f / 1024;
  Poses many = random_poses(random, rig, 40, PoseFormat::kQuaternionTranslation, {});
  Poses few = random_poses(random, rig, 2, PoseFormat::kQuaternionTranslation, {});
  CHECK(record::round_poses(many.data, options.pose_step));
  CHECK(record::round_poses(few.data, options.pose_step));
  Poses unrounded = few;
  unrounded.pose(1, 0)[4] += 0.0001f;
  const std::uint32_t beyond[] = {0, 2};
  const auto bytes_with = [&](int refused) {
    record::Recorder recorder;
    must(recorder, recorder.open(file.path(), options));
    must(recorder, recorder.add_articulation({1}, rig.desc()));
    must(recorder, recorder.add_batch({1}, {{1}, 40, BatchKind::kCharacters}));
    must(recorder, recorder.add_batch({2}, {{1}, 2, BatchKind::kCharacters}));
    std::vector<BatchInput> inputs(2);
    inputs[0] = many.input({1});
    FrameJob job;
    job.inputs = inputs;
    for (int f = 0; f < 2; ++f) {
      for (int k = 0; k < refused; ++k) {
        inputs[1] = unrounded.input({2});
        CHECK_FALSE(recorder.add_frame(job, f));
        inputs[1] = few.input({2});
        inputs[1].poses.data = nullptr;
        CHECK_FALSE(recorder.add_frame(job, f));
        inputs[1] = few.input({2});
        inputs[1].instances = beyond;
        CHECK_FALSE(recorder.add_frame(job, f));
      }
      inputs[1] = few.input({2});
      must(recorder, recorder.add_frame(job, f));
    }
    must(recorder, recorder.close());
    return file.bytes();
  };
  CHECK(bytes_with(0) == bytes_with(100));
}

// Two frames of a row of cubes, each in a chunk of its own.
std::vector<std::uint8_t> two_chunks(bool compress) {
  const RecordingFile file("two_chunks");
  CubeRow row;
  record::Recorder recorder;
  record::RecorderOptions options;
  options.compress = compress;
  must(recorder, recorder.open(file.path(), options));
  const BatchId batch = row.add(recorder, 40);
  for (int f = 0; f < 2; ++f) {
    must(recorder, recorder.add_frame(row.run(batch, 40), f));
    must(recorder, recorder.flush());
  }
  must(recorder, recorder.close());
  return file.bytes();
}

TEST_CASE("what is appended behind any cut is read") {
  for (const bool compress : {false, true}) {
    const std::vector<std::uint8_t> whole = two_chunks(compress);
    const RecordingFile file("cut_and_append");
    for (std::size_t cut = 0; cut <= whole.size(); cut += cut + 80 > whole.size() || cut < 80 ? 1 : 7) {
      CAPTURE(cut);
      file.write({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut)});
      std::uint32_t before = 0;
      {
        record::Recording recording;
        if (recording.open(file.path())) before = recording.frame_count();
      }
      CubeRow row;
      record::Recorder recorder;
      record::RecorderOptions options;
      options.append = true;
      options.compress = compress;
      must(recorder, recorder.open(file.path(), options));
      const BatchId batch = row.add(recorder, 40);
      must(recorder, recorder.add_frame(row.run(batch, 40), 9));
      must(recorder, recorder.close());
      record::Recording recording;
      must(recording, recording.open(file.path()));
      CHECK(recording.problems().empty());
      REQUIRE(recording.frame_count() == before + 1);
      record::RecordedFrame frame;
      must(recording, recording.read_frame(before, &frame));
      CHECK(frame.hits.size == 39);
    }
  }
}

TEST_CASE("a recording is closed by close alone, and again by a recorder that appends nothing") {
  const RecordingFile file("closed");
  const auto is_closed = [&] {
    record::Recording recording;
    must(recording, recording.open(file.path()));
    CHECK(recording.problems().empty() == recording.is_closed());
    CHECK(recording.frame_count() == 2);
    return recording.is_closed();
  };
  const std::vector<std::uint8_t> whole = two_chunks(false);
  file.write(whole);
  CHECK(is_closed());
  {
    record::Recorder recorder;
    record::RecorderOptions options;
    options.append = true;
    must(recorder, recorder.open(file.path(), options));
    CHECK_FALSE(is_closed());
    must(recorder, recorder.flush());
    CHECK_FALSE(is_closed());
    must(recorder, recorder.close());
    CHECK(is_closed());
    CHECK(file.bytes() == whole);
    must(recorder, recorder.open(file.path(), options));
  }
  CHECK(is_closed());  // the destructor closes
}

TEST_CASE("nothing is appended to a recording that is damaged before its end") {
  std::vector<std::uint8_t> bytes = two_chunks(false);
  const RecordingFile file("damaged_append");
  bytes[16 + 44] = static_cast<std::uint8_t>(bytes[16 + 44] ^ 1);  // of the first header
  file.write(bytes);
  record::Recorder recorder;
  record::RecorderOptions options;
  options.append = true;
  CHECK_FALSE(recorder.open(file.path(), options));
  CHECK(std::string(recorder.error()).find("append: the recording is damaged") != std::string::npos);
  CHECK(file.bytes() == bytes);
  // Damage after the first chunk: the recording opens, with the frames before it.
  bytes = two_chunks(false);
  bytes[bytes.size() - 40] = static_cast<std::uint8_t>(bytes[bytes.size() - 40] ^ 1);
  file.write(bytes);
  CHECK(record::Recording().open(file.path()));
  CHECK_FALSE(recorder.open(file.path(), options));
  CHECK(std::string(recorder.error()).find("append: the recording is damaged") != std::string::npos);
  CHECK(file.bytes() == bytes);
  file.write({'n', 'o', 't', 'e', 's'});
  CHECK_FALSE(recorder.open(file.path(), options));
  CHECK(std::string(recorder.error()).find("it does not begin with CABREC") != std::string::npos);
  CHECK(file.bytes().size() == 5);
}

TEST_CASE("a file that readers have open is made anew beside them") {
  const RecordingFile file("anew");
  file.write(two_chunks(false));
  record::Recording recording;
  must(recording, recording.open(file.path()));
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  record::RecordedFrame frame;
  must(recording, recording.read_frame(1, &frame));
  CHECK(frame.hits.size == 39);
}

TEST_CASE("a frame that no chunk has room for is refused before its hits are read") {
  const RecordingFile file("large");
  CubeRow row;
  record::Recorder recorder;
  must(recorder, recorder.open(file.path()));
  const BatchId batch = row.add(recorder, 3);
  FrameJob job = row.run(batch, 3);
  // A chunk has 2 GB. There are no such hits; they would leave a megabyte of it, and the rules need more.
  job.hits.size = job.hit_count = ((std::size_t{1} << 31) - (std::size_t{1} << 20)) / sizeof(Hit);
  row.rules.assign(100000, row.rules[0]);
  job.rules = row.rules;
  CHECK_FALSE(recorder.add_frame(job, 0));
  CHECK(std::string(recorder.error()).find("bytes is too large: chunks have 2 GB") != std::string::npos);
}

#ifdef __linux__
TEST_CASE("a full disk is told, what was whole stays, and nothing more is written") {
  record::Recorder recorder;
  CHECK_FALSE(recorder.open("/dev/full"));
  CHECK(std::string(recorder.error()).find("cannot write") != std::string::npos);

  const RecordingFile file("full");
  constexpr std::size_t kRoom = 40000;
  CubeRow row;
  must(recorder, recorder.open(file.path()));
  const BatchId batch = row.add(recorder, 40);
  rlimit before = {}, limit = {};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  limit = before;
  limit.rlim_cur = kRoom;
  const auto on_signal = std::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(setrlimit(RLIMIT_FSIZE, &limit) == 0);
  std::uint32_t written = 0;
  const auto record_one = [&] { return recorder.add_frame(row.run(batch, 40), written) && recorder.flush(); };
  while (written < 1000 && record_one()) ++written;
  const std::string reason = recorder.error();
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, on_signal);
  CHECK(reason.find("cannot write: File too large") != std::string::npos);
  CHECK_FALSE(record_one());
  CHECK(std::string(recorder.error()).find("after a failure") != std::string::npos);
  CHECK_FALSE(recorder.close());
  CHECK(written > 5);
  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.frame_count() == written);
  CHECK(recording.problems().size == 1);
}

TEST_CASE("chunks that were written outlive the process") {
  const RecordingFile file("killed");
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    CubeRow row;
    record::Recorder recorder;
    bool ok = recorder.open(file.path());
    const BatchId batch = row.add(recorder, 40);
    for (int f = 0; f < 5; ++f) ok = ok && recorder.add_frame(row.run(batch, 40), f) && recorder.flush();
    ok = ok && recorder.add_frame(row.run(batch, 40), 5);
    _exit(ok ? 0 : 1);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
  record::Recording recording;
  must(recording, recording.open(file.path()));
  CHECK(recording.frame_count() == 5);
  CHECK_FALSE(recording.is_closed());
  REQUIRE(recording.problems().size == 1);
  CHECK(std::string(recording.problems()[0]).find("frames from 5 on may be missing") != std::string::npos);
}
#endif

}  // namespace
}  // namespace cab::tests
