#include <cab/cab.h>
#include <cab/files.h>

#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scenes/import/companions.h"
#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/robot/adjacency.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/matrix.h"
#include "scenes/robot/robot.h"

namespace cab::files {
namespace {

// Strings as pointers, for spans.
std::vector<const char*> pointers_to(const std::vector<std::string>& strings) {
  std::vector<const char*> pointers;
  for (const std::string& string : strings) pointers.push_back(string.c_str());
  return pointers;
}

constexpr const char* kNoMemory = "an allocation failed";

// A new storage with the words of a failure and nothing else, or null if there is no memory for it.
template <class Storage>
Storage* failed(const std::exception& failure) noexcept {
  Storage* const storage = new (std::nothrow) Storage;
  if (!storage) return nullptr;
  try {
    storage->error = failure.what();
    storage->is_machine = dynamic_cast<const scenes::MachineError*>(&failure) != nullptr;
    return storage;
  } catch (const std::bad_alloc&) {
    delete storage;
    return nullptr;
  }
}

}  // namespace

struct CompanionsStorage {
  std::string error;
  bool is_machine = false;
  std::vector<std::string> files;
  std::vector<const char*> paths;
};

struct MotionStorage {
  std::string error;
  bool is_machine = false;
  scenes::Clip clip;
  std::optional<scenes::ArticulationStorage> articulation;
  std::vector<const char*> names;
  std::vector<const char*> notes;
};

struct RobotStorage {
  std::string error;
  bool is_machine = false;
  scenes::Robot robot;
  std::optional<scenes::ArticulationStorage> articulation;
  std::optional<scenes::Kinematics> kinematics;
  bool has_srdf = false;
  std::vector<DisabledPair> disabled;
  std::vector<const char*> names;
  std::vector<const char*> notes;
  std::vector<RobotVariable> variables;
  std::vector<LinkPair> adjacent;
};

std::size_t max_file_bytes() noexcept { return scenes::kMaxFileBytes; }

// ------------------------------------------------------------------------------------------------------- companions

Companions::~Companions() { delete storage_; }

bool Companions::load(const char* path) noexcept {
  delete storage_;
  storage_ = new (std::nothrow) CompanionsStorage;
  if (!storage_) return false;
  try {
    storage_->files = scenes::companion_files(path, scenes::kImportSandbox);
    storage_->paths = pointers_to(storage_->files);
    return true;
  } catch (const std::bad_alloc&) { delete std::exchange(storage_, nullptr); } catch (const std::exception& failure) {
    delete std::exchange(storage_, failed<CompanionsStorage>(failure));
  }
  return false;
}

const char* Companions::error() const noexcept { return storage_ ? storage_->error.c_str() : kNoMemory; }

bool Companions::is_machine() const noexcept { return !storage_ || storage_->is_machine; }

Span<const char* const> Companions::paths() const noexcept {
  if (!storage_) return {};
  return storage_->paths;
}

// ---------------------------------------------------------------------------------------------------------- motion

Motion::~Motion() { delete storage_; }

bool Motion::load(const char* path, const MotionOptions& options) noexcept {
  delete storage_;
  storage_ = new (std::nothrow) MotionStorage;
  if (!storage_) return false;
  try {
    scenes::ImportOptions import;
    if (options.metres_per_unit != 0) import.metres_per_unit = options.metres_per_unit;
    import.guesses_unit = options.guess_unit;
    import.sandbox = scenes::kImportSandbox;
    if (options.motion_path) import.motion = scenes::MotionFile{options.motion_path, options.motion_metres_per_unit};
    if (options.animation) import.animation = options.animation;
    import.frames_per_second = options.frames_per_second;
    if (options.body != MotionBody::kSkeleton) import.skin.emplace().surface = options.body == MotionBody::kSurface;
    import.bodies = {options.stature, options.thickness};
    storage_->clip = scenes::import_clip(path, import);
    storage_->articulation.emplace(storage_->clip.character);
    storage_->names = pointers_to(storage_->clip.character.link_names);
    storage_->notes = pointers_to(storage_->clip.notes);
    return true;
  } catch (const std::bad_alloc&) { delete std::exchange(storage_, nullptr); } catch (const std::exception& failure) {
    delete std::exchange(storage_, failed<MotionStorage>(failure));
  }
  return false;
}

const char* Motion::error() const noexcept { return storage_ ? storage_->error.c_str() : kNoMemory; }

bool Motion::is_machine() const noexcept { return !storage_ || storage_->is_machine; }

ArticulationDesc Motion::desc() const noexcept {
  return storage_ && storage_->articulation ? storage_->articulation->desc() : ArticulationDesc{};
}

Span<const char* const> Motion::link_names() const noexcept {
  if (!storage_) return {};
  return storage_->names;
}

Span<const float> Motion::poses() const noexcept {
  if (!storage_) return {};
  return storage_->clip.character.poses;
}

Span<const double> Motion::origins() const noexcept {
  if (!storage_) return {};
  return storage_->clip.character.origins;
}

std::uint32_t Motion::frame_count() const noexcept { return storage_ ? storage_->clip.frame_count : 0; }

double Motion::frame_seconds() const noexcept {
  return storage_ && !storage_->clip.character.is_static ? storage_->clip.frame_seconds : 0;
}

Span<const char* const> Motion::notes() const noexcept {
  if (!storage_) return {};
  return storage_->notes;
}

// ----------------------------------------------------------------------------------------------------------- robot

const char* to_string(DisabledReason reason) noexcept {
  switch (reason) {
    case DisabledReason::kFile: return "file";
    case DisabledReason::kWelded: return "welded";
    case DisabledReason::kAdjacent: return "adjacent";
    case DisabledReason::kDefault: return "default";
    case DisabledReason::kAlways: return "always";
    case DisabledReason::kNever: return "never";
  }
  return "unknown";
}

Robot::~Robot() { delete storage_; }

bool Robot::load(const char* path, const RobotOptions& options) noexcept {
  delete storage_;
  storage_ = new (std::nothrow) RobotStorage;
  if (!storage_) return false;
  try {
    scenes::RobotOptions import;
    import.sandbox = scenes::kImportSandbox;
    for (std::size_t p = 0; p < options.package_names.size && p < options.package_folders.size; ++p)
      import.packages.emplace_back(options.package_names[p], options.package_folders[p]);
    if (options.leave_out_missing_meshes) import.missing_mesh = scenes::MissingMesh::kLeaveOut;
    import.surface = options.surface;
    if (options.leaves_per_link < 1 || options.leaves_per_link > (options.surface ? 1 : 64))
      throw scenes::ImportError(options.surface ? "leaves_per_link cuts hulls, and surface has none"
                                                : "leaves_per_link must be from 1 to 64");
    import.leaves_per_link = options.leaves_per_link;
    RobotStorage& storage = *storage_;
    storage.robot = scenes::import_robot(path, import);
    if (options.srdf_path) {
      const scenes::DisabledPairs disabled =
          scenes::read_disabled_pairs(options.srdf_path, storage.robot, import.sandbox);
      std::vector<LinkPair>& ignored = storage.robot.body.ignored_pairs;
      ignored.insert(ignored.end(), disabled.pairs.begin(), disabled.pairs.end());
      storage.has_srdf = true;
      storage.robot.notes.insert(storage.robot.notes.end(), disabled.notes.begin(), disabled.notes.end());
    }
    storage.articulation.emplace(storage.robot.body);
    storage.names = pointers_to(storage.robot.body.link_names);
    storage.notes = pointers_to(storage.robot.notes);
    storage.kinematics.emplace(storage.robot);
    for (const scenes::RobotVariable& variable : storage.robot.variables)
      storage.variables.push_back({variable.name.c_str(), variable.lower, variable.upper, variable.rest});
    storage.adjacent = scenes::adjacent_pairs(storage.robot);
    if (const std::optional<scenes::MujocoPairs>& mujoco = storage.robot.mujoco) {
      storage.adjacent = mujoco->adjacent;
      storage.adjacent.insert(storage.adjacent.end(), mujoco->welded.begin(), mujoco->welded.end());
    }
    return true;
  } catch (const std::bad_alloc&) { delete std::exchange(storage_, nullptr); } catch (const std::exception& failure) {
    delete std::exchange(storage_, failed<RobotStorage>(failure));
  }
  return false;
}

const char* Robot::error() const noexcept { return storage_ ? storage_->error.c_str() : kNoMemory; }

bool Robot::is_machine() const noexcept { return !storage_ || storage_->is_machine; }

ArticulationDesc Robot::desc() const noexcept {
  return storage_ && storage_->articulation ? storage_->articulation->desc() : ArticulationDesc{};
}

Span<const char* const> Robot::link_names() const noexcept {
  if (!storage_) return {};
  return storage_->names;
}

Span<const RobotVariable> Robot::variables() const noexcept {
  if (!storage_) return {};
  return storage_->variables;
}

Span<const char* const> Robot::notes() const noexcept {
  if (!storage_) return {};
  return storage_->notes;
}

Span<const LinkPair> Robot::adjacent_pairs() const noexcept {
  if (!storage_) return {};
  return storage_->adjacent;
}

Span<const LinkPair> Robot::welded_pairs() const noexcept {
  if (!storage_ || !storage_->robot.mujoco) return {};
  return storage_->robot.mujoco->welded;
}

Span<const LinkPair> Robot::listed_pairs() const noexcept {
  if (!storage_ || !storage_->robot.mujoco) return {};
  return storage_->robot.mujoco->listed;
}

bool Robot::find_disabled_pairs(std::uint32_t samples, std::uint64_t seed, std::uint32_t thread_count,
                                float margin) noexcept {
  if (!storage_ || !storage_->kinematics) return false;
  try {
    if (!(margin >= 0 && margin <= kMaxCoordinate))
      throw std::invalid_argument("margin: a length from 0 to 1e18 is needed");
    scenes::MatrixOptions options;
    options.excluded = storage_->robot.body.ignored_pairs;
    options.derive = !storage_->has_srdf;
    options.samples = options.derive ? samples : 0;
    options.seed = seed;
    options.margin = margin;
    scenes::RobotSessionOptions session;
    session.thread_count = thread_count;
    session.policies.exact = scenes::exact_test_of(storage_->robot);
    storage_->disabled = scenes::make_matrix(storage_->robot, options, session).masked;
    return true;
  } catch (const std::exception& failure) {
    try {
      storage_->error = failure.what();
    } catch (const std::bad_alloc&) { storage_->error.clear(); }
  }
  return false;
}

Span<const DisabledPair> Robot::disabled_pairs() const noexcept {
  if (!storage_) return {};
  return storage_->disabled;
}

KinematicsDesc Robot::kinematics() const noexcept {
  return storage_ && storage_->kinematics ? storage_->kinematics->desc() : KinematicsDesc{};
}

bool Robot::write_poses(Span<const double> states, Span<float> poses) const noexcept {
  return compute_link_poses(kinematics(), states, Isa::kAuto, poses) == Status::kOk;
}

void Robot::write_random_states(std::uint64_t seed, std::uint64_t first, Span<double> states) const noexcept {
  const std::size_t variable_count = variables().size;
  if (variable_count == 0) return;
  for (std::size_t s = 0; (s + 1) * variable_count <= states.size; ++s)
    scenes::random_state(storage_->robot, seed, first + s, states.data + s * variable_count);
}

}  // namespace cab::files
