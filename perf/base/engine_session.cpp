#include "perf/base/engine_session.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>

#include "perf/base/statistics.h"

namespace cab::perf {
namespace {

// The limits of a block, which is the frames of one run_frame call: of its frames, and of the leaves of all characters
// in all frames. Blocks are large enough to fill tiles and threads. They are small enough for memory (120 bytes per
// leaf) and for a progress bar to move.
constexpr std::uint32_t kMaxBlockFrames = 4096;
constexpr std::size_t kMaxBlockLeaves = std::size_t{1} << 18;

// How many hits per frame the first buffer has room for.
constexpr std::size_t kHitsPerFrame = 8;

std::uint32_t block_frames(const scenes::Scene& scene, std::uint32_t frame_count) {
  std::size_t leaves = 1;
  for (const scenes::Character& character : scene.characters) leaves += character.leaves.size();
  const std::size_t frames = std::max<std::size_t>(kMaxBlockLeaves / leaves, 16);
  return static_cast<std::uint32_t>(std::min<std::size_t>({frames, kMaxBlockFrames, frame_count}));
}

// Checks the sizes of a character's arrays. Otherwise the engine would read past the end of an array that is too short.
void check_arrays(const scenes::Scene& scene, const scenes::Character& character) {
  const std::size_t frames = character.is_static ? 1 : scene.frame_count;
  const std::size_t pose = character.link_parents.size() * pose_floats(character.pose_format);
  if (character.poses.size() != frames * pose || (!character.origins.empty() && character.origins.size() != frames * 3))
    throw std::runtime_error(character.name + ": the scene has poses or origins for another number of frames or links");
  if (character.rest_frame && *character.rest_frame >= frames)
    throw std::runtime_error(character.name + ": the scene has no frame " + std::to_string(*character.rest_frame) +
                             " to take the rest pose from");
}

}  // namespace

ArticulationId add_character(Engine& engine, const scenes::Character& character) {
  const scenes::ArticulationStorage storage(character);
  ArticulationId id;
  std::uint32_t bad_element = 0;
  const Status status = add_articulation(engine, storage.desc(), &id, &bad_element);
  require(status, character.name + ": element " + std::to_string(bad_element));
  return id;
}

std::vector<PairRule> rules_of(const scenes::Scene& scene, const std::vector<BatchId>& batches, bool within) {
  const auto is_static = [&scene](std::size_t c) { return scene.characters[c].is_static; };
  std::vector<PairRule> rules;
  for (std::size_t a = 0; a < batches.size(); ++a) {
    if (within && !is_static(a)) rules.push_back({batches[a], batches[a], Pairing::kWithin});
    for (std::size_t b = a + 1; scene.pairs.empty() && b < batches.size(); ++b)
      if (!is_static(a) || !is_static(b)) rules.push_back({batches[a], batches[b], Pairing::kBetween});
  }
  for (const scenes::CharacterPair& pair : scene.pairs)
    rules.push_back({batches[pair.a], batches[pair.b], Pairing::kBetween});
  return rules;
}

BatchInput input_of(const scenes::Character& character, BatchId batch, FrameRange frames) {
  const std::size_t first = character.is_static ? 0 : frames.first;
  const std::size_t count = character.is_static ? 1 : frames.count();
  BatchInput input;
  input.batch = batch;
  input.poses.format = character.pose_format;
  input.poses.data =
      character.poses.data() + first * character.link_parents.size() * pose_floats(character.pose_format);
  if (!character.origins.empty()) input.origins = {character.origins.data() + first * 3, count * 3};
  return input;
}

EngineSession::EngineSession(const scenes::Scene& scene, const SessionOptions& options)
    : scene_(scene),
      frames_(options.frames),
      within_(options.within),
      min_depth_(options.min_depth),
      containment_(options.containment) {
  if (frames_.first >= frames_.end || frames_.end > scene.frame_count)
    throw std::runtime_error(scene.name + ": no frames " + std::to_string(frames_.first) + ":" +
                             std::to_string(frames_.end) + " among " + std::to_string(scene.frame_count));
  engine_ = make_engine({.isa = options.isa, .thread_count = options.thread_count});
  for (const scenes::Character& character : scene.characters) {
    check_arrays(scene, character);
    articulations_.push_back(add_character(*engine_, character));
  }

  const std::uint32_t block = block_frames(scene, frames_.count());
  full_ = add_batches(block);
  if (frames_.count() % block > 0) last_ = add_batches(frames_.count() % block);
}

EngineSession::BatchSet EngineSession::add_batches(std::uint32_t frame_count) {
  BatchSet set;
  set.frame_count = frame_count;
  for (std::size_t c = 0; c < scene_.characters.size(); ++c) {
    BatchDesc desc;
    desc.articulation = articulations_[c];
    desc.instance_count = scene_.characters[c].is_static ? 1 : frame_count;
    desc.kind = BatchKind::kSequence;
    BatchId id;
    require(add_batch(*engine_, desc, &id), scene_.characters[c].name);
    set.batches.push_back(id);
  }
  set.rules = rules_of(scene_, set.batches, within_);
  return set;
}

std::uint32_t EngineSession::block_count() const {
  return (frames_.count() + full_.frame_count - 1) / full_.frame_count;
}

void EngineSession::run_block(std::uint32_t block, const Policies& policies, bool contacts, BlockResult& result,
                              RunFrame frame) {
  const std::uint32_t first = frames_.first + block * full_.frame_count;
  const std::uint32_t count = std::min(full_.frame_count, frames_.end - first);
  const BatchSet& set = count == full_.frame_count ? full_ : last_;
  result.frames = {first, first + count};

  std::vector<BatchInput> inputs;
  for (std::uint32_t c = 0; c < set.batches.size(); ++c)
    inputs.push_back(input_of(scene_.characters[c], set.batches[c], result.frames));

  FrameJob job;
  job.inputs = inputs;
  job.rules = set.rules;
  job.policies = policies;
  job.min_depth = min_depth_;
  job.containment = containment_;
  hits_.resize(std::max(hits_.size(), kHitsPerFrame * count));
  require(run_with_room(job, hits_, contacts ? &contacts_ : nullptr, [&] { return frame(*engine_, job); }),
          "frames " + std::to_string(first) + ":" + std::to_string(first + count));

  const auto character_of = [&set](BatchSlot slot) {
    const auto same = [slot](BatchId batch) { return slot_of(batch).value == slot.value; };
    return static_cast<std::uint32_t>(std::find_if(set.batches.begin(), set.batches.end(), same) - set.batches.begin());
  };
  result.stats = job.stats;
  result.touches.clear();
  for (std::size_t h = 0; h < job.hit_count; ++h) {
    const Hit& hit = hits_[h];
    Touch touch = {};
    touch.character_a = character_of(hit.batch_a);
    touch.character_b = character_of(hit.batch_b);
    touch.link_a = hit.link_a;
    touch.link_b = hit.link_b;
    touch.frame = first + (scene_.characters[touch.character_a].is_static ? hit.instance_b : hit.instance_a);
    if (contacts) touch.contact = contacts_[h];
    result.touches.push_back(touch);
  }
  // The engine sorts by batch, then by instance. Touches are sorted by frame first.
  std::sort(result.touches.begin(), result.touches.end(), [](const Touch& l, const Touch& r) {
    return std::tie(l.frame, l.character_a, l.character_b, l.link_a, l.link_b) <
           std::tie(r.frame, r.character_a, r.character_b, r.link_a, r.link_b);
  });
}

FrameStats EngineSession::run(const Policies& policies, bool contacts,
                              const std::function<void(const BlockResult&)>& on_block, RunFrame frame) {
  FrameStats sum;
  BlockResult result;
  for (std::uint32_t block = 0; block < block_count(); ++block) {
    run_block(block, policies, contacts, result, frame);
    add_stats(sum, result.stats);
    on_block(result);
  }
  return sum;
}

std::optional<MaskedPose> EngineSession::first_masked() const {
  for (std::uint32_t block = 0; block < block_count(); ++block) {
    const std::uint32_t first = frames_.first + block * full_.frame_count;
    const FrameRange frames = {first, std::min(first + full_.frame_count, frames_.end)};
    const BatchSet& set = frames.count() == full_.frame_count ? full_ : last_;
    for (std::uint32_t i = 0; i < frames.count(); ++i)
      for (std::uint32_t c = 0; c < set.batches.size(); ++c) {
        MaskReason reason;
        const std::uint32_t instance = scene_.characters[c].is_static ? 0 : i;
        require(why_masked(*engine_, input_of(scene_.characters[c], set.batches[c], frames), instance, &reason),
                scene_.characters[c].name);
        if (reason.cause != MaskCause::kNone) return MaskedPose{c, first + i, reason};
      }
  }
  return std::nullopt;
}

std::vector<IgnoredPair> EngineSession::ignored_pairs(std::uint32_t character) const {
  const std::string& name = scene_.characters[character].name;
  ArticulationInfo info;
  require(articulation_info(*engine_, articulations_[character], &info), name);
  std::vector<IgnoredPair> pairs(info.ignored_pair_count);
  require(cab::ignored_pairs(*engine_, articulations_[character], pairs), name);
  return pairs;
}

CharacterBoxes EngineSession::boxes(std::uint32_t character, const Policies& policies) {
  const std::string& name = scene_.characters[character].name;
  CharacterBoxes result;
  require(articulation_info(*engine_, articulations_[character], &result.info), name);
  result.steps.resize(result.info.leaf_count - 1);
  require(merge_steps(*engine_, articulations_[character], result.steps), name);

  const std::size_t instances = scene_.characters[character].is_static ? 1 : full_.frame_count;
  std::vector<Box> all(instances * result.info.node_count);
  std::vector<std::uint8_t> flags(instances);
  BatchInput posed = input_of(scene_.characters[character], full_.batches[character],
                              {frames_.first, frames_.first + full_.frame_count});
  posed.flags = flags;
  require(compute_boxes(*engine_, posed, policies, all), name);
  result.boxes.assign(all.begin(), all.begin() + result.info.node_count);
  result.flags = flags.front();
  return result;
}

void EngineSession::visit_boxes(const Policies& policies, const VisitBoxes& visit) {
  const std::size_t characters = scene_.characters.size();
  std::vector<ArticulationInfo> infos(characters);
  std::vector<std::vector<Box>> boxes(characters);
  for (std::uint32_t block = 0; block < block_count(); ++block) {
    const std::uint32_t first = frames_.first + block * full_.frame_count;
    const std::uint32_t count = std::min(full_.frame_count, frames_.end - first);
    const BatchSet& set = count == full_.frame_count ? full_ : last_;
    for (std::uint32_t c = 0; c < characters; ++c) {
      const std::string& name = scene_.characters[c].name;
      require(articulation_info(*engine_, articulations_[c], &infos[c]), name);
      boxes[c].resize((scene_.characters[c].is_static ? 1 : count) * std::size_t{infos[c].node_count});
      const BatchInput posed = input_of(scene_.characters[c], set.batches[c], {first, first + count});
      require(compute_boxes(*engine_, posed, policies, boxes[c]), name);
    }
    for (std::uint32_t frame = 0; frame < count; ++frame)
      for (std::uint32_t c = 0; c < characters; ++c) {
        const std::size_t instance = scene_.characters[c].is_static ? 0 : frame;
        visit(infos[c], {boxes[c].data() + instance * infos[c].node_count, infos[c].node_count});
      }
  }
}

}  // namespace cab::perf
