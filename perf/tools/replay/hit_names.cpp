#include "perf/tools/replay/hit_names.h"

#include <stdexcept>

#include "scenes/import/printable.h"

namespace cab::perf {

std::uint32_t batch_of(const record::Recording& recording, const record::RecordedFrame& frame, BatchSlot slot) {
  for (const BatchInput& input : frame.job.inputs) {
    const auto index = static_cast<std::uint32_t>(input.batch.value - 1);
    if (recording.batch(index).slot == slot.value) return index;
  }
  throw std::runtime_error("a hit is of slot " + std::to_string(slot.value) + ", which its frame does not have");
}

std::string instance_name(std::string_view batch_name, std::uint32_t batch, std::uint32_t instance_count,
                          std::string_view own_name, std::uint32_t instance) {
  std::string name = batch_name.empty() ? "batch " + std::to_string(batch) : scenes::printable(batch_name);
  if (instance_count == 1) return name;
  return name + " " + (own_name.empty() ? std::to_string(instance) : scenes::printable(own_name));
}

std::string instance_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t instance) {
  const record::RecordedBatch entry = recording.batch(batch);
  const Span<const char* const> names = entry.instance_names;
  return instance_name(entry.name, batch, entry.instance_count, instance < names.size ? names[instance] : "", instance);
}

std::string link_name(bool is_static, std::string_view own_name, std::uint32_t link) {
  if (is_static) return "body";
  return own_name.empty() ? "link " + std::to_string(link) : scenes::printable(own_name);
}

std::string link_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t link) {
  const record::RecordedBatch entry = recording.batch(batch);
  if (entry.is_static) return link_name(true, "", link);
  const Span<const char* const> names = link_names(recording, entry.articulation);
  return link_name(false, link < names.size ? names[link] : "", link);
}

Span<const char* const> link_names(const record::Recording& recording, std::uint32_t articulation) {
  const record::RecordedArticulation entry = recording.articulation(articulation);
  if (!entry.is_lod || !entry.link_names.empty()) return entry.link_names;
  return recording.articulation(static_cast<std::uint32_t>(entry.lod.of.value - 1)).link_names;
}

}  // namespace cab::perf
