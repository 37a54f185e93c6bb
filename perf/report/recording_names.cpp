#include "perf/report/recording_names.h"

namespace cab::perf {

std::string RecordingNames::character(const LinkPlace& place) const {
  const BatchNames& batch = batches[place.batch];
  const std::string name = batch.name.empty() ? "batch " + std::to_string(place.batch) : batch.name;
  const bool is_named = place.instance < batch.instances.size() && !batch.instances[place.instance].empty();
  if (is_named) {
    const std::string& instance = batch.instances[place.instance];
    return batch.name.empty() || instance == batch.name ? instance : name + " " + instance;
  }
  return batch.instance_count > 1 ? name + " " + std::to_string(place.instance) : name;
}

std::string RecordingNames::link(const LinkPlace& place) const {
  const BatchNames& batch = batches[place.batch];
  if (batch.is_static) return "body";
  if (batch.articulation < link_names.size()) {
    const std::vector<std::string>& names = link_names[batch.articulation];
    if (place.link < names.size() && !names[place.link].empty()) return names[place.link];
  }
  return "link " + std::to_string(place.link);
}

}  // namespace cab::perf
