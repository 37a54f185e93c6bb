// What a Span can be made of, and what it cannot.
#include <cab/span.h>

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

template <class To, class From>
inline constexpr bool makes = std::is_convertible_v<From, To>;

using Floats = std::vector<float>;

static_assert(std::is_standard_layout_v<Span<float>> && std::is_trivially_copyable_v<Span<float>>);
static_assert(sizeof(Span<float>) == sizeof(float*) + sizeof(std::size_t));

static_assert(makes<Span<float>, Floats&> && makes<Span<float>, std::array<float, 3>&>);
static_assert(makes<Span<float>, float (&)[3]>);
static_assert(makes<Span<const float>, Floats&> && makes<Span<const float>, const Floats&>);
static_assert(makes<Span<const float>, Floats> && makes<Span<const float>, const float (&)[3]>);
static_assert(makes<Span<const float>, Span<float>> && makes<Span<const char>, const std::string&>);

static_assert(!makes<Span<float>, const Floats&> && !makes<Span<float>, Floats>);
static_assert(!makes<Span<float>, const float (&)[3]>);
static_assert(!makes<Span<float>, Span<const float>> && !makes<Span<float>, float*> && !makes<Span<float>, int>);
static_assert(!makes<Span<const float>, std::vector<double>&> && !makes<Span<const float>, int (&)[3]>);

struct Base {
  int a;
};
struct Derived : Base {
  int b;
};
static_assert(!makes<Span<const Base>, std::vector<Derived>&> && !makes<Span<const Base>, Span<Derived>>);

std::size_t size_of(Span<const float> span) { return span.size; }

}  // namespace

TEST_CASE("span: it has the values of what it is made of, and changes them in place") {
  Floats vector = {1, 2, 3};
  float array[] = {4, 5};
  const std::array<float, 4> constant = {6, 7, 8, 9};
  Span<float> span = vector;
  CHECK(span.data == vector.data());
  CHECK(span.size == 3);
  span[1] = 20;
  CHECK(vector[1] == 20);
  span = array;
  CHECK(span.data == array);
  CHECK(span.size == 2);
  const Span<const float> values = constant;
  CHECK(values.data == constant.data());
  CHECK(values[3] == 9);
  const Span<const float> same = span;
  CHECK(same.data == array);
  CHECK(same.size == 2);
  float sum = 0;
  for (const float v : values) sum += v;
  CHECK(sum == 30);
}

TEST_CASE("span: pointers with a count, temporaries and nothing may be handed to a call") {
  const float array[] = {1, 2, 3};
  CHECK(size_of({array, 2}) == 2);
  CHECK(size_of(array) == 3);
  CHECK(size_of(Floats(5)) == 5);
  CHECK(size_of({}) == 0);
  CHECK(size_of({nullptr, 0}) == 0);
  CHECK(Span<float>().empty());
  CHECK(Span<float>().data == nullptr);
  constexpr Span<const float> kNone;
  static_assert(kNone.empty());
}

}  // namespace cab::tests
