// How many rounds random tests run. CAB_TEST_ROUNDS=K runs K times as many as usual. CAB_TEST_ROUNDS=1/K runs one in K,
// for sanitizers and emulators, where each round is slow.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace cab::tests {

// The number above 0 in an environment variable, after `prefix`. `otherwise` if it is not set or
// empty. Throws for any other text.
inline std::uint64_t number_from_environment(const char* name, std::uint64_t otherwise,
                                             const std::string& prefix = "") {
  const char* const text = std::getenv(name);
  if (!text || !*text) return otherwise;
  char* end = nullptr;
  const bool begins = std::string(text).rfind(prefix, 0) == 0;
  const std::uint64_t number = begins ? std::strtoull(text + prefix.size(), &end, 10) : 0;
  if (number == 0 || *end != 0) throw std::runtime_error(std::string(name) + " is no number above 0: " + text);
  return number;
}

// The number of rounds to run, at least one, for a test that runs `usual` rounds without CAB_TEST_ROUNDS.
inline std::uint64_t rounds(std::uint64_t usual) {
  const char* const text = std::getenv("CAB_TEST_ROUNDS");
  if (text && std::string(text).rfind("1/", 0) == 0)
    return std::max<std::uint64_t>(1, usual / number_from_environment("CAB_TEST_ROUNDS", 1, "1/"));
  return usual * number_from_environment("CAB_TEST_ROUNDS", 1);
}

// Whether one in several rounds is to run. Long tests without rounds then leave something out, and say so.
inline bool runs_fewer_rounds() { return rounds(2) < 2; }

// Whether more rounds than usual are to run. Tests that take minutes then run in full, and else say what they leave
// out.
inline bool runs_more_rounds() { return rounds(1) > 1; }

// What a test that counts at least `least` of something in its `usual` rounds must count in rounds(usual): more in more
// rounds, and in fewer, of which one may have none, anything.
inline std::uint64_t least_count(std::uint64_t least, std::uint64_t usual) { return rounds(usual) / usual * least; }

}  // namespace cab::tests
