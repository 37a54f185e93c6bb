// Boxes begin with axes, and ids and slots may be kept in containers.
#include <cab/query.h>
#include <cab/types.h>

#include <doctest/doctest.h>

#include <map>
#include <set>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>

namespace cab::tests {
namespace {

// Three ids of two values, in containers of all kinds.
template <class Id>
void check_id() {
  const Id none, first = {1}, second = {2};
  CHECK(none == Id());
  CHECK(first == Id{1});
  CHECK(first != second);
  CHECK_FALSE(first == second);
  CHECK_FALSE(first != Id{1});
  CHECK(first < second);
  CHECK_FALSE(second < first);
  CHECK_FALSE(first < Id{1});
  static_assert(noexcept(first == second)&& noexcept(std::hash<Id>()(first)));
  static_assert(std::is_trivially_copyable_v<Id> && sizeof(Id) == sizeof(Id::value));
  CHECK(std::set<Id>{second, first, Id{1}}.size() == 2);
  CHECK(std::map<Id, int>{{first, 7}}.count(second) == 0);
  CHECK(std::unordered_set<Id>{second, first, Id{1}}.size() == 2);
  const std::unordered_map<Id, int> by_id = {{first, 7}, {second, 8}};
  CHECK(by_id.at(Id{2}) == 8);
  // Every part of an id counts: what was in one slot before has another hash.
  std::set<std::size_t> hashes;
  for (unsigned bit = 0; bit < 8 * sizeof(Id::value); ++bit)
    hashes.insert(std::hash<Id>()({decltype(Id::value){1} << bit}));
  CHECK(hashes.size() == 8 * (sizeof(std::size_t) < sizeof(Id::value) ? sizeof(std::size_t) : sizeof(Id::value)));
}

}  // namespace

TEST_CASE("ids and slots compare by their values, and have hashes") {
  check_id<ArticulationId>();
  check_id<BatchId>();
  check_id<BatchSlot>();
  check_id<HistoryId>();
}

TEST_CASE("a box that is not set is a point with the axes of its frame") {
  const Box boxes[] = {Box(), Leaf().box, StaticBody().box, LodLeaf().box};
  for (const Box& box : boxes)
    for (int k = 0; k < 3; ++k) {
      CHECK(box.center[k] == 0);
      CHECK(box.half[k] == 0);
      for (int c = 0; c < 3; ++c) CHECK(box.axis[k][c] == (k == c ? 1 : 0));
    }
}

}  // namespace cab::tests
