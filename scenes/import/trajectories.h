// Recorded pedestrians from files: where and when each person walked on the ground.
#pragma once

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
};

// The place and the heading of a person.
struct Standing {
  double x, y;
  double heading;
};

// Between two samples the place lies on the straight line between them, and the heading is that of the earlier one.
// Before the first and after the last sample both are those of that sample.
Standing stand_on(const Track& track, double seconds);

// Reads the text files of Forschungszentrum Juelich's pedestrian experiments. A line has the number of a person, a
// frame, and x and y in metres; further columns are not read. Lines that begin with # are comments, and one comment
// must be `# framerate: N fps`. Lines may come in any order. A heading is the direction of the way in the second about
// a sample; a person who walks less than 0.1 m in it keeps the previous heading. People with fewer than two samples are
// left out. Throws ImportError.
Trajectories import_trajectories(const std::string& path);

}  // namespace cab::scenes
