// What frames of characters keep in an engine: rows, strips and the order of the last frame.
#pragma once

#include "layout/arena.h"
#include "layout/leaf_words.h"
#include "layout/tile.h"

#include <cstddef>

namespace cab {

// An instance in the crowd. words: its first LeafWords.
struct CrowdRow {
  std::uint32_t batch, instance, words;
};

// Instances of similar extent. Strips of one height lie along the crowd's second axis; in a strip, rows are sorted by
// their lower sides along its first axis. An instance is in the strip where its bounds begin, and no instance of the
// class is as long as a strip is high.
struct CrowdClass {
  float most;    // greatest extent along one of the two axes
  float reach;   // along the first axis
  float extent;  // along the second axis
  float low;     // least lower side along the second axis
  float scale;   // strips per length
  std::uint32_t first_strip, strips;
};
inline constexpr std::uint32_t kCrowdClasses = 16;

// How many rows may come to rest, or leave rest, before the kept ones are sorted again.
inline std::size_t spare_rows(std::size_t rows) { return rows / 16 + 64; }

// Classes in ascending order of extents, and the strips and the sorted rows of some of them: of all, or in a frame with
// bands of the strays.
struct CrowdClasses {
  CrowdClass of[kCrowdClasses];
  std::uint32_t count = 0;
  std::uint32_t first_strip = 0, end_strip = 0;
  std::uint32_t first_sorted = 0, end_sorted = 0;
};

// How a crowd of one batch goes on in the next frame. Its order was sorted by the strips of class 0, and instances move
// little: so a strip can be paired as soon as the instances of the strip after it are bounded, while all of them are in
// cache. The few that are elsewhere by then are strays, and become a class of their own.
struct CrowdBands {
  bool ready = false;
  std::uint32_t batch = 0;        // index of the only batch of that crowd
  std::uint32_t wait = 0;         // frames that go without, since too many had strayed
  std::uint32_t strays = 0;       // of the current frame; may exceed the room for them
  std::uint32_t first_stray = 0;  // where their sorted rows begin
  std::uint32_t chunks = 0;       // tasks, each of some strips that follow each other
};

// The crowd of an engine. Rows are in the order of batches, those of a batch begin at a multiple of kLanes. Within one
// they are in that of instances, or of CrowdBatch::order or the caller's list if is_by_place. Sorted rows are in the
// order of classes, of strips, and of the first axis; those that are kept come first.
struct Crowd {
  Span<LeafWords> words;
  Span<float> sides;             // six arrays, by row
  Span<CrowdRow> rows;           // by row
  Span<std::uint32_t> strip_of;  // by row
  Span<std::uint64_t> keys;      // by sorted row: the lower side along the first axis, as an ordered number, and row
  Span<float> sorted_sides;      // six arrays, by sorted row
  Span<std::uint32_t> strip_begin, strip_end;  // by strip: its sorted rows; with bands there are gaps between strips
  Span<std::uint32_t> strip_first;             // by strip of class 0, for bands: its first place in the order
  Span<std::uint32_t> strays;                  // rows; or, where most are kept, those that are not
  std::size_t capacity = 0;                    // of rows
  std::size_t sorted_capacity = 0;

  // Of the current frame; the axes and class 0 of the last one where it has bands.
  bool one_batch = false;
  std::uint32_t last_batch = 0;  // index of the last batch, which is the only one if there is one
  bool takes_all = false;        // one batch that a rule pairs with itself, and no layers: every candidate is tested
  bool only_words = false;       // all batches are by words, and no rule tests an instance within itself
  bool by_bands = false;
  std::uint64_t frames = 0;           // how many have laid out rows
  std::uint32_t row_count = 0;        // with the unused ones
  std::uint32_t axes[3] = {0, 1, 2};  // of the world, by the crowd's
  CrowdClasses classes;
  CrowdBands bands;

  // Of characters that rest, kept from frame to frame. A row counts while its instance has kKept. They are sorted again
  // when more than spare_rows rest without being among them, or have left them.
  CrowdClasses kept;
  bool kept_is_stale = false;  // whether the rows of batches have moved since

  const CrowdRow& sorted_row(std::uint32_t i) const { return rows.data[static_cast<std::uint32_t>(keys.data[i])]; }
  float* side(std::uint32_t s) const { return sides.data + s * capacity; }
  float* sorted_side(std::uint32_t s) const { return sorted_sides.data + s * (sorted_capacity + kLanes); }
};

}  // namespace cab
