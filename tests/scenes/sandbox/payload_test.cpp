// Payloads: what is written is read, and bytes that are cut off, changed or made up are refused.
#include "scenes/sandbox/payload.h"

#include <doctest/doctest.h>

#include <limits>

namespace {

using namespace cab::scenes;

std::string made() {
  PayloadWriter writer;
  writer.value(2.5);
  writer.text("walk");
  writer.array(std::vector<std::int32_t>{1, -2, 3});
  writer.texts({"a", "", "b"});
  return writer.take();
}

// Whether the bytes hold exactly what was made. Throws PayloadError.
bool is_made(const std::string& bytes) {
  PayloadReader reader(bytes);
  const auto number = reader.value<double>();
  const std::string text = reader.text();
  const std::vector<std::int32_t> array = reader.array<std::int32_t>();
  const std::vector<std::string> texts = reader.texts();
  reader.finish();
  return number == 2.5 && text == "walk" && array == std::vector<std::int32_t>{1, -2, 3} &&
         texts == std::vector<std::string>{"a", "", "b"};
}

}  // namespace

TEST_CASE("what a payload writer wrote is read") { CHECK(is_made(made())); }

TEST_CASE("a payload that ends too early, or too late, is refused") {
  const std::string good = made();
  for (std::size_t size = 0; size < good.size(); ++size) CHECK_THROWS_AS(is_made(good.substr(0, size)), PayloadError);
  CHECK_THROWS_AS(is_made(good + "x"), PayloadError);
}

TEST_CASE("a count above the bytes that are left allocates nothing") {
  for (const std::uint64_t count :
       {std::uint64_t{9}, std::uint64_t{1} << 32, std::uint64_t{1} << 61, std::numeric_limits<std::uint64_t>::max()}) {
    PayloadWriter writer;
    writer.value(count);
    writer.value(std::uint64_t{0});
    const std::string bytes = writer.take();
    CHECK_THROWS_AS(PayloadReader(bytes).text(), PayloadError);
    CHECK_THROWS_AS(PayloadReader(bytes).array<double>(), PayloadError);
    CHECK_THROWS_AS(PayloadReader(bytes).texts(), PayloadError);
  }
}
