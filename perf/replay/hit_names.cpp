#include "perf/replay/hit_names.h"

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

std::string instance_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t instance) {
  const record::RecordedBatch entry = recording.batch(batch);
  std::string name = scenes::printable(entry.name);
  if (name.empty()) name = "batch " + std::to_string(batch);
  if (entry.instance_count == 1) return name;
  if (instance < entry.instance_names.size) return name + " " + scenes::printable(entry.instance_names[instance]);
  return name + " " + std::to_string(instance);
}

std::string link_name(const record::Recording& recording, std::uint32_t batch, std::uint32_t link) {
  const record::RecordedBatch entry = recording.batch(batch);
  if (entry.is_static) return "body";
  const record::RecordedArticulation articulation = recording.articulation(entry.articulation);
  if (link < articulation.link_names.size) return scenes::printable(articulation.link_names[link]);
  return "link " + std::to_string(link);
}

}  // namespace cab::perf
