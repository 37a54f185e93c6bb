#include "perf/tools/query/measure.h"

#include <algorithm>
#include <stdexcept>

#include "layout/bit_hash.h"
#include "layout/frame_stats.h"
#include "perf/base/engine_call.h"
#include "perf/base/report.h"

namespace cab::perf {
namespace {

const QuerySource& source_of(const AskedQueries& asked, std::size_t query) {
  return *std::find_if(asked.sources.begin(), asked.sources.end(), [query](const QuerySource& source) {
    return query >= source.first && query - source.first < source.count;
  });
}

// Asks the queries of one frame after the other, and keeps the memory for the answers.
class Asker {
 public:
  Asker(Targets& targets, const AskedQueries& asked, const QuerySessionOptions& options)
      : targets_(targets),
        asked_(asked),
        most_hits_(options.most_hits),
        found_(asked.queries.size()),
        hits_(hits_at_first(asked)) {
    job_.queries = asked.queries;
    job_.found = found_;
    job_.exact = options.exact;
  }

  // Runs all queries; the stats are those of the last call.
  const QueryStats& run() {
    job_.inputs = targets_.inputs();
    Status status = Status::kHitsOverflow;
    while (status == Status::kHitsOverflow) {
      job_.hits = hits_;
      status = run_queries(targets_.engine(), job_);
      if (status == Status::kHitsOverflow) grow();
    }
    if (status == Status::kBadQuery) {
      const QuerySource& source = source_of(asked_, job_.bad_query);
      throw std::runtime_error(source.name + ": row " + std::to_string(job_.bad_query - source.first) + ": " +
                               to_string(status));
    }
    require(status, "queries");
    return job_.stats;
  }

  Span<const QueryHit> hits() const { return {hits_.data(), job_.hit_count}; }
  Span<const std::uint8_t> found() const { return found_; }

 private:
  // One hit per query is enough unless queries want all.
  static std::size_t hits_at_first(const AskedQueries& asked) {
    return static_cast<std::size_t>(std::count_if(asked.queries.begin(), asked.queries.end(),
                                                  [](const Query& query) { return query.want != QueryWant::kAny; }));
  }

  void grow() {
    const std::size_t needed = job_.hits_needed;
    if (needed > most_hits_)
      throw std::runtime_error(
          "the queries have " + std::to_string(needed) + " hits, more than the " + std::to_string(most_hits_) +
          " that are kept; ask for fewer with --max-hits or --want closest, or give fewer queries");
    hits_ = {};  // first, so that there are never two lists
    hits_.resize(needed);
  }

  Targets& targets_;
  const AskedQueries& asked_;
  const std::size_t most_hits_;
  std::vector<std::uint8_t> found_;
  std::vector<QueryHit> hits_;
  QueryJob job_;
};

void count_answers(const AskedQueries& asked, const QueryAnswers& answers, std::vector<QueryCounts>& counts) {
  std::size_t h = 0;
  for (std::size_t s = 0; s < asked.sources.size(); ++s) {
    const QuerySource& source = asked.sources[s];
    const std::size_t end = source.first + source.count;
    for (std::size_t q = source.first; q < end; ++q) counts[s].found += answers.found[q];
    for (; h < answers.hits.size && answers.hits[h].query < end; ++h) ++counts[s].hits;
  }
}

void add_answers(const QueryAnswers& answers, cab::BitHash& hash) {
  hash.add(answers.frame);
  for (const std::uint8_t byte : answers.found) hash.add(std::uint32_t{byte});
  for (const QueryHit& hit : answers.hits) {
    for (const std::uint32_t number : {hit.query, hit.batch.value, hit.instance, std::uint32_t{hit.link},
                                       std::uint32_t{hit.leaf}, std::uint32_t{hit.inside}})
      hash.add(number);
    hash.add(hit.distance);
    for (const float number : hit.point) hash.add(number);
    for (const float number : hit.normal) hash.add(number);
  }
}

std::optional<MaskedTarget> find_masked(Targets& targets, std::uint32_t frame) {
  for (std::size_t g = 0; g < targets.groups().size(); ++g) {
    if (!targets.groups()[g].figure) continue;  // static bodies are never masked
    for (std::uint32_t i = 0; i < targets.groups()[g].count; ++i) {
      MaskReason reason;
      require(why_masked(targets.engine(), targets.inputs()[g], i, &reason), targets.groups()[g].name);
      if (reason.cause != MaskCause::kNone) return MaskedTarget{frame, i, g, reason};
    }
  }
  return std::nullopt;
}

}  // namespace

void AskedQueries::add(std::string name, QueryKind kind, std::vector<Query> more) {
  sources.push_back({std::move(name), kind, queries.size(), more.size()});
  if (queries.empty()) {
    queries = std::move(more);
    return;
  }
  queries.insert(queries.end(), more.begin(), more.end());
}

QueryFigures measure_queries(Targets& targets, const AskedQueries& asked, const QuerySessionOptions& options,
                             const std::function<void(const QueryAnswers&)>& on_answers) {
  QueryFigures figures;
  figures.counts.resize(asked.sources.size());
  figures.rounds.resize(options.rounds);
  Asker asker(targets, asked, options);
  cab::BitHash hash;
  ProgressBar bar("queries", (std::uint64_t{options.rounds} + 1) * options.frames.count());
  for (std::uint32_t frame = options.frames.first; frame < options.frames.end; ++frame) {
    targets.pose(frame);
    const QueryStats stats = asker.run();
    add_stats(figures.stats, stats);
    if (stats.instances_masked > 0 && !figures.first_masked) figures.first_masked = find_masked(targets, frame);
    const QueryAnswers answers = {frame, asker.hits(), asker.found()};
    count_answers(asked, answers, figures.counts);
    add_answers(answers, hash);
    on_answers(answers);
    bar.advance(1);
    for (QueryStats& round : figures.rounds) {
      add_stats(round, asker.run());
      if (asker.hits().size != answers.hits.size)
        throw std::runtime_error("frame " + std::to_string(frame) + " gave another number of hits when it ran again");
      bar.advance(1);
    }
  }
  figures.hits_hash = hash.value();
  return figures;
}

}  // namespace cab::perf
