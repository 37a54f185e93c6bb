#include "perf/measure/sweep/plot.h"

#include <cab/cab.h>

#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <tuple>

#include "perf/base/report.h"
#include "perf/measure/sweep/output.h"

namespace cab::perf {
namespace {

// Colours that colour-blind readers can distinguish (Okabe and Ito 2008), and three more.
constexpr std::array<const char*, 10> kColors = {"#0072B2", "#56B4E9", "#D55E00", "#E69F00", "#009E73",
                                                 "#CC79A7", "#000000", "#999999", "#8B4513", "#6A3D9A"};
constexpr std::array<int, 7> kShapes = {7, 5, 9, 13, 11, 15, 3};  // gnuplot's filled points
constexpr double kNear = .06;   // share of the picture: numbers of points nearer than this are written side by side
constexpr double kLogFrom = 8;  // an axis is logarithmic if its values differ by this factor or more

const char* color(std::size_t i) { return kColors[i % kColors.size()]; }
int shape(std::size_t i) { return kShapes[i % kShapes.size()]; }

std::uint32_t row_named(const char* name) {
  std::uint32_t row = 0;
  while (row + 1 < policy_table().size && std::string(policy_table()[row].name) != name) ++row;
  return row;
}

// A string for gnuplot. Line breaks stay line breaks.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text)
    out += c == '\n' ? "\\n" : c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

// One curve or cloud: rows of x, y, and where a bar begins and ends.
struct Series {
  std::string name;   // in the legend; empty: not in the legend
  std::string style;  // what gnuplot accepts after "with"
  std::vector<std::array<double, 4>> points;
};

struct Label {
  double x, y;
  std::string text;
};

struct Picture {
  std::string name;  // of the file
  std::string title, x_title, y_title;
  bool log_x = false, log_y = false;  // a logarithmic x has its ticks where the points are
  bool x_from_zero = false;           // a linear y always is
  std::vector<std::string> legend;    // "with ... title ..." of entries that are no series
  std::vector<Series> series;
  std::vector<Label> labels;
};

// Runs a program in a folder. Returns its exit code, or -1 if it could not be run.
int run_program(const std::vector<std::string>& words, const std::string& folder) {
  std::vector<char*> pointers;
  for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", 1, 0);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, words[0].c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return -1;
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

struct Range {
  double least = INFINITY, most = -INFINITY;
  void add(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

// The command for ticks at one, two and five times the powers of ten: "set ytics (1,2,5,10)".
std::string decades(Range range) {
  std::string out = "set ytics (";
  for (double power = std::pow(10, std::floor(std::log10(range.least))); power <= range.most; power *= 10)
    for (const double digit : {1.0, 2.0, 5.0})
      if (digit * power >= range.least && digit * power <= range.most)
        out += (out.back() == '(' ? "" : ",") + shortest(digit * power);
  return out + ")\n";
}

std::string set_axes(const Picture& picture) {
  Range x, y;
  std::string x_ticks;
  for (const Series& series : picture.series)
    for (const auto& point : series.points) {
      x.add(point[0]);
      y.add(point[2]);
      y.add(point[3]);
      x_ticks += (x_ticks.empty() ? "" : ",") + shortest(point[0]);
    }
  std::string out;
  if (picture.log_x) {
    out += "set logscale x\nset xtics (" + x_ticks + ")\n";
    x = {x.least / 1.2, x.most * 1.2};
  } else {
    const double width = picture.x_from_zero ? x.most : x.most - x.least;
    x = {picture.x_from_zero ? -.04 * width : x.least - .06 * width, x.most + .06 * width};
  }
  if (picture.log_y) {
    y = {y.least / 1.5, y.most * 1.5};
    out += "set logscale y\n" + decades(y);
  } else {
    y = {0, y.most * 1.1};
  }
  return out + "set xrange [" + shortest(x.least) + ":" + shortest(x.most) + "]\nset yrange [" + shortest(y.least) +
         ":" + shortest(y.most) + "]\n";
}

void draw(const std::string& folder, const Picture& picture) {
  OutputFile file((std::filesystem::path(folder) / (picture.name + ".gp")).string());
  std::ostream& out = file.stream();
  out << "# cab " CAB_VERSION_STRING
         " sweep; run gnuplot on this file in its folder\n"
         "set terminal svg size 1000,620 noenhanced font 'sans,14' background '#ffffff'\n"
         "set output "
      << quoted(picture.name + ".svg") << "\nset title " << quoted(picture.title) << "\nset xlabel "
      << quoted(picture.x_title) << "\nset ylabel " << quoted(picture.y_title)
      << "\nset key outside right top Left reverse samplen 2 spacing 1.15\nset grid lc rgb '#dddddd' lt 1\nset border "
         "3\n"
         "set tics nomirror\nset format '%g'\n"
      << set_axes(picture);
  for (std::size_t s = 0; s < picture.series.size(); ++s) {
    out << "$data" << s << " << END\n";
    for (const auto& point : picture.series[s].points) {
      for (const double value : point) out << shortest(value) << ' ';
      out << '\n';
    }
    out << "END\n";
  }
  for (const Label& label : picture.labels)
    out << "set label " << quoted(label.text) << " at " << shortest(label.x) << ',' << shortest(label.y)
        << " offset 1,-.6 font 'sans,13' front\n";
  out << "plot ";
  std::string between;
  for (std::size_t s = 0; s < picture.series.size(); ++s, between = ", \\\n  ")
    out << between << "$data" << s << " with " << picture.series[s].style
        << (picture.series[s].name.empty() ? " notitle" : " title " + quoted(picture.series[s].name));
  for (const std::string& entry : picture.legend) out << between << "keyentry " << entry;
  out << '\n';
  file.close();
  if (run_program({"gnuplot", picture.name + ".gp"}, folder) != 0)
    throw std::runtime_error("gnuplot failed on " + folder + "/" + picture.name + ".gp");
}

std::string points_style(std::size_t color_index, std::size_t shape_index) {
  return std::string("points pt ") + std::to_string(shape(shape_index)) + " ps .9 lc rgb '" + color(color_index) + "'";
}

// The cells of the first instruction set, thread count and exact test of a run.
std::vector<const SweepCell*> drawn_cells(const SweepRun& run) {
  const SweepCell& first = run.cells.front();
  std::vector<const SweepCell*> cells;
  for (const SweepCell& cell : run.cells)
    if (cell.isa == first.isa && cell.thread_count == first.thread_count && cell.policies.exact == first.policies.exact)
      cells.push_back(&cell);
  return cells;
}

double microseconds(const SweepRun& run, double seconds) { return 1e6 * seconds / run.frame_count; }

std::string conditions(const SweepRun& run) {
  const SweepCell& cell = run.cells.front();
  return std::string(to_string(cell.isa)) + ", threads " + std::to_string(cell.thread_count) + ", exact " +
         policy_table()[row_named("exact")].values[policy_get(cell.policies, row_named("exact"))].name;
}

// Cells as a cloud: colours for the values of one field, shapes for those of another, a line and names on the front.
class Cloud {
 public:
  Cloud(const SweepRun& run, std::uint32_t color_row, std::uint32_t shape_row)
      : run_(run), color_row_(color_row), shape_row_(shape_row) {}

  void add(const SweepCell& cell, double x) {
    const std::uint32_t hue = policy_get(cell.policies, color_row_), form = policy_get(cell.policies, shape_row_);
    const double y = microseconds(run_, cell.total_seconds());
    clouds_[{hue, form}].push_back({x, y, y, y});
    if (cell.misses > 0)
      missing_.push_back({x, y, y, y});
    else
      entries_.push_back({x, y, name_of(cell.policies)});
  }

  Picture picture() {
    Picture out;
    out.y_title = "time, microseconds per frame";
    Range across, up;
    for (const auto& [key, points] : clouds_)
      for (const auto& point : points) {
        across.add(point[0]);
        up.add(point[1]);
      }
    out.log_y = up.most > kLogFrom * up.least;
    // How far apart two points are, in parts of the picture.
    const auto distance = [&](const Label& l, const Label& r) {
      const double aside = across.most > across.least ? (l.x - r.x) / (across.most - across.least) : 0;
      const double above = out.log_y ? std::log(l.y / r.y) / std::log(up.most / up.least) : (l.y - r.y) / up.most;
      return std::hypot(aside, above);
    };
    std::vector<std::string> names;  // of those on the front, by number
    Series front = {"front: none is faster further left", "steps lw 2 dt 2 lc rgb '#444444'", {}};
    std::sort(entries_.begin(), entries_.end(),
              [](const Label& a, const Label& b) { return std::tie(a.x, a.y) < std::tie(b.x, b.y); });
    for (const Label& entry : entries_) {
      if (!front.points.empty() && entry.y >= front.points.back()[1]) continue;
      front.points.push_back({entry.x, entry.y, entry.y, entry.y});
      const std::string number = std::to_string(front.points.size());
      names.push_back(number + ": " + entry.text);
      if (!out.labels.empty() && distance(out.labels.back(), entry) < kNear) {
        out.labels.back().text += ", " + number;
      } else {
        out.labels.push_back({entry.x, entry.y, number});
      }
    }
    out.series.push_back(front);
    std::map<std::uint32_t, bool> hues, forms;
    for (const auto& [key, points] : clouds_) {
      out.series.push_back({"", points_style(key.first, key.second), points});
      hues[key.first] = forms[key.second] = true;
    }
    if (!missing_.empty()) out.series.push_back({"misses hits", "points pt 2 ps 2 lw 2 lc rgb 'red'", missing_});
    const auto entry = [&out](const std::string& style, std::uint32_t row, std::uint32_t value) {
      out.legend.push_back(
          "with " + style + " title " +
          quoted(std::string(policy_table()[row].name) + " " + policy_table()[row].values[value].name));
    };
    for (const std::string& name : names) out.legend.push_back("with dots lc rgb '#ffffff' title " + quoted(name));
    for (const auto& [hue, used] : hues)
      entry(std::string("boxes fs solid noborder lc rgb '") + color(hue) + "'", color_row_, hue);
    for (const auto& [form, used] : forms)
      entry("points pt " + std::to_string(shape(form)) + " ps .9 lc rgb '#444444'", shape_row_, form);
    return out;
  }

 private:
  // The values by which a cell differs from others in this picture: "cab_sum leaves".
  std::string name_of(const Policies& policies) const {
    std::string name;
    for (std::uint32_t row = 0; row < policy_table().size; ++row) {
      const bool shown = row == color_row_ || row == shape_row_;
      if (row == row_named("exact") || (row == row_named("strategy") && !shown)) continue;
      if (shown || policy_get(policies, row) != policy_get(Policies(), row))
        name += (name.empty() ? "" : " ") + std::string(policy_table()[row].values[policy_get(policies, row)].name);
    }
    return name;
  }

  const SweepRun& run_;
  std::uint32_t color_row_, shape_row_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::array<double, 4>>> clouds_;
  std::vector<std::array<double, 4>> missing_;
  std::vector<Label> entries_;
};

Picture false_positives_picture(const SweepRun& run) {
  Cloud cloud(run, row_named("refit"), row_named("strategy"));
  for (const SweepCell* cell : drawn_cells(run))
    if (!cell->same_work_as) cloud.add(*cell, static_cast<double>(cell->false_positives) / run.frame_count);
  Picture picture = cloud.picture();
  picture.name = "false-positives-" + run.scene;
  picture.title = run.scene + ": time against false positives; better is down and left\n(" + conditions(run) + ")";
  picture.x_title = "false positives per frame: leaf pairs whose boxes overlap and whose shapes do not";
  picture.x_from_zero = true;
  return picture;
}

Picture growth_picture(const SweepRun& run) {
  Cloud cloud(run, row_named("refit"), row_named("extents"));
  const double unit = run.least_area > 0 ? run.least_area : run.covariance_area;
  for (const SweepCell* cell : drawn_cells(run))
    if (cell->area > 0 && !cell->same_work_as) cloud.add(*cell, cell->area / unit);
  Picture picture = cloud.picture();
  picture.name = "growth-" + run.scene;
  picture.title = run.scene + ": time against size of inner boxes, strategy tree; better is down and left\n(" +
                  conditions(run) + ")";
  picture.x_title = run.least_area > 0
                        ? "surface of the inner boxes, times that of the smallest oriented boxes about the same leaves"
                        : "surface of the inner boxes, times that of refit covariance with extents of children";
  return picture;
}

// Whether the points of a picture differ along x. Otherwise the picture shows nothing.
bool is_spread(const Picture& picture) {
  Range x;
  for (const Series& series : picture.series)
    for (const auto& point : series.points) x.add(point[0]);
  return x.least < x.most;
}

// Runs of the scenes of a family by their number.
std::map<std::uint32_t, const SweepRun*> runs_of(const std::string& family, const std::vector<SweepRun>& runs) {
  std::map<std::uint32_t, const SweepRun*> found;
  for (const SweepMember& member : sweep_family(family))
    for (const SweepRun& run : runs)
      if (run.scene == member.name) found[member.number] = &run;
  return found;
}

// The median per character and frame, and the quartiles of the rounds.
std::array<double, 4> timed_point(const SweepRun& run, const SweepCell& cell, double x) {
  std::vector<double> totals;
  for (const FrameStats& round : cell.rounds)
    totals.push_back(microseconds(run, round.seconds_total) / run.character_count);
  std::sort(totals.begin(), totals.end());
  const std::size_t count = totals.size();
  return {x, totals[count / 2], totals[count / 4], totals[count - 1 - count / 4]};
}

// The strategies, with defaults in all other fields, by the number of a family.
Picture crossover_picture(const std::string& family, const std::map<std::uint32_t, const SweepRun*>& runs,
                          const std::string& what) {
  Picture picture;
  picture.name = "crossover-" + family;
  picture.title = what + ": time by strategy; lower is better\n(" + conditions(*runs.begin()->second) +
                  ", other policies as by default; bars: the middle half of the rounds)";
  picture.x_title = "boxes per character";
  picture.y_title = "time, microseconds per character and frame";
  picture.log_x = picture.log_y = true;
  const std::uint32_t row = row_named("strategy");
  for (std::uint32_t value = 0; value < policy_table()[row].value_count; ++value) {
    Series series = {std::string("strategy ") + policy_table()[row].values[value].name, "", {}};
    series.style =
        std::string("yerrorlines lw 2 pt ") + std::to_string(shape(value)) + " ps .8 lc rgb '" + color(value) + "'";
    if (static_cast<Strategy>(value) == Strategy::kAuto) series.style += " dt 2";
    for (const auto& [number, run] : runs)
      for (const SweepCell* cell : drawn_cells(*run)) {
        if (cell->same_work_as && cell->policies.strategy != Strategy::kAuto) continue;
        Policies policies;
        policies.exact = cell->policies.exact;
        policies.strategy = static_cast<Strategy>(value);
        if (code_line(policies) == code_line(cell->policies)) series.points.push_back(timed_point(*run, *cell, number));
      }
    if (!series.points.empty()) picture.series.push_back(series);
  }
  return picture;
}

// The defaults by the number of characters, one line per instruction set and thread count.
Picture scaling_picture(const std::map<std::uint32_t, const SweepRun*>& runs) {
  Picture picture;
  picture.name = "scaling-uniform";
  picture.title =
      "humanoids of 16 boxes, 1 per square metre, default policies: time by size of the crowd; lower is better\n(bars: "
      "the middle half of the rounds)";
  picture.x_title = "characters";
  picture.y_title = "time, microseconds per character and frame";
  picture.log_x = true;
  std::map<std::pair<Isa, std::uint32_t>, Series> lines;
  for (const auto& [number, run] : runs)
    for (const SweepCell& cell : run->cells) {
      if (code_line(cell.policies) != code_line(Policies())) continue;
      Series& line = lines[{cell.isa, cell.thread_count}];
      line.name = std::string(to_string(cell.isa)) + ", threads " + std::to_string(cell.thread_count);
      line.points.push_back(timed_point(*run, cell, number));
    }
  for (auto& [key, line] : lines) {
    const std::size_t i = picture.series.size();
    line.style = std::string("yerrorlines lw 2 pt ") + std::to_string(shape(i)) + " ps .8 lc rgb '" + color(i) + "'";
    picture.series.push_back(line);
  }
  return picture;
}

}  // namespace

void prepare_plots(const std::string& folder) {
  if (run_program({"gnuplot", "--version"}, ".") != 0)
    throw std::runtime_error("--plot: gnuplot does not run here; install the package gnuplot-nox");
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error("--plot: cannot make the folder " + folder + ": " + error.message());
}

std::vector<std::string> plot_sweep(const std::string& folder, const std::vector<SweepRun>& runs) {
  std::vector<Picture> pictures;
  for (const SweepRun& run : runs)
    for (Picture& picture : std::array{false_positives_picture(run), growth_picture(run)})
      if (is_spread(picture)) pictures.push_back(std::move(picture));
  constexpr std::size_t kLeastNumbers = 3;
  const auto detailed = runs_of("detailed", runs), ropes = runs_of("ropes", runs), uniform = runs_of("uniform", runs);
  if (detailed.size() >= kLeastNumbers)
    pictures.push_back(crossover_picture("detailed", detailed, "humanoids of 16 links, 1 per square metre"));
  if (ropes.size() >= kLeastNumbers)
    pictures.push_back(crossover_picture("ropes", ropes, "straight ropes that hardly touch"));
  if (uniform.size() >= kLeastNumbers) pictures.push_back(scaling_picture(uniform));
  std::vector<std::string> names;
  for (const Picture& picture : pictures) {
    draw(folder, picture);
    names.push_back(picture.name + ".svg");
  }
  return names;
}

}  // namespace cab::perf
