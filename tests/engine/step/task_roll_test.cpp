// The roll of tasks: each begins once, on a worker that has no other.
#include "engine/step/task_roll.h"

#include <doctest/doctest.h>

#include <atomic>
#include <memory>
#include <thread>

namespace cab::tests {

TEST_CASE("a task begins once, of those that there are, on a worker that there is and that has no other") {
  const auto made = std::make_unique<TaskRoll>(3);
  TaskRoll& roll = *made;
  CHECK(!roll.begin(0, 0));  // not open
  roll.open(70);
  CHECK(!roll.has_refused());
  CHECK(!roll.begin(70, 0));
  CHECK(!roll.begin(~0u, 0));
  CHECK(!roll.begin(5, 3));
  CHECK(roll.has_refused());
  CHECK(roll.begin(69, 0));
  CHECK(!roll.begin(3, 0));  // the worker is busy
  CHECK(!roll.begin(69, 1));
  CHECK(roll.begin(3, 1));
  roll.end(0);
  CHECK(!roll.begin(69, 0));
  CHECK(roll.begin(4, 0));
  roll.end(0);
  roll.end(1);
  CHECK(!roll.close());
  CHECK(!roll.begin(6, 0));
  for (const std::uint32_t count : {1u, 31u, 32u, 33u, TaskRoll::kMostTasks}) {
    roll.open(count);
    for (std::uint32_t task = count; task-- > 0;) {
      if (!roll.begin(task, task % 3)) FAIL("task " << task << " of " << count << " is refused");
      roll.end(task % 3);
    }
    CHECK(!roll.has_refused());
    CHECK(roll.close());
  }
  roll.open(0);
  CHECK(roll.close());
}

TEST_CASE("a roll that is closed has waited for the tasks that had begun, and lets no other begin") {
  const auto roll = std::make_unique<TaskRoll>(2);
  for (int round = 0; round < 200; ++round) {
    roll->open(2);
    std::atomic<int> ended{0}, begun{0};
    REQUIRE(roll->begin(0, 0));
    std::thread late([&] {
      if (roll->begin(1, 1)) {
        ++begun;
        ++ended;
        roll->end(1);
      }
    });
    std::thread slow([&] {
      std::this_thread::yield();
      ++ended;
      roll->end(0);
    });
    const bool complete = roll->close();
    CHECK(ended == (complete ? 2 : 1));
    const int before = begun;
    late.join();
    slow.join();
    CHECK(begun == before);
  }
}

}  // namespace cab::tests
