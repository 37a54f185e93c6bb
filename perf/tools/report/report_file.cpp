#include "perf/tools/report/report_file.h"

#include <cab/replay.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <system_error>
#include <unordered_map>

#include "perf/tools/replay/hit_names.h"
#include "perf/tools/report/surface_touches.h"

namespace cab::perf {
namespace {

RecordingNames names_of(const record::Recording& recording) {
  RecordingNames names;
  for (std::uint32_t a = 0; a < recording.articulation_count(); ++a) {
    const Span<const char* const> of_links = link_names(recording, a);
    names.link_names.emplace_back(of_links.begin(), of_links.end());
  }
  for (std::uint32_t b = 0; b < recording.batch_count(); ++b) {
    const record::RecordedBatch batch = recording.batch(b);
    names.batches.push_back({batch.name,
                             {batch.instance_names.begin(), batch.instance_names.end()},
                             batch.instance_count,
                             batch.slot,
                             batch.is_static,
                             batch.articulation});
  }
  return names;
}

// The input of a slot in a frame. A slot may be that of another batch once its own was removed.
using InputsOfSlots = std::unordered_map<std::uint32_t, const BatchInput*>;

std::uint32_t batch_index(const BatchInput& input) { return static_cast<std::uint32_t>(input.batch.value - 1); }

InputsOfSlots slots_of(const FrameJob& job, const RecordingNames& names) {
  InputsOfSlots inputs;
  for (const BatchInput& input : job.inputs) inputs[names.batches[batch_index(input)].slot] = &input;
  return inputs;
}

// A frame that was read has what its hits name.
LinkPlace place_of(const InputsOfSlots& slots, BatchSlot slot, std::uint32_t instance, std::uint16_t link) {
  return {batch_index(*slots.at(slot.value)), instance, link};
}

// What an instance's contacts are relative to. Of a triangle that is the origin of the mesh.
scenes::Vec3 origin_of(const record::Recording& recording, const BatchInput& input, std::uint32_t instance) {
  const auto copied = [](const double* origin) { return scenes::Vec3{origin[0], origin[1], origin[2]}; };
  const record::RecordedBatch batch = recording.batch(batch_index(input));
  if (batch.is_static) {
    const StaticDesc& desc = batch.static_desc;
    return copied(instance < desc.bodies.size ? desc.bodies[instance].origin : desc.origin);
  }
  return input.origins.empty() ? scenes::Vec3{0, 0, 0} : copied(input.origins.data + 3 * std::size_t{instance});
}

// The middle of a contact's two points.
WorldPoint point_of(const Contact& contact, const scenes::Vec3& origin, double metres_per_unit) {
  const auto middle = [&](std::size_t k) {
    const double points = static_cast<double>(contact.point_a[k]) + static_cast<double>(contact.point_b[k]);
    return metres_per_unit * (origin[k] + points / 2);
  };
  return {middle(0), middle(1), middle(2)};
}

// The depth of a contact, or NaN if there is none. Then its normal is zero, or the file holds what no test computes.
float depth_of(const Contact& contact) {
  const bool given = contact.normal[0] != 0 || contact.normal[1] != 0 || contact.normal[2] != 0;
  return given && std::isfinite(contact.depth) ? contact.depth : std::numeric_limits<float>::quiet_NaN();
}

// A length of time or space that a recording knows, or 0.
double known(double length) { return std::isfinite(length) && length > 0 ? length : 0; }

// touches: by hit, or none. metres: in one unit of the recording, or 1 if that is unknown.
std::vector<LinkHit> hits_of(const record::Recording& recording, const record::RecordedFrame& frame,
                             const RecordingNames& names, const std::vector<SurfaceTouch>& touches, double metres) {
  const InputsOfSlots slots = slots_of(frame.job, names);
  std::vector<LinkHit> hits;
  hits.reserve(frame.hits.size);
  for (std::size_t h = 0; h < frame.hits.size; ++h) {
    const Hit& hit = frame.hits[h];
    const LinkPlace a = place_of(slots, hit.batch_a, hit.instance_a, hit.link_a),
                    b = place_of(slots, hit.batch_b, hit.instance_b, hit.link_b);
    LinkHit& entry = hits.emplace_back(LinkHit{{a, b}, std::numeric_limits<float>::quiet_NaN()});
    if (h < frame.contacts.size) {
      const Contact& contact = frame.contacts[h];
      entry.depth = static_cast<float>(static_cast<double>(depth_of(contact)) * metres);
      if (!std::isnan(entry.depth))
        entry.point = point_of(contact, origin_of(recording, *slots.at(hit.batch_a.value), hit.instance_a), metres);
    }
    if (h < touches.size() && touches[h].triangles > 0) {
      const scenes::Vec3& place = touches[h].place;
      entry.triangles = touches[h].triangles;
      entry.point = {metres * place[0], metres * place[1], metres * place[2]};
    }
  }
  return hits;
}

// A message of a recording without the path that it begins with.
std::string without_path(const std::string& message, const std::string& path) {
  const std::string begin = path + ": ";
  return message.rfind(begin, 0) == 0 ? message.substr(begin.size()) : message;
}

// Frames that cannot be read, told one run after the other.
class UnreadFrames {
 public:
  explicit UnreadFrames(std::vector<std::string>& problems) : problems_(problems) {}
  void add(std::uint32_t frame, std::uint32_t count, const std::string& why) {
    if (count_ == 0) {
      first_ = frame;
      why_ = why;
    }
    count_ += count;
  }
  void end_run() {
    if (count_ == 1) problems_.push_back("frame " + std::to_string(first_) + " is left out: " + why_);
    if (count_ > 1)
      problems_.push_back("frames " + std::to_string(first_) + " to " + std::to_string(first_ + count_ - 1) +
                          " are left out: " + why_);
    count_ = 0;
  }

