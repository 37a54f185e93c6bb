#include "perf/tools/replay/recorded_engine.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "perf/base/crowd_session.h"
#include "perf/base/engine_call.h"
#include "perf/base/output_file.h"

namespace cab::perf {
namespace {

std::vector<const char*> pointers_to(const std::vector<std::string>& texts) {
  std::vector<const char*> pointers;
  for (const std::string& text : texts) pointers.push_back(text.c_str());
  return pointers;
}

class RecordedEngine {
 public:
  RecordedEngine(const RecordSettings& settings, double seconds_per_frame)
      : settings_(settings), place_(settings.path) {
    EngineDesc desc;
    desc.isa = settings.isa;
    desc.thread_count = settings.thread_count;
    engine_ = make_engine(desc);
    record::RecorderOptions options;
    options.title = settings.title.c_str();
    options.seconds_per_frame = seconds_per_frame;
    options.metres_per_unit = settings.metres_per_unit;
    options.up = settings.up;
    options.isa = engine_isa(*engine_);
    options.thread_count = engine_thread_count(*engine_);
    options.compress = settings.compress;
    options.pose_step = settings.pose_step;
    written(recorder_.open(place_.path().c_str(), options));
  }

  BatchId add(const scenes::Character& character, const ArticulationDesc& desc, std::uint32_t count) {
    BatchDesc batch;
    batch.instance_count = count;
    require(add_articulation(*engine_, desc, &batch.articulation), character.name);
    BatchId id;
    require(add_batch(*engine_, batch, &id), character.name);
    const std::vector<const char*> links = pointers_to(character.link_names);
    written(recorder_.add_articulation(batch.articulation, desc, {character.name.c_str(), links}));
    written(recorder_.add_batch(id, batch, {character.name.c_str(), {}}));
    return id;
  }

  BatchId add(const StaticDesc& desc, const char* name) {
    BatchId id;
    require(add_static_batch(*engine_, desc, &id), name);
    written(recorder_.add_static_batch(id, desc, {name, {}}));
    return id;
  }

  void pair(BatchId a, BatchId b, Pairing pairing) { rules_.push_back({a, b, pairing}); }

  // Runs a frame and writes it. flags of inputs are filled here.
  void run(std::vector<BatchInput>& inputs, const std::vector<std::size_t>& counts, double time) {
    flags_.resize(inputs.size());
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      flags_[i].assign(counts[i], 0);
      inputs[i].flags = flags_[i];
    }
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules_;
    job.policies = settings_.policies;
    job.margin = settings_.margin;
    job.min_depth = settings_.min_depth;
    const bool has_contacts = settings_.policies.exact != Exact::kNone;
    require(run_with_room(job, hits_, has_contacts ? &contacts_ : nullptr, [&] { return run_frame(*engine_, job); }),
            "frame");
    written(recorder_.add_frame(job, time));
    hit_count_ += job.hit_count;
  }

  RecordTotals close() {
    written(recorder_.close());
    place_.keep();
    return {recorder_.frame_count(), hit_count_, recorder_.byte_count()};
  }

  // Poses as the recording holds them.
  void round(std::vector<float>& poses) const {
    if (settings_.pose_step > 0 && !record::round_poses(poses, settings_.pose_step))
      throw std::runtime_error(settings_.path + ": a pose is out of reach of 32767 steps of " +
                               std::to_string(settings_.pose_step) + ", or is no pose; choose a larger --pose-step");
  }

 private:
  // The message of a failure begins with the path that was asked for, not with that of the file aside.
  void written(bool ok) const {
    if (ok) return;
    const std::string error = recorder_.error(), &aside = place_.path();
    throw std::runtime_error(error.rfind(aside, 0) == 0 ? settings_.path + error.substr(aside.size()) : error);
  }

  const RecordSettings& settings_;
  FileAside place_;
  oracle::EnginePtr engine_;
  record::Recorder recorder_;
  std::vector<PairRule> rules_;
  std::vector<std::vector<std::uint8_t>> flags_;
  std::vector<Hit> hits_;
  std::vector<Contact> contacts_;
  std::uint64_t hit_count_ = 0;
};

}  // namespace

