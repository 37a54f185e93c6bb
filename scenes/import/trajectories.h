// Recorded pedestrians from files: where and when each person walked on the ground.
#pragma once

#include "scenes/sandbox/sandbox.h"

#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// The path of one person. At seconds[s] the person is at (places[2 s], places[2 s + 1]), metres, and walks towards
// headings[s], rad from +x. There are at least two samples, in the order of time.
struct Track {
  std::vector<double> seconds;
  std::vector<double> places;
  std::vector<double> headings;
};

struct Trajectories {
  std::vector<Track> tracks;
  std::vector<std::string> notes;
};

// The place and the heading of a person.
struct Standing {
  double x, y;
  double heading;
};

// Between two samples the place lies on the straight line between them, and the heading is that of the earlier one.
// Before the first and after the last sample both are those of that sample.
Standing stand_on(const Track& track, double seconds);

// Reads a text file with one person in one frame per line: the number of the person, the frame, and x and y. Numbers
// may be in scientific notation, and blanks, commas or semicolons stand between them. Lines that begin with # are
// comments. A header, which may be a comment, names the columns. Without one they are the person's number, the frame, x
// and y in metres, and more that is not read (JuPedSim, PedPy, Forschungszentrum Juelich); eight columns are the frame,
// the number, x, a height, y and velocities (obsmat of the UCY and ETH recordings). notes says which. A comment such as
// `# framerate: 25 fps` gives the frame rate; otherwise frames_per_second does, which is 0 if it is not known. Lines
// may come in any order. A heading is the direction of the way in the second about a sample; a person who walks less
// than 0.1 m in it keeps the previous heading. People with fewer than two samples are left out. With `sandbox` a child
// process reads the file. Throws ImportError.
Trajectories import_trajectories(const std::string& path, double frames_per_second = 0,
                                 const std::optional<SandboxLimits>& sandbox = {});

}  // namespace cab::scenes
