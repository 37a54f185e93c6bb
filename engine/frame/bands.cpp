#include "engine/frame/bands.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/broad_phase/crowd_scratch.h"
#include "engine/broad_phase/first_pass.h"
#include "engine/broad_phase/strip_searcher.h"
#include "engine/broad_phase/strips.h"
#include "engine/frame/crowd_tester.h"
#include "engine/hits/hit_store.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/timed.h"
#include "layout/atomic_words.h"

#include <algorithm>

namespace cab {
namespace {

// With fewer strips there is nothing to gain.
constexpr std::uint32_t kLeastStrips = 6;

// Fewer rows are not worth a chunk: where two chunks meet, up to fifteen rows are strays.
constexpr std::uint32_t kRowsPerChunk = 320;

// Frames without bands after one in which too many had strayed.
constexpr std::uint32_t kWait = 8;

// The only batch of the crowd.
StoredBatch& only_batch(const Engine& engine) { return *engine.batches[engine.crowd.last_batch]; }

// The strips of a chunk.
struct Chunk {
  std::uint32_t first, end;
};
Chunk chunk_of(const Crowd& crowd, std::uint32_t chunk) {
  const std::uint32_t strips = crowd.classes.of[0].strips, chunks = crowd.bands.chunks;
  return {strips * chunk / chunks, strips * (chunk + 1) / chunks};
}

// Where the places of a chunk begin in the order: whole tiles.
std::uint32_t first_place(const Crowd& crowd, std::uint32_t chunk, std::uint32_t places) {
  if (chunk == crowd.bands.chunks) return places;
  const std::uint32_t first = crowd.strip_first[chunk_of(crowd, chunk).first];
  return chunk == 0 ? 0 : std::min(places, (first + kLanes - 1) / kLanes * kLanes);
}

// Unused rows after a chunk: a search reads up to kLanes - 1 rows past a strip, which no other thread may write.
constexpr std::uint32_t kSeamRoom = kLanes;

// Room for the rows of a strip that had so many.
std::uint32_t room_for(std::uint32_t rows) { return rows + rows / 4 + 8; }

// One chunk in progress. Strips before `sorted` take no more rows.
struct BandTask {
  Crowd& crowd;
  CrowdScratch& scratch;
  Chunk chunk;
  std::uint32_t sorted;
  float most_extent;
  std::uint32_t taken;  // rows that are in strips

  float reach() const { return scratch.reach * (1 + kStripRounding); }

