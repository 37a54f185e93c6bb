#include "scenes/import/trajectories.h"

#include "scenes/import/import.h"
#include "scenes/import/import_payload.h"
#include "scenes/import/in_child.h"
#include "scenes/import/input_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
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

// Where the numbers of a line are that are read.
struct Columns {
  std::size_t person = 0, frame = 1, x = 2, y = 3;
  double metres = 1;  // per unit of x and y
};

// Of lines with eight numbers and no header: frame, person, x, height, y, and three velocities.
constexpr std::size_t kObsmatColumns = 8;
constexpr Columns kObsmat = {1, 0, 2, 4, 1};

// The name of a column in lower case, without the signs that files put around it.
std::string column_name(std::string_view word) {
  constexpr std::string_view kAround = "#[]\"'";
  const std::size_t begin = std::min(word.find_first_not_of(kAround), word.size());
  return lower_case(word.substr(begin, word.find_last_not_of(kAround) + 1 - begin));
}

struct ColumnNames {
  std::size_t Columns::*column;
  const char* wanted;
  std::array<std::string_view, 8> names;
};
constexpr ColumnNames kColumnNames[] = {
    {&Columns::person,
     "id",
     {"id", "person", "person_id", "ped_id", "pedestrian", "pedestrian_id", "agent_id", "track_id"}},
    {&Columns::frame,
     "frame",
     {"frame", "fr", "frame_number", "frame_id", "frames", "frame_no", "frame_nr", "frameid"}},
    {&Columns::x, "x", {"x", "x/m", "x/cm", "pos_x", "x_m", "x_cm", "x_pos", "posx"}},
    {&Columns::y, "y", {"y", "y/m", "y/cm", "pos_y", "y_m", "y_cm", "y_pos", "posy"}},
};

// Finds the columns by their names. Returns the name of the first one that is missing, or nothing if all are there.
const char* find_columns(const std::vector<std::string_view>& words, Columns& columns) {
  std::size_t in_centimetres = 0;
  for (const ColumnNames& wanted : kColumnNames) {
    std::size_t found = 0;
    for (; found < words.size(); ++found) {
      const std::string name = column_name(words[found]);
      if (std::find(wanted.names.begin(), wanted.names.end(), name) == wanted.names.end()) continue;
      in_centimetres += name.find("cm") == std::string::npos ? 0 : 1;
      break;
    }
    if (found == words.size()) return wanted.wanted;
    columns.*wanted.column = found;
  }
  columns.metres = in_centimetres == 2 ? .01 : 1;
  return nullptr;
}

