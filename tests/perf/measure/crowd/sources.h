// Files that crowds are made of.
#pragma once

#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"

#include <string>

namespace cab::tests {

// Two clips and ten people who walk side by side.
struct Sources {
  TemporaryFolder folder;
  std::string anna = folder / "anna.bvh", bert = folder / "bert.bvh", ways = folder / "ways.txt";
  Sources() {
    write_text(anna, bvh_text({40, 0, 0, .03}));
    write_text(bert, bvh_text({30, 7, 0, .03}));
    std::string text = "# framerate: 25 fps\n";
    for (int person = 0; person < 10; ++person)
      for (int frame = 0; frame < 100; ++frame)
        text += std::to_string(person) + ' ' + std::to_string(frame) + ' ' + std::to_string(.04 * frame) + ' ' +
                std::to_string(.6 * person) + " 1.7\n";
    write_text(ways, text);
  }
};

}  // namespace cab::tests
