#include "perf/measure/peers/all_peers.h"

#include <cab/version.h>

#include <algorithm>
#include <iostream>

#include "perf/base/crowd_session.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"

namespace cab::perf {
namespace {

// A library that is not in this build. It has no set-ups.
[[maybe_unused]] Peer missing(const char* name, const char* package) { return {name, package, "", {}}; }

std::vector<Peer> all_peers() {
  std::vector<Peer> peers = {fcl_peer()};
#ifdef CAB_WITH_BULLET
  peers.push_back(bullet_peer());
#else
  peers.push_back(missing("bullet", "libbullet-dev"));
#endif
#ifdef CAB_WITH_EMBREE
  peers.push_back(embree_peer());
#else
  peers.push_back(missing("embree", "libembree-dev"));
#endif
#ifdef CAB_WITH_ODE
  peers.push_back(ode_peer());
#else
  peers.push_back(missing("ode", "libode-dev"));
#endif
  return peers;
}

// The peers that are in this build with their versions, or those that are not with their packages, as one line.
std::string versions(const std::vector<Peer>& peers, bool built) {
  std::string text;
  for (const Peer& peer : peers)
    if (peer.version.empty() != built)
      text += (text.empty() ? "" : ", ") + std::string(peer.name) + ' ' +
              (built ? peer.version : std::string("(") + peer.package + ")");
  return text;
}

}  // namespace

std::vector<Peer> choose_peers(const std::vector<std::string>& names) {
  std::vector<Peer> peers = all_peers(), chosen;
  if (names.empty()) return peers;
  for (const std::string& name : names) {
    const auto peer = std::find_if(peers.begin(), peers.end(), [&](const Peer& p) { return name == p.name; });
    if (peer == peers.end())
      throw UsageError("--peers: '" + name + "' is not a library of peers; choose fcl, bullet, embree, ode");
    if (peer->version.empty())
      throw UsageError("--peers: this build lacks " + name + "; install " + peer->package + " and build again");
    if (std::count(names.begin(), names.end(), name) > 1)
      throw UsageError("--peers: " + name + " is given twice; give each library once");
    chosen.push_back(*peer);
  }
  return chosen;
}

std::vector<std::vector<scenes::PosedGroup>> pose_frames(const scenes::Crowd& crowd) {
  std::vector<std::vector<scenes::PosedGroup>> frames(kFrameCount);
  for (std::uint32_t f = 0; f < kFrameCount; ++f) scenes::pose_crowd(crowd, f / kCrowdFramesPerSecond, frames[f]);
  return frames;
}

void print_libraries(const std::vector<Peer>& peers) {
  std::cout << "libraries: " << versions(peers, true) << '\n';
  if (const std::string missing = versions(peers, false); !missing.empty())
    std::cout << "not in this build, since their packages were not found when it was configured: " << missing << '\n';
  std::cout << "threads 1; ";
}

int write_results(const PeerResults& results, const std::vector<Peer>& peers, const char* answers, OutputFile& json,
                  OutputFile& csv) {
  write_json(json, {{"cab_version", CAB_VERSION_STRING},
                    {"libraries", versions(peers, true)},
                    {"not_in_this_build", versions(peers, false)},
                    {"verification", results.verification},
                    {"best", results.best},
                    {"runs", results.rows}});
  write_csv(csv, results.rows);
  if (!results.right)
    std::cerr << "cab peers: this engine's own " << answers << " differ from the judge's beyond the threshold\n";
  return results.right ? 0 : 1;
}

}  // namespace cab::perf
