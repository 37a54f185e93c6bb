// Characters and robots from files, as descriptions for add_articulation with poses: BVH, AMC, glTF, FBX and what
// else assimp reads, URDF and MJCF. For the time of loading. The conventions are those of cab/types.h, with lengths in
// metres.
//
// Files are read in a child process with limits on memory, time and rights, as docs/import.md says: a damaged file is
// an error in words, whatever it does to the parser. The child is a fork of this process, so no other thread may hold a
// lock of a library that reads files. No call throws.
#pragma once

#include <cab/kinematics.h>
#include <cab/types.h>

#include <cstddef>
#include <cstdint>

namespace cab::files {

// What the bodies of a character are made of.
enum class MotionBody : std::uint8_t {
  kSkeleton,  // ellipsoids about the file's bones
  kSkin,      // hulls about its meshes
  kSurface,   // the triangles of these meshes, in leaves that follow them (rig::surface_from_skin)
};

// How a motion file becomes a character. Strings are borrowed for the call, and may be null where that is said.
struct MotionOptions {
  // The length of one unit of the file, in metres. 0 (default): as the file says, or 1.
  double metres_per_unit = 0;

  // With metres_per_unit 0: whether a figure that is 0.5 to 3 m tall in no sense of its file gets the unit that makes a
  // person of it. Notes say which.
  bool guess_unit = false;

  // Another file that has the motion, whose nodes are matched by name, and its unit. Null (default): the file has it.
  const char* motion_path = nullptr;
  double motion_metres_per_unit = 0;  // 0: as it says, or as metres_per_unit

  // Name of the animation, or its number from 0 on. Null (default): the first.
  const char* animation = nullptr;

  // Of files that do not say it (AMC). 0 (default): 120.
  double frames_per_second = 0;

  // What bodies are made of. Default: ellipsoids about bones.
  MotionBody body = MotionBody::kSkeleton;

  // The person's height in metres, for thickness, and a factor of it. 0 (default): by the figure's own bones.
  double stature = 0;
  double thickness = 1;
};

// How a file becomes a robot. Strings are borrowed for the call.
struct RobotOptions {
  // Names and folders of packages, for package:// paths: equally many. Others are looked for as docs/robots.md says.
  Span<const char* const> package_names;
  Span<const char* const> package_folders;

  // An SRDF file, whose disabled pairs of links are ignored pairs (docs/robots.md). Null (default): none.
  const char* srdf_path = nullptr;

  // Whether a shape is left out whose mesh file is not there. Default: the robot is refused.
  bool leave_out_missing_meshes = false;

  // Whether meshes become leaves of their triangles, which Exact::kSurface tests. Default: convex hulls.
  bool surface = false;

  // The most convex hulls that a mesh becomes, 1 (default) to 64: it is cut where that saves volume, and each of its
  // triangles is wholly in one of them (docs/robots.md). With `surface` it must be 1.
  std::uint32_t leaves_per_link = 1;
};

// A number of a joint state: radians or metres. The name lives as long as the robot.
struct RobotVariable {
  const char* name = nullptr;
  double lower = 0;  // its limits
  double upper = 0;
  double rest = 0;  // its value at rest
};

// Why a pair of links needs no test. Of several reasons the first holds.
enum class DisabledReason : std::uint8_t {
  kFile,      // the SRDF file or the MJCF file excludes the pair
  kWelded,    // no joint moves the links against each other, by MuJoCo's rules
  kAdjacent,  // a joint connects the links: as docs/robots.md says, or for MJCF by MuJoCo's rules
  kDefault,   // they touch at rest and in at least 95 % of the sampled states
  kAlways,    // they touch in at least 95 % of the sampled states, not at rest
  kNever,     // they touch in none of the sampled states
};

// The name of a reason in tables and files: "file", "welded" and so on.
const char* to_string(DisabledReason reason) noexcept;

// A pair of links that needs no test.
struct DisabledPair {
  LinkPair links;  // a < b
  DisabledReason reason = DisabledReason::kFile;
  std::uint32_t touching_samples = 0;  // of kDefault, kAlways and kNever: in how many sampled states they touch
};

// The size in bytes of the largest file that is read.
std::size_t max_file_bytes() noexcept;

struct CompanionsStorage;
struct MotionStorage;
struct RobotStorage;

// The files that a motion file is read with: the skeleton of an AMC file, the buffers that a glTF file names, the other
// half of an MD5 file. It can be neither moved nor copied.
class Companions {
 public:
  Companions() noexcept = default;
  Companions(const Companions&) = delete;
  Companions& operator=(const Companions&) = delete;
  ~Companions();

