// What import did to the files that it read: counts, units and doubts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cab::scenes {

enum class AlterationKind : std::uint8_t { kMerged, kDropped, kResampled, kGuessed };

// How many things of a file were altered in one way.
struct Alteration {
  AlterationKind kind = AlterationKind::kMerged;
  std::string what;  // as "joints"
  std::uint64_t count = 0;
  std::string note;  // the one among the notes that names them; empty: none does
};

// What counts the units that import guessed.
inline constexpr const char* kGuessedUnits = "length units";

// What counts the frames that a scene does not show, since another clip ends before them.
inline constexpr const char* kCutFrames = "frames after the end of the shortest clip";

// Where the length unit of a file is from.
enum class UnitSource : std::uint8_t {
  kDefault,  // nobody says it: metres
  kGiven,
  kFile,     // the file itself
  kGuessed,  // it makes a person of the figure
};
const char* to_string(UnitSource source);

struct LengthUnit {
  double metres = 1;
  UnitSource source = UnitSource::kDefault;
};

// Of all files of a world.
struct ImportReport {
  std::vector<LengthUnit> units;         // [character]
  std::vector<Alteration> alterations;   // their notes are among those of the scene
  std::vector<std::string> size_doubts;  // of figures whose height is no person's, with their names
};

}  // namespace cab::scenes
