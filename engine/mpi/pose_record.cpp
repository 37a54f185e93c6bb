#include "engine/mpi/pose_record.h"

#include "engine/mpi/part_of.h"
#include "engine/mpi/regions.h"

#include <cstddef>

namespace cab::mpi {
namespace {

template <class T>
void add_values(std::vector<T>& out, Span<const T> values, std::size_t i, std::size_t count) {
  if (!values.empty()) out.insert(out.end(), values.data + i * count, values.data + (i + 1) * count);
}

template <class T>
void read_values(std::vector<T>& out, Reader& record, bool given, std::size_t count) {
  if (!given) return;
  const std::size_t at = out.size();
  out.resize(at + count);
  record.read(out.data() + at, count);
}

template <class T>
void append_values(Bytes& bytes, Span<const T> values, std::size_t i, std::size_t count) {
  if (!values.empty()) append(bytes, values.data + i * count, count);
}

}  // namespace

void GatheredInput::add(const BatchInput& from, std::size_t i, std::uint32_t link_count) {
  const std::size_t floats = floats_of(from.poses.format);
  for (std::uint32_t link = 0; link < link_count; ++link) {
    const float* const pose = pose_at(from.poses, link_count, i, link);
    poses.insert(poses.end(), pose, pose + floats);
  }
  add_values(origins, from.origins, i, 3);
  add_values(orientations, from.orientations, i, 4);
  add_values(scales, from.scales, i, 1);
  add_values(margins, from.margins, i, 1);
  add_values(layers, from.layers, i, 1);
  add_values(layer_masks, from.layer_masks, i, 1);
}

void GatheredInput::add(Reader& record, std::uint32_t members, std::uint32_t link_count, std::uint32_t layer,
                        std::uint32_t layer_mask) {
  read_values(origins, record, members & kHasOrigins, 3);
  read_values(orientations, record, members & kHasOrientations, 4);
  read_values(scales, record, members & kHasScales, 1);
  read_values(margins, record, members & kHasMargins, 1);
  read_values(poses, record, true, link_count * floats_of(format_of(members)));
  if (members & kHasLayers) layers.push_back(layer);
  if (members & kHasMasks) layer_masks.push_back(layer_mask);
}

BatchInput GatheredInput::input(BatchId batch, std::uint32_t members, std::uint32_t count) const {
  BatchInput out;
  out.batch = batch;
  out.poses.format = format_of(members);
  out.poses.data = poses.data();
  out.poses.has_scale = (members & kHasPoseScale) != 0;
  out.origins = origins;
  out.orientations = orientations;
  out.scales = scales;
  out.margins = margins;
  out.layers = layers;
  out.layer_masks = layer_masks;
  out.count = count;
  return out;
}

void append_record(Bytes& bytes, const BatchInput& from, std::size_t i, std::uint32_t link_count) {
  append_values(bytes, from.origins, i, 3);
  append_values(bytes, from.orientations, i, 4);
  append_values(bytes, from.scales, i, 1);
  append_values(bytes, from.margins, i, 1);
  for (std::uint32_t link = 0; link < link_count; ++link)
    append(bytes, pose_at(from.poses, link_count, i, link), floats_of(from.poses.format));
}

std::size_t record_bytes(std::uint32_t members, std::uint32_t link_count) {
  std::size_t bytes = link_count * floats_of(format_of(members)) * sizeof(float);
  if (members & kHasOrigins) bytes += 3 * sizeof(double);
  if (members & kHasOrientations) bytes += 4 * sizeof(float);
  if (members & kHasScales) bytes += sizeof(float);
  if (members & kHasMargins) bytes += sizeof(float);
  return bytes;
}

}  // namespace cab::mpi
