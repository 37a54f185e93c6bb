// `cab report`: which links touch when and how deep, over many recordings, as a page and as CSV.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numeric>
#include <string>
#include <system_error>

#include "perf/base/output_file.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/report/options.h"
#include "perf/tools/report/report_output.h"
#include "perf/tools/report/sorted_records.h"
#include "perf/view/page.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

// Records of each sort that are in memory at once: some 25 MB.
constexpr std::size_t kMostInMemory = 1 << 18;

// Rows of each table of the page. More are slow to open, and nobody reads them.
constexpr std::size_t kMostRowsOfPage = 20000;

// Bytes of all recordings in the page together. Base64 makes them a third larger.
constexpr std::uint64_t kMostEmbeddedBytes = std::uint64_t{64} << 20;

template <class Record>
using WorstFirst = SortedRecords<Record, bool (*)(const Record&, const Record&)>;

// All that a report says, not yet in order.
struct Findings {
  std::vector<ReportFile> files;
  WorstFirst<Interval> intervals{kMostInMemory, is_worse};
  WorstFirst<PairTotals> pairs{kMostInMemory, is_worse};
};

bool by_links(const Interval& one, const Interval& other) {
  return one.links != other.links ? one.links < other.links : one.first.frame < other.first.frame;
}

bool passes(const ReportOptions& options, const Interval& interval) {
  if (interval.frames() < options.min_frames) return false;
  return !options.min_depth || static_cast<double>(interval.worst_depth) >= *options.min_depth;
}

std::uint64_t bytes_of(const std::string& path) {
  std::error_code unknown;  // what cannot be read is told when it is opened
  const std::uint64_t bytes = std::filesystem::file_size(path, unknown);
  return unknown ? 0 : bytes;
}

void read_file(const ReportOptions& options, std::uint32_t index, Findings& findings, ProgressBar& bar) {
  const std::string& path = options.files[index];
  WorstFirst<Interval> of_file(kMostInMemory, by_links);
  const std::uint64_t bytes = bytes_of(path);
  std::uint64_t told = 0, count = 0;
  std::optional<Interval> worst;
  ReportFile file = read_report_file(
      path, index,
      [&](const Interval& interval) {
        if (!passes(options, interval)) return;
        findings.intervals.add(interval);
        of_file.add(interval);
        if (!worst || is_worse(interval, *worst)) worst = interval;
      },
      [&](double share) {
        const auto read = static_cast<std::uint64_t>(share * static_cast<double>(bytes));
        bar.advance(read - told);
        told = read;
      });
  file.interval_count = of_file.count();
  file.worst = worst;
  PairCounter counter([&](const PairTotals& pair) {
    findings.pairs.add(pair);
    ++count;
  });
  of_file.take_all([&](const Interval& interval) { counter.add(interval); });
  counter.finish();
  file.pair_count = count;
  findings.files.push_back(std::move(file));
}

void read_files(const ReportOptions& options, Findings& findings) {
  std::uint64_t bytes = 0;
  for (const std::string& path : options.files) bytes += bytes_of(path);
  ProgressBar bar("reading", bytes);
  for (std::uint32_t f = 0; f < options.files.size(); ++f) read_file(options, f, findings, bar);
}

// Files by their worst interval. What has none comes in the order of the command line, at the end.
std::vector<std::uint32_t> worst_files(const std::vector<ReportFile>& files) {
  std::vector<std::uint32_t> order(files.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t one, std::uint32_t other) {
    const std::optional<Interval>&a = files[one].worst, &b = files[other].worst;
    return a && b ? is_worse(*a, *b) : a.has_value() > b.has_value();
  });
  return order;
}

// Chooses the recordings that the page holds, the worst first, while their bytes are within the limit.
std::vector<PageRecording> choose_embedded(const std::vector<ReportFile>& files, ReportPage& page) {
  std::vector<PageRecording> embedded;
  std::uint64_t bytes = 0;
  page.recordings.resize(files.size());
  for (const std::uint32_t f : worst_files(files)) {
    if (!files[f].is_open || files[f].bytes > kMostEmbeddedBytes - bytes) continue;
    bytes += files[f].bytes;
    page.recordings[f] = static_cast<std::uint32_t>(embedded.size());
    embedded.push_back({std::filesystem::path(files[f].path).filename().string(), files[f].path});
  }
  return embedded;
}

// Writes all intervals and pairs, and returns those that the page shows.
ReportPage write_rows(const ReportOptions& options, Findings& findings, OutputFile& csv, OutputFile& pairs) {
  ReportPage page;
  page.min_depth = options.min_depth;
  page.min_frames = options.min_frames;
  page.interval_count = findings.intervals.count();
  page.pair_count = findings.pairs.count();
  ProgressBar bar("writing", page.interval_count + page.pair_count);
  write_interval_header(csv.stream());
  findings.intervals.take_all([&](const Interval& interval) {
    write_interval(csv.stream(), findings.files[interval.file], interval);
    if (page.intervals.size() < kMostRowsOfPage) page.intervals.push_back(interval);
    bar.advance(1);
  });
  for (const ReportFile& file : findings.files)
    for (const std::string& problem : file.problems) write_problem(csv.stream(), file, problem);
  if (csv) csv.close();
  if (pairs) write_pair_header(pairs.stream());
  findings.pairs.take_all([&](const PairTotals& pair) {
    if (pairs) write_pair(pairs.stream(), findings.files[pair.file], pair);
    if (page.pairs.size() < kMostRowsOfPage) page.pairs.push_back(pair);
    bar.advance(1);
  });
  if (pairs) pairs.close();
  return page;
}