RecordTotals record_scene(const scenes::Scene& scene, FrameRange frames, bool within, const RecordSettings& settings,
                          const OnFrame& on_frame) {
  RecordedEngine engine(settings, scene.frame_seconds);
  std::vector<BatchId> batches;
  for (const scenes::Character& character : scene.characters) {
    if (settings.pose_step > 0 && character.pose_format != PoseFormat::kQuaternionTranslation)
      throw std::runtime_error(character.name + ": its poses are matrices, which --pose-step does not round");
    const scenes::ArticulationStorage storage(character);
    batches.push_back(engine.add(character, storage.desc(), 1));
  }
  const auto is_static = [&](std::size_t c) { return scene.characters[c].is_static; };
  for (std::size_t a = 0; a < batches.size(); ++a) {
    if (within && !is_static(a)) engine.pair(batches[a], batches[a], Pairing::kWithin);
    for (std::size_t b = a + 1; scene.pairs.empty() && b < batches.size(); ++b)
      if (!is_static(a) || !is_static(b)) engine.pair(batches[a], batches[b], Pairing::kBetween);
  }
  for (const scenes::CharacterPair& pair : scene.pairs)
    engine.pair(batches[pair.a], batches[pair.b], Pairing::kBetween);

  const std::vector<std::size_t> counts(batches.size(), 1);
  std::vector<std::vector<float>> poses(batches.size());
  for (std::uint32_t f = frames.first; f < frames.end; ++f) {
    std::vector<BatchInput> inputs(batches.size());
    for (std::size_t c = 0; c < batches.size(); ++c) {
      const scenes::Character& character = scene.characters[c];
      const std::size_t at = is_static(c) ? 0 : f;
      const std::size_t floats = character.link_parents.size() * pose_floats(character.pose_format);
      poses[c].assign(character.poses.begin() + static_cast<std::ptrdiff_t>(at * floats),
                      character.poses.begin() + static_cast<std::ptrdiff_t>((at + 1) * floats));
      engine.round(poses[c]);
      inputs[c].batch = batches[c];
      inputs[c].poses.format = character.pose_format;
      inputs[c].poses.data = poses[c].data();
      if (!character.origins.empty()) inputs[c].origins = {character.origins.data() + at * 3, 3};
    }
    engine.run(inputs, counts, f * scene.frame_seconds);
    on_frame();
  }
  return engine.close();
}

RecordTotals record_crowd(const scenes::Crowd& crowd, std::uint32_t frame_count, const RecordSettings& settings,
                          const OnFrame& on_frame) {
  RecordedEngine engine(settings, 1 / kCrowdFramesPerSecond);
  std::vector<BatchId> batches;
  std::vector<std::size_t> counts;
  for (const scenes::CrowdGroup& group : crowd.groups) {
    const scenes::ArticulationStorage storage(group.figure);
    batches.push_back(engine.add(group.figure, storage.desc(), group.count));
    counts.push_back(group.count);
    for (const BatchId other : batches) engine.pair(other, batches.back(), Pairing::kBetween);
  }
  if (crowd.level.count() > 0) {
    const BatchId level = engine.add(crowd.level.desc(), "level");
    for (const BatchId other : batches) engine.pair(other, level, Pairing::kBetween);
    batches.push_back(level);
    counts.push_back(crowd.level.count());
  }
  std::vector<scenes::PosedGroup> posed;
  for (std::uint32_t f = 0; f < frame_count; ++f) {
    scenes::pose_crowd(crowd, f / kCrowdFramesPerSecond, posed);
    std::vector<BatchInput> inputs(batches.size());
    for (std::size_t b = 0; b < batches.size(); ++b) {
      inputs[b].batch = batches[b];
      if (b >= posed.size()) continue;
      engine.round(posed[b].poses);
      inputs[b].poses.data = posed[b].poses.data();
      inputs[b].origins = posed[b].origins;
      inputs[b].orientations = posed[b].orientations;
    }
    engine.run(inputs, counts, f / kCrowdFramesPerSecond);
    on_frame();
  }
  return engine.close();
}

}  // namespace cab::perf
