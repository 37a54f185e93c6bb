// Bytes as the result of a child process: what is read from them is whole, and is the same after another way through
// bytes.
#include "scenes/import/import_payload.h"
#include "scenes/import/printable.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/sandbox/payload.h"
#include "tests/fuzz/bytes.h"

namespace {

// Whether the same was read of both: a character that is not shown has become one question mark, whatever its bytes.
bool is_whole(const std::string& again, const std::string& bytes) {
  return again.size() <= bytes.size() && again.size() >= cab::scenes::printable(bytes).size();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cab;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    const std::string again = scenes::skeleton_payload(scenes::read_skeleton_payload(bytes));
    FUZZ_CHECK(is_whole(again, bytes));
    FUZZ_CHECK(scenes::skeleton_payload(scenes::read_skeleton_payload(again)) == again);
  } catch (const scenes::PayloadError&) {}
  try {
    const std::string again = scenes::trajectories_payload(scenes::read_trajectories_payload(bytes));
    FUZZ_CHECK(is_whole(again, bytes));
    FUZZ_CHECK(scenes::trajectories_payload(scenes::read_trajectories_payload(again)) == again);
  } catch (const scenes::PayloadError&) {}
  try {
    const std::string again = scenes::robot_payload(scenes::read_robot_payload(bytes));
    FUZZ_CHECK(is_whole(again, bytes));
    FUZZ_CHECK(scenes::robot_payload(scenes::read_robot_payload(again)) == again);
  } catch (const scenes::PayloadError&) {}
  try {
    FUZZ_CHECK(scenes::triangles_payload(scenes::read_triangles_payload(bytes)) == bytes);
  } catch (const scenes::PayloadError&) {}
  return 0;
}
