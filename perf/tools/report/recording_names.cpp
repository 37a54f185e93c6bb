#include "perf/tools/report/recording_names.h"

#include "perf/tools/replay/hit_names.h"

namespace cab::perf {
namespace {

std::string name_at(const std::vector<std::string>& names, std::size_t index) {
  return index < names.size() ? names[index] : std::string();
}

}  // namespace

std::string RecordingNames::character(const LinkPlace& place) const {
  const BatchNames& batch = batches[place.batch];
  return instance_name(batch.name, place.batch, batch.instance_count, name_at(batch.instances, place.instance),
                       place.instance);
}

std::string RecordingNames::link(const LinkPlace& place) const {
  const BatchNames& batch = batches[place.batch];
  const bool has_names = batch.articulation < link_names.size();
  return link_name(batch.is_static, has_names ? name_at(link_names[batch.articulation], place.link) : std::string(),
                   place.link);
}

}  // namespace cab::perf
