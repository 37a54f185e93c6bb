// Recorded pedestrians from files: where each walked on the ground, and when.
#pragma once

#include <string>
#include <vector>

namespace cab::scenes {

// One person's way: at seconds[s] at places[2 s], places[2 s + 1] (metres), going towards headings[s] (rad from +x). At
// least two samples, in the order of time.
struct Track {
  std::vector<double> seconds;
  std::vector<double> places;
  std::vector<double> headings;
};

struct Trajectories {
  std::vector<Track> tracks;
};

// Where a person stands, and which way the person goes.
struct Standing {
  double x, y;
  double heading;
};

// Between samples the place is that on the straight line, the heading that of the earlier one; before the first and
// after the last sample it is theirs.
Standing stand_on(const Track& track, double seconds);

// Reads the text files of Forschungszentrum Juelich's pedestrian experiments: a person's number, frame, x and y in
// metres a line, more columns are not read; lines that begin with # are comments, one of which must be
// `# framerate: N fps`. Lines may come in any order. A heading is that of a second's way; whoever goes less than 0.1 m
// in it keeps the heading of before. People with less than two samples are left out. Throws ImportError.
Trajectories import_trajectories(const std::string& path);

}  // namespace cab::scenes
