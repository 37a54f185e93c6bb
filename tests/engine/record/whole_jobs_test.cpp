// Every member of a frame's job, with its batches there or absent: recorded, read back, and run again.
#include <array>
#include <optional>

#include "layout/pose_coding.h"
#include "tests/engine/record/recorded_world.h"

namespace cab::tests {
namespace {

using namespace cab::oracle;

// The arrays of one batch, in memory with gaps.
struct Given {
  std::uint32_t size = 0;
  PoseView view;
  std::vector<float> poses, scales, margins, orientations;
  std::vector<double> origins;
  std::vector<std::uint32_t> layers, layer_masks, instances;
  std::uint32_t count = kAllInstances;

  std::uint32_t used() const { return std::min(count, size); }
  BatchInput input(BatchId batch) const {
    BatchInput out;
    out.batch = batch;
    out.poses = view;
    out.origins = origins;
    out.orientations = orientations;
    out.scales = scales;
    out.margins = margins;
    out.layers = layers;
    out.layer_masks = layer_masks;
    out.instances = instances;
    out.count = count;
    return out;
  }
};

constexpr float kNothing = -77;  // between poses

void give_poses(Random& random, std::uint32_t links, Given& to) {
  PoseView& view = to.view;
  view.format = static_cast<PoseFormat>(random.index(3));
  view.has_scale = view.format != PoseFormat::kQuaternionTranslation && random.chance(0.5);
  const std::size_t floats = pose_floats(view.format);
  const std::size_t link_stride = floats + random.index(3), stride = links * link_stride + random.index(4);
  to.poses.assign(to.size * stride + 4, kNothing);
  for (std::uint32_t i = 0; i < to.size; ++i)
    for (std::uint32_t l = 0; l < links; ++l) {
      float* const pose = to.poses.data() + i * stride + l * link_stride;
      double q[4];
      random_turn(random, q);
      Vec3<double> at{};
      for (double& x : at.v) x = random.uniform(-1.5, 1.5);
      write_pose(view.format, q, at, pose);
      if (view.has_scale) scale_matrix(view.format, static_cast<float>(random.uniform(0.5, 2)), pose);
    }
  view.data = to.poses.data();
  view.link_stride = random.chance(0.5) || link_stride > floats ? 4 * link_stride : 0;
  view.instance_stride = 4 * stride;
}

template <class T, class Value>
void maybe(Random& random, double chance, std::size_t count, std::vector<T>& values, Value value) {
  values.clear();
  if (!random.chance(chance)) return;
  for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<T>(value()));
}

void give_rest(Random& random, Given& to) {
  const std::size_t n = to.size;
  maybe(random, 0.5, 3 * n, to.origins, [&] { return random.uniform(-0.5, 0.5); });
  maybe(random, 0.5, 4 * n, to.orientations, [&] { return random.uniform(0.1, 1); });
  maybe(random, to.view.has_scale ? 0 : 0.5, n, to.scales, [&] { return random.uniform(0.5, 2); });
  maybe(random, 0.3, n, to.margins, [&] { return random.uniform(0, 0.1); });
  maybe(random, 0.3, n, to.layers, [&] { return 1u << random.index(3); });
  maybe(random, 0.3, n, to.layer_masks, [&] { return random.index(8); });
  to.count = random.chance(0.3) ? random.index(to.size + 1) : kAllInstances;
  to.instances.clear();
  if (random.chance(0.3))
    for (std::uint32_t i = 0; i < to.used(); ++i)
      if (random.chance(0.5)) to.instances.push_back(i);
}

// The first entries of a span, `each` for each instance that takes part.
template <class T>
void check_first(Span<const T> read, const std::vector<T>& given, std::size_t used, std::size_t each) {
  REQUIRE(read.size == (given.empty() ? 0 : used * each));
  CHECK((read.empty() || std::memcmp(read.data, given.data(), read.size * sizeof(T)) == 0));
}

void check_input(const BatchInput& read, const Given& given, std::uint32_t links) {
  const std::size_t used = given.used();
  CHECK(read.count == used);
  CHECK(read.poses.format == given.view.format);
  CHECK(read.poses.has_scale == given.view.has_scale);
  check_first(read.origins, given.origins, used, 3);
  check_first(read.orientations, given.orientations, used, 4);
  check_first(read.scales, given.scales, used, 1);
  check_first(read.margins, given.margins, used, 1);
  check_first(read.layers, given.layers, used, 1);
  check_first(read.layer_masks, given.layer_masks, used, 1);
  CHECK(same_values(read.instances, given.instances));
  const std::size_t floats = pose_floats(given.view.format), link_stride = link_bytes(given.view) / sizeof(float);
  for (std::size_t i = 0; i < used; ++i)
    for (std::size_t l = 0; l < links; ++l) {
      const bool is_listed =
          given.instances.empty() || std::binary_search(given.instances.begin(), given.instances.end(), i);
      const float* const pose = read.poses.data + (i * links + l) * floats;
      if (is_listed)
        CHECK(std::memcmp(pose, given.view.data + i * given.view.instance_stride / 4 + l * link_stride,
                          floats * sizeof(float)) == 0);
    }
}

struct Written {
  std::array<std::optional<Given>, 3> given;
  bool has_level = false;
  FrameJob job;  // its spans are gone
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
};

TEST_CASE("every member of a job is recorded, of batches that come, stay the same and are absent") {
  Random random(741);
  std::size_t hits = 0, frames = 0, same_behind_a_gap = 0;
  for (std::uint64_t round = 0; round < rounds(60); ++round) {
    CAPTURE(round);
    const RecordingFile file("whole_jobs");
    const Rig rig = random_rig(random, Topology::kChain, 3, 2);
    const EnginePtr engine = make_engine();
    const ArticulationId articulation = add_rig(*engine, rig);
    record::Recorder recorder;
    record::RecorderOptions options;
    options.compress = random.chance(0.5);
    must(recorder, recorder.open(file.path(), options));
    must(recorder, recorder.add_articulation(articulation, rig.desc()));
    StaticBody body;
    body.box = rig.leaves[0].box;
    StaticDesc level;
    level.bodies = {&body, 1};
    BatchId level_id;
    require(add_static_batch(*engine, level, &level_id));
    must(recorder, recorder.add_static_batch(level_id, level));
    std::array<BatchId, 3> ids;
    std::array<Given, 3> given;
    std::array<bool, 3> is_same = {};
    for (std::size_t b = 0; b < 3; ++b) {
      given[b].size = 3 + random.index(20);
      const BatchDesc desc = {articulation, given[b].size, BatchKind::kCharacters};
      require(add_batch(*engine, desc, &ids[b]));
      must(recorder, recorder.add_batch(ids[b], desc));
    }
    std::vector<Written> written;
    for (int f = 0; f < 8; ++f) {
      Written& frame = written.emplace_back();
      std::vector<BatchInput> inputs;
      std::array<bool, 3> was_absent = {};
      for (std::size_t b = 0; b < 3; ++b) {
        was_absent[b] = f > 0 && !written[static_cast<std::size_t>(f) - 1].given[b];
        is_same[b] = f > 0 && random.chance(0.4);
        if (!is_same[b]) {
          if (f == 0 || random.chance(0.7)) give_poses(random, 3, given[b]);
          give_rest(random, given[b]);
        }
        if (random.chance(0.25)) continue;
        frame.given[b] = given[b];
        frame.given[b]->view.data = frame.given[b]->poses.data();
        inputs.push_back(given[b].input(ids[b]));
        if (is_same[b] && was_absent[b]) ++same_behind_a_gap;
      }
      frame.has_level = random.chance(0.5);
      if (frame.has_level) {
        inputs.emplace_back();
        inputs.back().batch = level_id;
      }
      std::vector<PairRule> rules;
      for (const BatchInput& a : inputs)
        for (const BatchInput& b : inputs) {
          if (a.batch.value > b.batch.value || (a.batch.value == level_id.value && b.batch.value == a.batch.value))
            continue;
          rules.push_back({a.batch, b.batch, Pairing::kBetween});
          if (a.batch.value == b.batch.value) rules.push_back({a.batch, b.batch, Pairing::kWithin});
        }
      FrameJob& job = frame.job;
      job.margin = random.chance(0.5) ? 0.05f : 0;
      const bool exact = random.chance(0.5), contacts = exact && random.chance(0.6);
      if (exact) job.policies.exact = Exact::kConvex;
      if (contacts && random.chance(0.4)) job.report = Report::kDistances;
      if (exact && random.chance(0.3)) job.min_depth = 0.02f;
      job.containment = f % 3 != 0;
      frame.hits.resize(20000);
      if (contacts) frame.contacts.resize(20000);
      job.inputs = inputs;
      job.rules = rules;
      job.hits = frame.hits;
      job.contacts = frame.contacts;
      require(run_frame(*engine, job));
      must(recorder, recorder.add_frame(job, f));
      frame.hits.resize(job.hit_count);
      if (contacts) frame.contacts.resize(job.hit_count);
      if (random.chance(0.2)) must(recorder, recorder.flush());
    }
    must(recorder, recorder.close());

    record::Recording recording;
    must(recording, recording.open(file.path()));
    CHECK(recording.problems().empty());
    REQUIRE(recording.frame_count() == written.size());
    record::Player player;
    must(player, player.open(recording));
    for (std::uint32_t f = 0; f < written.size(); ++f) {
      const Written& expected = written[f];
      record::RecordedFrame frame;
      must(recording, recording.read_frame(f, &frame));
      std::size_t at = 0;
      for (std::size_t b = 0; b < 3; ++b)
        if (expected.given[b]) {
          REQUIRE(at < frame.job.inputs.size);
          check_input(frame.job.inputs[at++], *expected.given[b], 3);
        }
      CHECK(frame.job.inputs.size == at + (expected.has_level ? 1 : 0));
      CHECK(frame.job.margin == expected.job.margin);
      CHECK(frame.job.min_depth == expected.job.min_depth);
      CHECK(frame.job.containment == expected.job.containment);
      CHECK(frame.job.report == expected.job.report);
      CHECK(frame.has_contacts == !expected.job.contacts.empty());
      CHECK(same_values(frame.hits, expected.hits));
      CHECK(same_values(frame.contacts, expected.contacts));
      must(player, player.run(frame));
      CHECK(record::hash_hits(player.hits(), player.contacts()) == frame.hash);
      hits += frame.hits.size;
      ++frames;
    }
  }
  CHECK(hits > 5 * frames);
  CHECK(same_behind_a_gap > 0);
}

}  // namespace
}  // namespace cab::tests
