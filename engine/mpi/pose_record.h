// What a rank needs to test another rank's character: one character's part of a batch's input, as bytes and in arrays.
#pragma once

#include "engine/mpi/mail.h"

#include <cab/types.h>

#include <cstdint>
#include <vector>

namespace cab::mpi {

// The input of a batch whose characters come from several places, without gaps. members: members_of.
struct GatheredInput {
  std::vector<float> poses;
  std::vector<double> origins;
  std::vector<float> orientations;
  std::vector<float> scales;
  std::vector<float> margins;
  std::vector<std::uint32_t> layers, layer_masks;

  // Adds character i of an input.
  void add(const BatchInput& from, std::size_t i, std::uint32_t link_count);
  // Adds the character that `append_record` wrote. Layers came before.
  void add(Reader& record, std::uint32_t members, std::uint32_t link_count, std::uint32_t layer,
           std::uint32_t layer_mask);
  BatchInput input(BatchId batch, std::uint32_t members, std::uint32_t count) const;
};

// Appends character i of an input, all but its layers.
void append_record(Bytes& bytes, const BatchInput& from, std::size_t i, std::uint32_t link_count);

// The length of what append_record appends.
std::size_t record_bytes(std::uint32_t members, std::uint32_t link_count);

}  // namespace cab::mpi
