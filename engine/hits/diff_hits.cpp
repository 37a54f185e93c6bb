// What began and what ended between two lists of hits.
#include <cab/cab.h>

#include <initializer_list>
#include <tuple>

namespace cab {
namespace {

// The order of hits, and when two of them are of the same links.
auto links_of(const Hit& hit) {
  return std::tie(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}

bool is_sorted(Span<const Hit> hits) {
  for (std::size_t i = 1; i < hits.size; ++i)
    if (!(links_of(hits[i - 1]) < links_of(hits[i]))) return false;
  return true;
}

// Writes hits as far as there is room, and counts them all.
struct HitWriter {
  Span<Hit> to;
  std::size_t count = 0;
  void write(const Hit& hit) {
    if (count < to.size) to[count] = hit;
    ++count;
  }
};

}  // namespace

Status diff_hits(Span<const Hit> previous, Span<const Hit> current, HitChanges& changes) noexcept {
  for (const Span<const Hit>& list : {previous, current})
    if ((list.size && !list.data) || !is_sorted(list)) return Status::kUnsortedHits;
  for (const Span<Hit>& list : {changes.began, changes.ended})
    if (list.size && !list.data) return Status::kBadOutput;
  HitWriter began = {changes.began}, ended = {changes.ended};
  std::size_t p = 0, c = 0;
  while (p < previous.size || c < current.size) {
    const bool before = c == current.size || (p < previous.size && links_of(previous[p]) < links_of(current[c]));
    const bool after = p == previous.size || (c < current.size && links_of(current[c]) < links_of(previous[p]));
    if (before) ended.write(previous[p]);
    if (after) began.write(current[c]);
    p += !after;
    c += !before;
  }
  changes.began_count = began.count;
  changes.ended_count = ended.count;
  return began.count > began.to.size || ended.count > ended.to.size ? Status::kHitsOverflow : Status::kOk;
}

}  // namespace cab
