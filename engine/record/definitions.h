// Articulations and batches between the public API and the tables of a recording.
#pragma once

#include <cab/record.h>
#include <cab/replay.h>
#include <cab/types.h>

#include <recording_generated.h>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cab::record {

// To the tables. What the engine took is taken.
format::ArticulationT articulation_table(const ArticulationDesc& desc, const ArticulationNames& names);
format::ArticulationT lod_table(const LodDesc& desc, std::uint32_t of, std::uint32_t link_count,
                                const ArticulationNames& names);
format::BatchT batch_table(std::uint32_t slot, std::uint32_t articulation, std::uint32_t instance_count,
                           const BatchNames& names);
format::BatchT static_batch_table(std::uint32_t slot, const StaticDesc& desc, const BatchNames& names);

// The poses of the first `instances` instances without gaps. If `listed` is not empty, those of other instances are 0.
void gather_poses(const PoseView& poses, std::uint32_t link_count, std::size_t instances,
                  Span<const std::uint32_t> listed, std::vector<float>& values);

// An articulation or a batch that was read, with the arrays that its description points to. They stay where they are.
class ReadArticulation {
 public:
  // Empty if the table is sound, else what is wrong with it. `before`: the articulations with lower indices.
  std::string read(const format::Articulation& table, const std::vector<std::unique_ptr<ReadArticulation>>& before);
  const RecordedArticulation& view() const { return view_; }

 private:
  std::string read_leaf(std::size_t n);
  std::string read_level(const std::vector<std::unique_ptr<ReadArticulation>>& before);

  format::ArticulationT table_;
  std::vector<std::int32_t> parents_;
  std::vector<Leaf> leaves_;
  std::vector<std::vector<ConvexPart>> parts_;
  std::vector<LinkPair> ignored_;
  std::vector<LodLeaf> lod_leaves_;
  std::vector<const char*> names_;
  RecordedArticulation view_;
};

class ReadBatch {
 public:
  std::string read(const format::Batch& table, const std::vector<std::unique_ptr<ReadArticulation>>& articulations);
  const RecordedBatch& view() const { return view_; }

 private:
  format::BatchT table_;
  std::vector<StaticBody> bodies_;
  std::vector<std::vector<ConvexPart>> parts_;
  std::vector<const char*> names_;
  RecordedBatch view_;
};

}  // namespace cab::record