 private:
  std::vector<std::string>& problems_;
  std::uint32_t first_ = 0;
  std::uint32_t count_ = 0;
  std::string why_;
};

}  // namespace

ReportFile read_report_file(const std::string& path, std::uint32_t index,
                            const std::function<void(const Interval&)>& found,
                            const std::function<void(double)>& advance) {
  ReportFile file;
  file.path = path;
  record::Recording recording;
  if (!recording.open(path.c_str())) {
    file.problems.push_back(without_path(recording.error(), path));
    advance(1);
    return file;
  }
  file.is_open = true;
  std::error_code unknown;  // the size is for the page and the progress alone
  file.bytes = std::filesystem::file_size(path, unknown);
  if (unknown) file.bytes = 0;
  const record::RecordingInfo info = recording.info();
  file.title = info.title;
  file.frames = recording.frame_count();
  file.seconds_per_frame = known(info.seconds_per_frame);
  file.metres_per_unit = known(info.metres_per_unit);
  for (const char* const problem : recording.problems()) file.problems.emplace_back(problem);
  file.names = names_of(recording);

  const double metres = file.metres_per_unit > 0 ? file.metres_per_unit : 1;
  SurfaceTouches surfaces(recording);
  IntervalFinder finder(index, found);
  UnreadFrames unread(file.problems);
  for (std::uint32_t f = 0, next = 0; f < file.frames; f = next) {
    record::RecordedFrame frame;
    const bool is_read = recording.read_frame(f, &frame);
    next = recording.next_frame(f);
    if (is_read) {
      unread.end_run();
      ++file.frames_read;
      file.has_depths = file.has_depths || frame.contacts.size > 0;
      const std::vector<SurfaceTouch>& touches = surfaces.of(frame);
      file.has_triangles = file.has_triangles || !touches.empty();
      finder.add_frame({f, frame.time}, hits_of(recording, frame, file.names, touches, metres));
    } else {
      unread.add(f, next - f, without_path(recording.error(), path));
    }
    advance(static_cast<double>(next) / file.frames);
  }
  unread.end_run();
  if (!surfaces.error().empty())
    file.problems.push_back("triangles are not counted: " + without_path(surfaces.error(), "replay"));
  finder.finish();
  if (file.frames == 0) advance(1);
  return file;
}

}  // namespace cab::perf