void write_report_page(OutputFile& out, const Page& viewer, const std::vector<ReportFile>& files, ReportPage& page) {
  const std::vector<PageRecording> embedded = choose_embedded(files, page);
  std::uint64_t bytes = 0;
  for (const PageRecording& recording : embedded) bytes += bytes_of(recording.path);
  ProgressBar bar("page", bytes);
  write_page(out.stream(), viewer, report_json(files, page), embedded,
             [&](std::uint64_t count) { bar.advance(count); });
  out.close();
}

void print_table(const std::vector<ReportFile>& files) {
  TextTable table;
  table.add_row({"recording", "frames", "intervals", "pairs", "worst", "", "at frame", "links"});
  for (const std::uint32_t f : worst_files(files)) {
    const ReportFile& file = files[f];
    std::vector<std::string> cells = {file.path, std::to_string(file.frames_read), std::to_string(file.interval_count),
                                      std::to_string(file.pair_count)};
    if (!file.is_open) cells = {file.path, "-", "-", "-", "cannot be read"};
    if (file.worst) {
      const bool has_depth = !std::isnan(file.worst->worst_depth);
      const auto name = [&](const LinkPlace& place) {
        return file.names.character(place) + " " + file.names.link(place);
      };
      const std::uint32_t triangles = file.worst->worst_triangles;
      cells.push_back(has_depth       ? fixed(static_cast<double>(file.worst->worst_depth), 5)
                      : triangles > 0 ? std::to_string(triangles)
                                      : "-");
      cells.emplace_back(has_depth && file.metres_per_unit > 0 ? "m deep" : triangles > 0 ? "triangles" : "");
      cells.push_back(std::to_string(file.worst->worst.frame));
      cells.push_back(name(file.worst->links.a) + " and " + name(file.worst->links.b));
    }
    table.add_row(std::move(cells));
  }
  table.print(std::cout);
}

// Says what is wrong or left out. Returns whether something could not be read.
bool print_problems(const ReportOptions& options, const std::vector<ReportFile>& files) {
  bool is_bad = false;
  for (const ReportFile& file : files) {
    for (const std::string& problem : file.problems) {
      tell(file.is_open ? "warning" : "error", file.path + ": " + problem);
      is_bad = true;
    }
    if (file.is_open && !file.has_depths && options.min_depth)
      tell("note", file.path + " has no depths, so --min-depth leaves nothing of it; " +
                       (file.has_triangles ? "triangles have none" : "record it with an exact test"));
  }
  return is_bad;
}

void print_outputs(const ReportOptions& options, const std::string& csv_path, const ReportPage& page,
                   std::size_t file_count, bool has_page) {
  if (!csv_path.empty())
    std::cout << scenes::printable(csv_path) << ": " << page.interval_count << " intervals of contact\n";
  if (!options.pairs_path.empty())
    std::cout << scenes::printable(options.pairs_path) << ": " << page.pair_count << " pairs of links\n";
  if (!has_page) return;
  const auto count = static_cast<std::size_t>(std::count_if(page.recordings.begin(), page.recordings.end(),
                                                            [](const auto& index) { return index.has_value(); }));
  std::cout << scenes::printable(options.out_path) << ": " << count << " of " << file_count << " recordings inside\n";
  if (page.interval_count > page.intervals.size())
    tell("note", "the page shows the worst " + std::to_string(page.intervals.size()) + " of " +
                     std::to_string(page.interval_count) + " intervals; " +
                     (csv_path.empty() ? "--csv writes all" : csv_path + " has all"));
  if (page.pair_count > page.pairs.size())
    std::cerr << "note: the page shows the worst " << page.pairs.size() << " of " << page.pair_count
              << " pairs; --pairs writes all\n";
}

}  // namespace

int report_command(const ReportOptions& options) {
  if (options.out_path.empty() && options.csv_path.empty())
    throw UsageError("no output; give --out REPORT.html, or --csv REPORT.csv");
  const PageAlone page_alone(options.out_path);
  std::string csv_path = options.csv_path;
  if (csv_path.empty() && !page_alone && !is_device(options.out_path))
    csv_path = std::filesystem::path(options.out_path).replace_extension(".csv").string();
  std::vector<std::string> inputs = options.files;
  if (!options.page_path.empty()) inputs.push_back(options.page_path);
  check_outputs({{"--out", options.out_path}, {"--csv", csv_path}, {"--pairs", options.pairs_path}}, inputs);

  const bool wants_page = !options.out_path.empty();
  const std::filesystem::path viewer_path =
      options.page_path.empty() ? find_page() : std::filesystem::path(options.page_path);
  const bool has_page = wants_page && !viewer_path.empty();
  Page viewer;
  if (has_page) viewer = read_page(viewer_path);
  OutputFile out(has_page ? options.out_path : ""), csv(csv_path), pairs(options.pairs_path);

  Findings findings;
  read_files(options, findings);
  ReportPage page = write_rows(options, findings, csv, pairs);
  page.csv_name = std::filesystem::path(csv_path).filename().string();
  if (has_page) write_report_page(out, viewer, findings.files, page);

  print_table(findings.files);
  const bool is_bad = print_problems(options, findings.files);
  print_outputs(options, csv_path, page, findings.files.size(), has_page);
  if (wants_page && !has_page) tell("error", options.out_path + " is not written: " + how_to_get_page());
  return is_bad || (wants_page && !has_page) ? 1 : 0;
}

}  // namespace cab::perf
