// A fuzzer's bytes as numbers, rotations and boxes. Most are valid, so that inputs pass the checks; some are anything.
#pragma once

#include "perf/harness/random_rig.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

// Stops the program if the condition does not hold. A fuzzer and a test both count that as a failure.
#define FUZZ_CHECK(condition)                                                                             \
  do {                                                                                                    \
    if (condition) break;                                                                                 \
    std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, static_cast<int>(__LINE__), #condition); \
    std::abort();                                                                                         \
  } while (false)

namespace cab::fuzz {

// Reads from the front; zeros once the bytes are used up.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  bool empty() const { return at_ == size_; }

  template <class T>
  T raw() {
    T value = {};
    const std::size_t count = std::min(sizeof(T), size_ - at_);
    if (count > 0) std::memcpy(&value, data_ + at_, count);
    at_ += count;
    return value;
  }

  // 0 .. count - 1, count <= 256.
  std::uint32_t below(std::uint32_t count) { return raw<std::uint8_t>() % count; }

  // True for one byte in 16.
  bool rarely() { return raw<std::uint8_t>() >= 240; }

  // -2 to 2 in steps of 1/64 for most bytes; else a value at some limit, or any float.
  float number() {
    constexpr float kLimits[] = {-0.0f,
                                 1e-40f,
                                 1e-30f,
                                 1e5f,
                                 1e9f,
                                 1e18f,
                                 -1e18f,
                                 std::numeric_limits<float>::max(),
                                 1.1e18f,
                                 std::numeric_limits<float>::infinity(),
                                 std::numeric_limits<float>::quiet_NaN()};
    const auto byte = raw<std::uint8_t>();
    if (byte < 244) return (static_cast<float>(byte) - 122) / 64;
    return byte < 255 ? kLimits[byte - 244] : raw<float>();
  }

  std::string rest() {
    const std::string text(reinterpret_cast<const char*>(data_ + at_), size_ - at_);
    at_ = size_;
    return text;
  }

  // x y z w, not of unit length; identity for four zeros.
  void turn(double (&q)[4]) {
    for (double& component : q) component = static_cast<double>(raw<std::int8_t>()) / 64;
    if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0) q[3] = 1;
  }

  Box box() {
    Box out = {};
    double q[4], column[3][3];
    turn(q);
    oracle::quaternion_matrix(q, column);
    for (int k = 0; k < 3; ++k) {
      out.center[k] = number();
      out.half[k] = std::fabs(number()) / 4;
      for (int c = 0; c < 3; ++c) out.axis[k][c] = static_cast<float>(column[k][c]);
    }
    return out;
  }

  // 1 to most_links links under any earlier link, with 0 to 3 leaves each and joints where the bytes say so.
  oracle::Rig rig(std::uint32_t most_links) {
    oracle::Rig out;
    const std::uint32_t links = 1 + below(most_links);
    const bool joints = below(2) == 1;
    for (std::uint32_t link = 0; link < links; ++link) {
      out.parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(below(std::min(link, 256u))));
      for (int c = 0; joints && c < 3; ++c) out.joints.push_back(number());
      for (std::uint32_t leaf = below(4); leaf > 0; --leaf) out.leaves.push_back({link, box(), {}});
    }
    if (out.leaves.empty()) out.leaves.push_back({0, box(), {}});
    for (std::uint32_t pair = below(4); pair > 0; --pair) out.ignored.push_back({below(links), below(links)});
    return out;
  }

  // Poses of n instances in any format, origins and orientations where the bytes say so.
  oracle::Poses poses(std::uint32_t link_count, std::uint32_t instance_count) {
    oracle::Poses out;
    out.format = static_cast<PoseFormat>(below(3));
    out.link_count = link_count;
    out.instance_count = instance_count;
    out.data.resize(std::size_t{instance_count} * link_count * out.floats_per_pose());
    const bool origins = below(2) == 1, orientations = below(2) == 1;
    const double far = static_cast<double>(number());
    for (std::uint32_t i = 0; i < instance_count; ++i) {
      for (std::uint32_t link = 0; link < link_count; ++link) {
        double q[4], at[3];
        turn(q);
        for (double& c : at) c = static_cast<double>(number());
        oracle::write_pose(out.format, q, {{at[0], at[1], at[2]}}, out.pose(i, link));
        if (rarely()) out.pose(i, link)[below(static_cast<std::uint32_t>(out.floats_per_pose()))] = raw<float>();
      }
      for (int c = 0; origins && c < 3; ++c) out.origins.push_back(far + static_cast<double>(number()));
      for (int c = 0; orientations && c < 4; ++c) out.orientations.push_back(c == 3 ? 1.0f : number());
    }
    return out;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

}  // namespace cab::fuzz
