#include "scenes/import/trajectories.h"

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>

namespace cab::scenes {
namespace {

constexpr double kHeadingSeconds = .5;  // before and after a sample: the time that its heading covers
constexpr double kLeastWay = .1;        // metres: a shorter way in that time makes no heading
constexpr double kGreatestFrameRate = 1e4;
constexpr std::uint32_t kGreatestFrame = 100000000;

using Samples = std::map<std::uint32_t, std::array<double, 2>>;  // by frame

// Reads the next word, which must be one number.
template <class T>
bool take_number(std::string_view& text, T& value) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t begin = std::min(text.find_first_not_of(kBlank), text.size());
  const std::size_t end = std::min(text.find_first_of(kBlank, begin), text.size());
  const auto [rest, error] = std::from_chars(text.data() + begin, text.data() + end, value);
  const bool good = error == std::errc() && rest == text.data() + end && end > begin;
  text.remove_prefix(end);
  return good;
}

// Reads the rate from a comment such as `# framerate: 25 fps`. Other comments leave the rate unchanged.
void read_frame_rate(std::string_view comment, double& frames_per_second) {
  constexpr std::string_view kKey = "framerate:";
  const std::size_t place = comment.find(kKey);
  if (place == std::string_view::npos) return;
  comment.remove_prefix(place + kKey.size());
  if (!take_number(comment, frames_per_second)) frames_per_second = 0;
}

void check_file(const std::string& path, const std::string& name) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw ImportError(name + ": no such file");
  if (!std::filesystem::is_regular_file(path, error)) throw ImportError(name + ": is not a regular file");
  if (std::filesystem::file_size(path, error) > kMaxFileBytes)
    throw ImportError(name + ": the file is larger than " + std::to_string(kMaxFileBytes >> 20) + " MiB");
}

void find_headings(Track& track) {
  const double begin = track.seconds.front(), end = track.seconds.back();
  for (std::size_t s = 0; s < track.seconds.size(); ++s) {
    const Standing before = stand_on(track, std::max(begin, track.seconds[s] - kHeadingSeconds));
    const Standing after = stand_on(track, std::min(end, track.seconds[s] + kHeadingSeconds));
    const double x = after.x - before.x, y = after.y - before.y;
    if (std::hypot(x, y) >= kLeastWay)
      track.headings[s] = std::atan2(y, x);
    else if (s > 0)
      track.headings[s] = track.headings[s - 1];
  }
}

Track make_track(const Samples& samples, double frames_per_second) {
  Track track;
  for (const auto& [frame, place] : samples) {
    track.seconds.push_back(frame / frames_per_second);
    track.places.insert(track.places.end(), place.begin(), place.end());
  }
  track.headings.resize(track.seconds.size(), 0);
  find_headings(track);
  return track;
}

}  // namespace

Standing stand_on(const Track& track, double seconds) {
  const auto place = [&](std::size_t s) {
    return Standing{track.places[2 * s], track.places[2 * s + 1], track.headings[s]};
  };
  const auto after = std::upper_bound(track.seconds.begin(), track.seconds.end(), seconds);
  if (after == track.seconds.begin()) return place(0);
  if (after == track.seconds.end()) return place(track.seconds.size() - 1);
  const auto later = static_cast<std::size_t>(after - track.seconds.begin());
  const Standing a = place(later - 1), b = place(later);
  const double share = (seconds - track.seconds[later - 1]) / (track.seconds[later] - track.seconds[later - 1]);
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.heading};
}

Trajectories import_trajectories(const std::string& path) {
  const std::string name = printable(path);
  check_file(path, name);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ImportError(name + ": cannot be opened for reading");
  double frames_per_second = 0;
  std::map<std::int64_t, Samples> people;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const auto fail = [&](const std::string& reason) {
      throw ImportError(name + ":" + std::to_string(number) + ": " + reason);
    };
    std::string_view text = line;
    if (text.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    if (text.front() == '#') {
      read_frame_rate(text, frames_per_second);
      continue;
    }
    std::int64_t person = 0;
    std::uint32_t frame = 0;
    std::array<double, 2> place = {};
    if (!take_number(text, person) || !take_number(text, frame) || !take_number(text, place[0]) ||
        !take_number(text, place[1]))
      fail("a line must be a person's number, a frame from 0, x and y in metres");
    if (frame > kGreatestFrame) fail("frames go to " + std::to_string(kGreatestFrame));
    for (const double coordinate : place)
      if (!(std::fabs(coordinate) <= kMaxImportValue)) fail("x and y must be finite and at most 1e9 m");
    if (!people[person].emplace(frame, place).second)
      fail("person " + std::to_string(person) + " is twice in frame " + std::to_string(frame));
  }
  if (file.bad()) throw ImportError(name + ": cannot be read");
  if (!(frames_per_second > 0 && frames_per_second <= kGreatestFrameRate))
    throw ImportError(name + ": no comment `# framerate: N fps` with N above 0 and at most 10000");

  Trajectories trajectories;
  for (const auto& [person, samples] : people)
    if (samples.size() > 1) trajectories.tracks.push_back(make_track(samples, frames_per_second));
  if (trajectories.tracks.empty()) throw ImportError(name + ": nobody is in two frames");
  return trajectories;
}

}  // namespace cab::scenes