  // Puts the rows up to `end` into strips of the chunk. Those that fit none are strays.
  void take_rows(std::uint32_t end) {
    const CrowdClass& of = crowd.classes.of[0];
    const float *const lower = crowd.side(crowd.axes[1]), *const upper = crowd.side(3 + crowd.axes[1]);
    const float *const from = crowd.side(crowd.axes[0]), *const to = crowd.side(3 + crowd.axes[0]);
    for (; taken < end; ++taken) {
      if (!is_there(crowd, taken)) continue;
      const float extent = upper[taken] - lower[taken];
      const std::uint32_t strip = strip_at(of, lower[taken]);
      if (extent > most_extent || strip < sorted || strip >= chunk.end ||
          crowd.strip_end[strip] == crowd.strip_begin[strip + 1] - (strip + 1 == chunk.end ? kSeamRoom : 0)) {
        const std::uint32_t at = relaxed_add(crowd.bands.strays, 1);
        if (at < crowd.strays.size) crowd.strays[at] = taken;
        continue;
      }
      crowd.keys[crowd.strip_end[strip]++] = sort_key(from[taken], taken);
      scratch.reach = std::max(scratch.reach, to[taken] - from[taken]);
      scratch.extent = std::max(scratch.extent, extent);
    }
  }
};

}  // namespace

bool begin_bands(FrameRun& run) {
  Crowd& crowd = run.engine.crowd;
  CrowdBands& bands = crowd.bands;
  const bool ready = bands.ready && crowd.only_words && crowd.one_batch && only_batch(run.engine).crowd.is_by_place &&
                     only_batch(run.engine).crowd.ordered && only_batch(run.engine).crowd.index == bands.batch;
  bands.ready = false;
  if (!ready) return false;
  crowd.classes.count = 1;
  const std::uint32_t strips = crowd.classes.of[0].strips;
  bands.strays = 0;
  const auto workers = static_cast<std::uint32_t>(run.engine.pool.working_count());
  bands.chunks =
      workers == 1 ? 1 : std::max(1u, std::min({4 * workers, strips / kLeastStrips, crowd.row_count / kRowsPerChunk}));
  std::uint32_t at = 0;
  for (std::uint32_t chunk = 0; chunk < bands.chunks; ++chunk, at += kSeamRoom)
    for (std::uint32_t s = chunk_of(crowd, chunk).first; s < chunk_of(crowd, chunk).end; ++s) {
      crowd.strip_begin[s] = crowd.strip_end[s] = at;
      at += room_for(crowd.strip_first[s + 1] - crowd.strip_first[s]);
    }
  crowd.strip_begin[strips] = bands.first_stray = at;
  for (const auto& worker : run.engine.pool.workers) worker->crowd[0].reach = worker->crowd[0].extent = 0;
  return true;
}

void run_band_task(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  Crowd& crowd = run.engine.crowd;
  Worker& worker = run.worker(w);
  StoredBatch& stored = only_batch(run.engine);
  const Clock::time_point start = Clock::now();
  const auto others = [&worker] {
    return worker.stats.seconds_update + worker.stats.seconds_test + worker.stats.seconds_query;
  };
  const double before = others();
  const Chunk chunk = chunk_of(crowd, task);
  const std::uint32_t count = stored.crowd.row_count, end = first_place(crowd, task + 1, count);
  std::uint32_t place = first_place(crowd, task, count);
  CrowdScratch& scratch = worker.crowd[0];
  BandTask band = {crowd, scratch, chunk, chunk.first, 1 / crowd.classes.of[0].scale / 1.05f, place};
  CrowdTester tester(*run.characters, crowd, worker, run.sink);
  for (std::uint32_t s = chunk.first; s < chunk.end; ++s) {
    {
      const Timed timed(worker.stats.seconds_update), bounded(worker.stats.seconds_bound);
      const std::uint32_t until = s + 1 == chunk.end ? end : std::min(end, crowd.strip_first[s + 1]);
      if (place < until) {
        bound_crowd_tiles(*run.characters, stored, place, until, crowd, scratch, worker.pose, worker.stats);
        place += tile_count(until - place) * kLanes;
      }
    }
    band.take_rows(std::min(place, count));
    if (s == chunk.first) continue;
    sort_strip(crowd, s - 1);
    band.sorted = s;
    if (s - 1 > chunk.first)
      pair_in_strip(tester, 0, band.reach(), s - 2, crowd.strip_begin[s - 2], crowd.strip_end[s - 2], true);
  }
  sort_strip(crowd, chunk.end - 1);
  for (std::uint32_t s = std::max(chunk.first + 2, chunk.end) - 2; s < chunk.end; ++s)
    pair_in_strip(tester, 0, band.reach(), s, crowd.strip_begin[s], crowd.strip_end[s], s + 1 < chunk.end);
  tester.test();
  worker.stats.seconds_broad += seconds_since(start) - (others() - before);
}

void pair_seam(FrameRun& run, std::uint32_t chunk, std::uint32_t w) {
  CrowdTester tester(*run.characters, run.engine.crowd, run.worker(w), run.sink);
  pair_with_next(tester, chunk_of(run.engine.crowd, chunk).end - 1);
  tester.test();
}

namespace {

// Drops what was paired so far.
void drop_pairs(FrameRun& run) {
  begin_storing(run.sink);
  const Span<HitChain> chains = only_batch(run.engine).batch.hit_chains;
  std::fill(chains.begin(), chains.end(), HitChain{});
  for (const auto& worker : run.engine.pool.workers) {
    worker->hits.block = {};
    FrameStats& stats = worker->stats;
    stats.candidates = stats.candidates_apart = stats.box_tests = stats.leaf_pairs = 0;
    stats.exact_tests = stats.false_positives = 0;
  }
  clear_in_contact(run.job.inputs);
}

}  // namespace

bool end_bands(FrameRun& run) {
  Crowd& crowd = run.engine.crowd;
  CrowdBands& bands = crowd.bands;
  if (bands.strays > crowd.strays.size) {
    drop_pairs(run);
    crowd.by_bands = false;
    bands.wait = kWait;
    return false;
  }
  CrowdClass& of = crowd.classes.of[0];
  of.reach = of.extent = 0;
  for (const auto& worker : run.engine.pool.workers) {
    of.reach = std::max(of.reach, worker->crowd[0].reach * (1 + kStripRounding));
    of.extent = std::max(of.extent, worker->crowd[0].extent * (1 + kStripRounding));
  }
  lay_out_strays(crowd, bands.strays);
  return true;
}

namespace {

// Appends the instances of masked rows to the order, which others fill up to there.
void append_masked(const Crowd& crowd, CrowdBatch& own) {
  std::uint32_t at = own.row_count;
  for (std::uint32_t row = own.first_row + own.row_count; row-- > own.first_row;)
    if (!is_there(crowd, row)) own.order[--at] = crowd.rows[row].instance;
}

// The order of a frame with bands: strip by strip, strays after the sorted rows of theirs.
void keep_order_of_bands(Crowd& crowd, CrowdBatch& own) {
  const CrowdClass& of = crowd.classes.of[0];
  const float* const lower = crowd.side(crowd.axes[1]);
  std::uint32_t *const first = crowd.strip_first.data, *const end = crowd.strip_end.data;
  for (std::uint32_t s = 0; s < of.strips; ++s) first[s + 1] = end[s] - crowd.strip_begin[s];
  for (std::uint32_t i = 0; i < crowd.bands.strays; ++i) ++first[strip_at(of, lower[crowd.strays[i]]) + 1];
  first[0] = 0;
  for (std::uint32_t s = 0; s < of.strips; ++s) {
    first[s + 1] += first[s];
    std::uint32_t at = first[s];
    for (std::uint32_t i = crowd.strip_begin[s]; i < end[s]; ++i) own.order[at++] = crowd.sorted_row(i).instance;
    end[s] = at;
  }
  for (std::uint32_t i = 0; i < crowd.bands.strays; ++i) {
    const std::uint32_t row = crowd.strays[i];
    own.order[end[strip_at(of, lower[row])]++] = crowd.rows[row].instance;
  }
}

// The order of a frame without bands: that of sorted rows.
void keep_order_of_strips(Engine& engine) {
  const Crowd& crowd = engine.crowd;
  for_each_crowd_batch(engine.stored_batches(), [](StoredBatch& stored) { stored.crowd.in_order = 0; });
  for (std::uint32_t i = crowd.classes.first_sorted; i < crowd.classes.end_sorted; ++i) {
    CrowdBatch& own = engine.batches[crowd.sorted_row(i).batch]->crowd;
    if (own.orders) own.order[own.in_order++] = crowd.sorted_row(i).instance;
  }
}

// Where the strips of a frame without bands begin in its order.
void keep_strips(Crowd& crowd) {
  const CrowdClass& of = crowd.classes.of[0];
  for (std::uint32_t s = 0; s < of.strips; ++s) crowd.strip_first[s] = crowd.strip_begin[s];
  crowd.strip_first[of.strips] = crowd.strip_end[of.strips - 1];
}

// Whether the strips of this frame do for the next one.
bool is_ready(const Crowd& crowd) {
  const CrowdClass& of = crowd.classes.of[0];
  constexpr std::uint32_t kStrangers = 16;  // at most one row in so many is no row of class 0
  constexpr float kTall = 1.4f;             // strips are at most so many times as high as the longest row
  constexpr std::uint32_t kUneven = 8, kFewRows = 64;
  const std::uint32_t in_strips = crowd.by_bands ? crowd.bands.first_stray : crowd.strip_end[of.strips - 1];
  const std::uint32_t strangers = crowd.classes.end_sorted - (crowd.by_bands ? crowd.classes.first_sorted : in_strips);
  if (of.strips < kLeastStrips || crowd.bands.wait > 0 || strangers * kStrangers > crowd.row_count ||
      kTall * of.extent * of.scale < 1)
    return false;
  std::size_t room = crowd.strays.size + std::size_t{kSeamRoom} * (crowd.row_count / kRowsPerChunk + 1);
  std::uint32_t most = 0;
  for (std::uint32_t s = 0; s < of.strips; ++s) {
    const std::uint32_t rows = crowd.strip_first[s + 1] - crowd.strip_first[s];
    most = std::max(most, rows);
    room += room_for(rows);
  }
  // The crowd may have left its strips, or nearly: then nearly all rows are in a few of them.
  const bool is_even = most <= kUneven * (crowd.row_count / of.strips) + kFewRows;
  return is_even && room <= crowd.sorted_capacity;
}

}  // namespace

void keep_order(Engine& engine) {
  Crowd& crowd = engine.crowd;
  for_each_crowd_batch(engine.stored_batches(), [&crowd](StoredBatch& stored) {
    CrowdBatch& own = stored.crowd;
    own.orders = stored.batch.input->instances.empty() && own.order.size == own.row_count && !stored.batch.may_rest;
    if (!own.orders) return;
    append_masked(crowd, own);
    own.ordered = true;
  });
  if (crowd.by_bands) {
    keep_order_of_bands(crowd, only_batch(engine).crowd);
  } else {
    keep_order_of_strips(engine);
    if (crowd.only_words) keep_strips(crowd);
  }
  crowd.bands.wait -= crowd.bands.wait > 0;
  crowd.bands.batch = crowd.last_batch;
  crowd.bands.ready = crowd.only_words && crowd.one_batch && only_batch(engine).crowd.is_by_place &&
                      only_batch(engine).crowd.orders && is_ready(crowd);
}

}  // namespace cab
