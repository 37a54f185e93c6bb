#include "perf/measure/peers/query_world.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "perf/base/processor_time.h"

namespace cab::perf {
namespace {

constexpr std::uint32_t kBits = 11;  // of a pass of the sort, and of each coordinate of a key

// Puts a zero bit between each two of the lowest eleven bits.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | x << 8) & 0x00ff00ff;
  x = (x | x << 4) & 0x0f0f0f0f;
  x = (x | x << 2) & 0x33333333;
  return (x | x << 1) & 0x55555555;
}

// Along a Morton curve. `order` receives the indices.
void sort_queries(const std::vector<PeerQuery>& queries, std::vector<std::uint32_t>& order) {
  struct Keyed {
    std::uint32_t key, number;
  };
  static thread_local std::vector<Keyed> from, to;
  from.resize(queries.size());
  to.resize(queries.size());
  float low[2] = {kNoHit, kNoHit}, high[2] = {-kNoHit, -kNoHit};
  for (const PeerQuery& query : queries)
    for (std::size_t c = 0; c < 2; ++c) {
      low[c] = std::min(low[c], query.at[c]);
      high[c] = std::max(high[c], query.at[c]);
    }
  const float size = std::max({high[0] - low[0], high[1] - low[1], 1e-6f});
  const float cells = static_cast<float>((1 << kBits) - 1) / size;
  for (std::uint32_t i = 0; i < queries.size(); ++i) {
    const PeerQuery& query = queries[i];
    std::uint32_t octant = 0, place = 0;
    for (std::uint32_t c = 0; c < 3; ++c) octant |= static_cast<std::uint32_t>(query.direction[c] < 0) << c;
    for (std::uint32_t c = 0; c < 2; ++c)
      place |= spread_bits(static_cast<std::uint32_t>((query.at[c] - low[c]) * cells)) << c;
    from[i] = {place << 3 | octant, i};
  }
  for (std::uint32_t shift = 0; shift < 33; shift += kBits) {
    std::array<std::uint32_t, std::size_t{1} << kBits> begin{};
    const auto digit = [shift](const Keyed& k) { return k.key >> shift & ((1U << kBits) - 1); };
    for (const Keyed& k : from) ++begin[digit(k)];
    std::uint32_t sum = 0;
    for (std::uint32_t& b : begin) {
      const std::uint32_t count = b;
      b = sum;
      sum += count;
    }
    for (const Keyed& k : from) to[begin[digit(k)]++] = k;
    std::swap(from, to);
  }
  order.resize(queries.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = from[i].number;
}

}  // namespace

const std::vector<std::uint32_t>& CrowdQueries::begin(const QuestionSet& asked, bool is_sorted, Answers& out) {
  out.clear(asked.peers.size());
  if (is_sorted) {
    const double start = processor_seconds();
    sort_queries(asked.peers, order_);
    out.sort_seconds = processor_seconds() - start;
  } else {
    order_.resize(asked.peers.size());
    std::iota(order_.begin(), order_.end(), 0U);
  }
  return order_;
}

}  // namespace cab::perf