// Reads the rate from a comment such as `# framerate: 25 fps`. Other comments leave the rate unchanged.
void read_frame_rate(std::string_view comment, double& frames_per_second) {
  const std::string text = lower_case(comment);
  for (const std::string_view key : {"framerate", "frame rate", "fps"}) {
    const std::size_t place = text.find(key);
    if (place == std::string::npos) continue;
    const std::size_t begin = std::min(text.find_first_not_of(" \t:=", place + key.size()), text.size());
    const std::size_t end = std::min(text.find_first_of(" \t\r,;", begin), text.size());
    if (read_number(std::string_view(text).substr(begin, end - begin), frames_per_second)) return;
  }
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

namespace {

// Reads a file line by line.
class Reader {
 public:
  Reader(const std::string& name, double frames_per_second) : name_(name), asked_rate_(frames_per_second) {}

  void read_line(std::string_view text) {
    if (++line_ == 1 && text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
    const std::size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return;
    if (text[begin] == '#')
      read_comment(text.substr(begin + 1));
    else
      read_row(text);
  }

  Trajectories finish() const {
    if (rate_ != 0 && asked_rate_ != 0 && rate_ != asked_rate_)
      throw ImportError(name_ + ": the file has a frame rate of its own; leave out --fps");
    const double rate = rate_ != 0 ? rate_ : asked_rate_;
    if (!(rate > 0 && rate <= kGreatestFrameRate))
      throw ImportError(name_ +
                        ": no frame rate: give --fps, or a comment `# framerate: N fps`, with N above 0 and at "
                        "most 10000");
    Trajectories trajectories;
    if (!has_header_)
      trajectories.notes.push_back(is_obsmat_ ? "no header: eight columns are read as frame id x z y and velocities"
                                              : "no header: columns are read as id frame x y");
    for (const auto& [person, samples] : people_)
      if (samples.size() > 1) trajectories.tracks.push_back(make_track(samples, rate));
    if (trajectories.tracks.empty()) throw ImportError(name_ + ": nobody is in two frames");
    return trajectories;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw ImportError(name_ + ":" + std::to_string(line_) + ": " + reason);
  }

  void read_comment(std::string_view text) {
    read_frame_rate(text, rate_);
    if (!people_.empty()) return;
    const std::size_t colon = text.find_last_of(':');  // as in `# columns: id frame x y`
    split_line(colon == std::string_view::npos ? text : text.substr(colon + 1), words_);
    Columns columns;
    if (find_columns(words_, columns) != nullptr) return;
    columns_ = columns;
    has_header_ = true;
  }

  // Reads a line of numbers, or the names of columns in the first line that is no comment.
  void read_row(std::string_view text) {
    split_line(text, words_);
    double number = 0;
    if (people_.empty() && !has_header_ && !read_number(words_[0], number)) {
      if (const char* const missing = find_columns(words_, columns_))
        fail(std::string("the header has no column ") + missing + "; id, frame, x and y are needed");
      has_header_ = true;
      return;
    }
    if (people_.empty() && !has_header_ && words_.size() == kObsmatColumns) {
      columns_ = kObsmat;
      is_obsmat_ = true;
    }
    const std::int64_t person = read_whole(columns_.person, "id");
    const std::int64_t frame = read_whole(columns_.frame, "frame");
    if (frame < 0) fail("frames are counted from 0");
    if (frame > kGreatestFrame) fail("frames go to " + std::to_string(kGreatestFrame));
    const std::array<double, 2> place = {columns_.metres * read(columns_.x, "x"),
                                         columns_.metres * read(columns_.y, "y")};
    for (const double coordinate : place)
      if (!(std::fabs(coordinate) <= kMaxImportValue)) fail("x and y must be finite and at most 1e9 m");
    if (!people_[person].emplace(static_cast<std::uint32_t>(frame), place).second)
      fail("person " + std::to_string(person) + " is twice in frame " + std::to_string(frame));
  }

  double read(std::size_t column, const char* what) const {
    double value = 0;
    if (column >= words_.size())
      fail("column " + std::to_string(column + 1) + " (" + what + ") is missing: the line has " +
           std::to_string(words_.size()));
    if (!read_number(words_[column], value))
      fail("column " + std::to_string(column + 1) + " (" + what + "): '" + printable(words_[column]) +
           "' is not a number");
    return value;
  }

  std::int64_t read_whole(std::size_t column, const char* what) const {
    constexpr double kGreatestWhole = 9007199254740992;  // 2^53: above it a double does not hold every whole number
    const double value = read(column, what);
    if (!(std::fabs(value) <= kGreatestWhole) || value != std::floor(value))
      fail("column " + std::to_string(column + 1) + " (" + what + "): '" + printable(words_[column]) +
           "' is not a whole number");
    return static_cast<std::int64_t>(value);
  }

  const std::string& name_;
  double asked_rate_, rate_ = 0;
  std::size_t line_ = 0;
  Columns columns_;
  bool has_header_ = false, is_obsmat_ = false;
  std::vector<std::string_view> words_;
  std::map<std::int64_t, Samples> people_;
};

Trajectories read_here(const std::string& path, double frames_per_second) {
  const std::string name = printable(path);
  check_file(path, name);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ImportError(name + ": cannot be opened for reading");
  Reader reader(name, frames_per_second);
  for (std::string line; std::getline(file, line);) reader.read_line(line);
  if (file.bad()) throw ImportError(name + ": cannot be read");
  return reader.finish();
}

}  // namespace

Trajectories import_trajectories(const std::string& path, double frames_per_second,
                                 const std::optional<SandboxLimits>& sandbox) {
  const auto read = [&] { return read_here(path, frames_per_second); };
  if (!sandbox) return in_this_process(read);
  return from_child(
      path, *sandbox, [&] { return trajectories_payload(read()); }, read_trajectories_payload);
}

}  // namespace cab::scenes