  // Lists them, as Motion::load would read them, without reading the motion. Some of them may not be there.
  // error() and is_machine() are as those of Motion.
  [[nodiscard]] bool load(const char* path) noexcept;
  const char* error() const noexcept;
  bool is_machine() const noexcept;

  // Their paths; they live until the next load.
  Span<const char* const> paths() const noexcept;

 private:
  CompanionsStorage* storage_ = nullptr;
};

// A character with its motion. It can be neither moved nor copied.
class Motion {
 public:
  Motion() noexcept = default;
  Motion(const Motion&) = delete;
  Motion& operator=(const Motion&) = delete;
  ~Motion();

  // Reads a file, and replaces what was read before. Returns whether it could; if not, error() says why: one line
  // with the file, the line or element, and the reason. The object is empty then.
  [[nodiscard]] bool load(const char* path, const MotionOptions& options) noexcept;
  const char* error() const noexcept;

  // Whether what error() tells is a trouble of the machine, such as a lack of memory or a process that was killed, and
  // not of the file: another try may succeed.
  bool is_machine() const noexcept;

  ArticulationDesc desc() const noexcept;               // for add_articulation; it points into this object
  Span<const char* const> link_names() const noexcept;  // one per link
  Span<const float> poses() const noexcept;             // [frame][link][7], kQuaternionTranslation
  Span<const double> origins() const noexcept;          // [frame][3]
  std::uint32_t frame_count() const noexcept;           // 1 for a file without motion
  double frame_seconds() const noexcept;                // 0 for a file without motion
  Span<const char* const> notes() const noexcept;       // what was merged, dropped or doubted

 private:
  MotionStorage* storage_ = nullptr;
};

// A robot: its links, and the joints that pose them. It can be neither moved nor copied.
class Robot {
 public:
  Robot() noexcept = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  ~Robot();

  // These three are as those of Motion.
  [[nodiscard]] bool load(const char* path, const RobotOptions& options) noexcept;
  const char* error() const noexcept;
  bool is_machine() const noexcept;

  ArticulationDesc desc() const noexcept;
  Span<const char* const> link_names() const noexcept;
  Span<const RobotVariable> variables() const noexcept;  // of a joint state, in its order
  Span<const char* const> notes() const noexcept;
  Span<const LinkPair> adjacent_pairs() const noexcept;  // links with shapes; adjacent or welded as docs/robots.md says
  Span<const LinkPair> welded_pairs() const noexcept;    // those of them that MJCF makes one rigid body
  Span<const LinkPair> listed_pairs() const noexcept;    // of each <pair> of MJCF: tested whatever else holds

  // Finds the pairs of links that need no test, as `cab robot` does (docs/robots.md): those that files exclude and, if
  // there is no SRDF file, adjacent links, those that touch in nearly all of `samples` random states within the limits
  // of the joints, and those that come within `margin` metres of each other in none, nor at rest (kNever); 0 samples:
  // none are left out for that. States may be tested with up to that margin; for distances, and states beyond the
  // limits, test the pairs of kNever too. Returns whether it could; if not, error() says why, and the robot stays.
  // Cost: some microseconds per sample, twice with a margin. thread_count: as in EngineDesc.
  [[nodiscard]] bool find_disabled_pairs(std::uint32_t samples, std::uint64_t seed, std::uint32_t thread_count,
                                         float margin = 0) noexcept;

  // Those of the last find_disabled_pairs, sorted by links.
  Span<const DisabledPair> disabled_pairs() const noexcept;

  // The joints, for compute_link_poses and CollisionChecker; it points into this object.
  KinematicsDesc kinematics() const noexcept;

  // Writes the poses of joint states, as compute_link_poses does: `states` has the value of each variable per state,
  // `poses` receives [state][link][7]. Returns false if the sizes do not fit each other, or an allocation failed.
  [[nodiscard]] bool write_poses(Span<const double> states, Span<float> poses) const noexcept;

  // Writes random states within the limits: those of the numbers `first`, `first` + 1, and so on. A state depends on
  // the seed and its number alone.
  void write_random_states(std::uint64_t seed, std::uint64_t first, Span<double> states) const noexcept;

 private:
  RobotStorage* storage_ = nullptr;
};

}  // namespace cab::files
