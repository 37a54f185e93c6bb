// Turns bytes into the text of a command line option. The answer is a value or one printable line. Policies are
// accepted by their names alone.
#include "perf/base/option_values.h"
#include "perf/base/usage.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"

#include <cmath>

namespace {

using namespace cab;
using namespace cab::perf;

void set_and_compare(std::uint32_t row, const std::string& text) {
  const Span<const PolicyField> table = policy_table();
  Policies policies;
  FUZZ_CHECK(!policy_set(policies, row, nullptr));
  const bool known = policy_set(policies, row, text.c_str());
  for (std::uint32_t r = 0; r < table.size; ++r) {
    const std::uint32_t value = policy_get(policies, r);
    FUZZ_CHECK(value < table[r].value_count);
    if (known && r == row) FUZZ_CHECK(text == table[r].values[value].name);
    if (!known || r != row) FUZZ_CHECK(value == policy_get({}, r));
  }
  if (!known)
    for (std::uint32_t v = 0; row < table.size && v < table[row].value_count; ++v)
      FUZZ_CHECK(text != table[row].values[v].name);
  if (row < table.size) set_policy(policies, row, text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const std::uint32_t reader = bytes.below(12);
  const std::string text = bytes.rest().c_str();  // an argument ends at its first zero
  try {
    switch (reader) {
      case 0:
        for (const double c : read_offset("--offset", text)) FUZZ_CHECK(std::isfinite(c));
        break;
      case 1: FUZZ_CHECK(read_positive("--units", text) > 0); break;
      case 2: FUZZ_CHECK(read_frame_range("--frames", text).count() > 0); break;
      case 3: FUZZ_CHECK(isa_available(read_isa("--isa", text))); break;
      case 4: FUZZ_CHECK(read_choice("--lod", text, {"reach", "nodes"}, "a kind of level") < 2); break;
      case 5: FUZZ_CHECK(read_number_list("--tables", text).size() == split_commas(text).size()); break;
      default: set_and_compare(reader - 6, text);
    }
  } catch (const UsageError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind("--", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
