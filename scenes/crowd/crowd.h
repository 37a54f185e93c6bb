// Crowds: many characters at once in one world. z is up, lengths are metres. A crowd makes the poses of a frame on
// demand, so that a million characters need memory only for the frames that the caller keeps.
#pragma once

#include "scenes/crowd/detailed.h"
#include "scenes/crowd/level.h"
#include "scenes/crowd/ropes.h"
#include "scenes/import/import.h"
#include "scenes/import/trajectories.h"
#include "scenes/scene.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace cab::scenes {

// Which characters of a group are posed: those of a list, in its order, or all of them.
class Chosen {
 public:
  static Chosen all(std::uint32_t count) { return Chosen(count, {}); }
  // The list is borrowed.
  static Chosen of(Span<const std::uint32_t> list) { return Chosen(static_cast<std::uint32_t>(list.size), list); }

  std::uint32_t count() const { return count_; }
  // The number in the group of the i-th of them.
  std::uint32_t operator[](std::uint32_t i) const { return list_.empty() ? i : list_[i]; }

 private:
  Chosen(std::uint32_t count, Span<const std::uint32_t> list) : count_(count), list_(list) {}
  std::uint32_t count_;
  Span<const std::uint32_t> list_;
};

// Characters of a group at one moment, as BatchInput takes them.
struct PosedGroup {
  std::vector<float> poses;         // [character][link][7], kQuaternionTranslation
  std::vector<double> origins;      // [character][3]
  std::vector<float> orientations;  // [character][4], or empty: all identity
  std::vector<std::uint8_t> moved;  // [character]: 0 if it is the same at any time; or empty: all move
};

// Characters of one articulation. Their order has no relation to their places.
struct CrowdGroup {
  Character figure;  // links and leaves, without poses
  std::uint32_t count = 0;
  // Writes the poses of some of the group at a time in seconds, 0 or more. What is written of a character depends
  // neither on other calls nor on who else is chosen. `posed` may hold an earlier result.
  std::function<void(double seconds, const Chosen& chosen, PosedGroup& posed)> pose;
};

struct Crowd {
  std::vector<CrowdGroup> groups;
  Level level;  // what all characters are tested against; empty in most scenes
  std::uint32_t count() const;
};

// What the leaves of `skins` are: boxes that grow with the poses of links, or boxes on one link.
enum class SkinLeafKind : std::uint8_t { kGrown, kRigid };
inline constexpr std::array<const char*, 2> kSkinLeafKindNames = {"grown", "rigid"};  // in the order of SkinLeafKind

// The input from which crowd scenes are made.
struct CrowdSources {
  std::vector<Clip> clips;
  Trajectories trajectories;
  char up = 0;  // the clips' up axis: 'x', 'y', 'z', or 0 for the axis along which each figure is tallest
  std::uint32_t boxes_per_link = kDefaultBoxesPerLink;  // of `detailed`
  RopeOptions ropes;
  std::uint32_t rig_links = 100;                    // of each body of `rigs`: 16 to kMaxLinks
  LevelKind level = LevelKind::kBoxes;              // of `level`
  double area = 1;                                  // of `uniform` and `rigs`: square metres per character
  SkinLeafKind skin_leaves = SkinLeafKind::kGrown;  // of `skins`
};

// The functions that make the crowd scenes; scene_list.cpp says what each scene is. count is at least 1, and the
// sources hold the clips and trajectories that the scene needs. make_detailed, make_ropes and make_rigs throw
// std::invalid_argument for an option out of range.
Crowd make_uniform(std::uint32_t count, CrowdSources sources);
Crowd make_jitter(std::uint32_t count, CrowdSources sources);
Crowd make_bottleneck(std::uint32_t count, CrowdSources sources);
Crowd make_battle(std::uint32_t count, CrowdSources sources);
Crowd make_spot(std::uint32_t count, CrowdSources sources);
Crowd make_line(std::uint32_t count, CrowdSources sources);
Crowd make_giant(std::uint32_t count, CrowdSources sources);
Crowd make_skins(std::uint32_t count, CrowdSources sources);
Crowd make_detailed(std::uint32_t count, CrowdSources sources);
Crowd make_ropes(std::uint32_t count, CrowdSources sources);
Crowd make_rigs(std::uint32_t count, CrowdSources sources);
Crowd make_mixed(std::uint32_t count, CrowdSources sources);
Crowd make_churn(std::uint32_t count, CrowdSources sources);
Crowd make_city(std::uint32_t count, CrowdSources sources);
Crowd make_level(std::uint32_t count, CrowdSources sources);
Crowd make_far(std::uint32_t count, CrowdSources sources);

// Poses the whole crowd at one time. posed[g] belongs to group g.
void pose_crowd(const Crowd& crowd, double seconds, std::vector<PosedGroup>& posed);

// FNV-1a hash of the bits of every pose, origin and orientation.
std::uint64_t pose_hash(const std::vector<PosedGroup>& posed);

}  // namespace cab::scenes
