// A scene in an engine: articulations and sequences for a range of the scene's frames. Frames run in blocks, so memory
// stays bounded however long the scene is.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "perf/base/engine_call.h"
#include "scenes/scene.h"

namespace cab::perf {

// Frames first .. end - 1.
struct FrameRange {
  std::uint32_t first = 0;
  std::uint32_t end = 0;
  std::uint32_t count() const { return end - first; }
};

struct SessionOptions {
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  FrameRange frames;               // within the scene
  bool within = false;             // also the links of one character against each other
  float min_depth = 0;             // FrameJob::min_depth
  bool containment = true;         // FrameJob::containment
};

// Two links that touch in one frame; (character_a, link_a) < (character_b, link_b), by their indices in the scene.
struct Touch {
  std::uint32_t frame;
  std::uint32_t character_a, link_a;
  std::uint32_t character_b, link_b;
  Contact contact;  // normal from a to b; zeros if contacts are not asked for
};

// The result of one block of frames. touches are sorted by frame, characters, links.
struct BlockResult {
  FrameRange frames;
  std::vector<Touch> touches;
  FrameStats stats;
};

// Every box of one character in one frame, relative to its origin in world axes, and how the boxes are merged.
struct CharacterBoxes {
  ArticulationInfo info;
  std::vector<MergeStep> steps;
  std::vector<Box> boxes;  // leaves first, the root last
  std::uint8_t flags = 0;  // InstanceFlag bits
};

// A pose that the engine masks, and why.
struct MaskedPose {
  std::uint32_t character, frame;
  MaskReason reason;
};

// Adds the articulation of a character. Throws std::runtime_error that names the character, the element at fault and
// the engine's reason.
ArticulationId add_character(Engine& engine, const scenes::Character& character);

// The rules of a scene whose characters have these batches: its pairs or, if it names none, each pair of characters
// that are not both static. within: also the links of each character that is not static against each other.
std::vector<PairRule> rules_of(const scenes::Scene& scene, const std::vector<BatchId>& batches, bool within);

// The poses and the origins of a character in some frames; of a static one the only ones.
BatchInput input_of(const scenes::Character& character, BatchId batch, FrameRange frames);

class EngineSession {
 public:
  // The session tests the scene's pairs or, if the scene names no pairs, each pair of characters that are not both
  // static. The scene must outlive the session. Throws std::runtime_error that names the character and the engine's
  // reason.
  EngineSession(const scenes::Scene& scene, const SessionOptions& options);

  Isa isa() const { return engine_isa(*engine_); }
  std::uint32_t thread_count() const { return engine_thread_count(*engine_); }
  std::uint32_t block_count() const;

  // Runs one block of frames by a function like run_frame. The memory of result.touches is reused. If the hit buffer is
  // too small, it grows and the block runs again; the stats are then those of the second run.
  void run_block(std::uint32_t block, const Policies& policies, bool contacts, BlockResult& result,
                 RunFrame frame = run_frame);

  // Runs all blocks in order, calls on_block for each and returns the sum of their stats.
  FrameStats run(const Policies& policies, bool contacts, const std::function<void(const BlockResult&)>& on_block,
                 RunFrame frame = run_frame);

  // The first pose that is masked, by frames within a block, or none.
  std::optional<MaskedPose> first_masked() const;

  // Which links of one character are never tested against each other, and why.
  std::vector<IgnoredPair> ignored_pairs(std::uint32_t character) const;

  // The boxes of one character in the session's first frame.
  CharacterBoxes boxes(std::uint32_t character, const Policies& policies);

  // Calls visit with the boxes of every character in every frame, by frame, then by character. Only the boxes of one
  // block are in memory.
  using VisitBoxes = std::function<void(const ArticulationInfo& info, Span<const Box> boxes)>;
  void visit_boxes(const Policies& policies, const VisitBoxes& visit);

 private:
  // One batch per character, in the scene's order, and the rules between them.
  struct BatchSet {
    std::uint32_t frame_count = 0;
    std::vector<BatchId> batches;
    std::vector<PairRule> rules;
  };

  BatchSet add_batches(std::uint32_t frame_count);

  const scenes::Scene& scene_;
  FrameRange frames_;
  bool within_;
  float min_depth_;
  bool containment_;
  oracle::EnginePtr engine_;
  std::vector<ArticulationId> articulations_;
  BatchSet full_;  // all blocks but a shorter last one
  BatchSet last_;  // the shorter last block; frame_count 0 if there is no such block
  std::vector<Hit> hits_;
  std::vector<Contact> contacts_;
};

}  // namespace cab::perf
