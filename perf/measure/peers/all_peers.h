// The libraries that `cab peers` knows, and which of them this build has.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "perf/base/output_file.h"
#include "perf/measure/peers/peer.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// The peers of these names, or all. Throws UsageError for a name that is none, is given twice, or is not built in.
std::vector<Peer> choose_peers(const std::vector<std::string>& names);

// The poses of a crowd in the frames 0 .. kFrameCount - 1.
std::vector<std::vector<scenes::PosedGroup>> pose_frames(const scenes::Crowd& crowd);

// Prints which libraries there are, which are not in this build, and the threads.
void print_libraries(const std::vector<Peer>& peers);

// What `cab peers` found, over all its runs.
struct PeerResults {
  nlohmann::ordered_json verification = nlohmann::ordered_json::array(), best = nlohmann::ordered_json::array();
  std::vector<nlohmann::ordered_json> rows;  // of the set-ups in the runs; the CSV file has one line each
  bool right = true;                         // cab has no miss and no false positive
};

// Writes them as JSON and CSV, if those files are asked for, and says if cab is wrong in its `answers`. Returns the
// exit code.
int write_results(const PeerResults& results, const std::vector<Peer>& peers, const char* answers, OutputFile& json,
                  OutputFile& csv);

}  // namespace cab::perf
