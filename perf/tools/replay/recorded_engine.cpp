#include "perf/tools/replay/recorded_engine.h"

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
    engine_ = make_engine({.isa = settings.isa, .thread_count = settings.thread_count});
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
    has_skins_ = has_skins_ || !desc.skin.vertices.empty();
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

  void add_rule(const PairRule& rule) { rules_.push_back(rule); }

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
    job.containment = settings_.containment;
    const bool has_contacts = settings_.policies.exact != Exact::kNone && !has_skins_;
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
  bool has_skins_ = false;  // which have no contacts
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
  for (const PairRule& rule : rules_of(scene, batches, within)) engine.add_rule(rule);

  const std::vector<std::size_t> counts(batches.size(), 1);
  std::vector<std::vector<float>> poses(batches.size());
  for (std::uint32_t f = frames.first; f < frames.end; ++f) {
    std::vector<BatchInput> inputs(batches.size());
    for (std::size_t c = 0; c < batches.size(); ++c) {
      const scenes::Character& character = scene.characters[c];
      inputs[c] = input_of(character, batches[c], {f, f + 1});
      const auto* const given = static_cast<const float*>(inputs[c].poses.data);
      poses[c].assign(given, given + character.link_parents.size() * pose_floats(character.pose_format));
      engine.round(poses[c]);
      inputs[c].poses.data = poses[c].data();
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
    for (const BatchId other : batches) engine.add_rule({other, batches.back()});
  }
  if (crowd.level.count() > 0) {
    const BatchId level = engine.add(crowd.level.desc(), "level");
    for (const BatchId other : batches) engine.add_rule({other, level});
    batches.push_back(level);
    counts.push_back(crowd.level.count());
  }
  std::vector<scenes::PosedGroup> posed;
  for (std::uint32_t f = 0; f < frame_count; ++f) {
    scenes::pose_crowd(crowd, f / kCrowdFramesPerSecond, posed);
    std::vector<BatchInput> inputs(batches.size());
    for (std::size_t g = 0; g < posed.size(); ++g) {
      engine.round(posed[g].poses);
      inputs[g] = input_of(posed[g], batches[g]);
    }
    inputs.back().batch = batches.back();  // the level's, if there is one
    engine.run(inputs, counts, f / kCrowdFramesPerSecond);
    on_frame();
  }
  return engine.close();
}

}  // namespace cab::perf
