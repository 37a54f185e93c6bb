// Guesses the length unit of a file by the height of its figure.
#include "scenes/import/unit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace cab::scenes {
namespace {

constexpr double kLeastHeight = .5, kGreatestHeight = 3;  // metres, of any pose of a person
// Metres, between the joints of a standing person, which end below the top of the head.
constexpr double kLeastStanding = 1.3, kGreatestStanding = 2.1;
constexpr double kUsualHeight = 1.7;  // metres

struct NamedUnit {
  double metres;
  const char* name;
};
// At most one of them puts a height into the range of standing persons, since each is 1.7 times the next at least.
constexpr NamedUnit kUnits[] = {
    {1, "metres"},     {.3048, "feet"},      {.1, "decimetres"},   {.0564, "inches / 0.45, as CMU's"},
    {.0254, "inches"}, {.01, "centimetres"}, {.001, "millimetres"}};

}  // namespace

std::string digits(double value, int count) {
  std::array<char, 32> text = {};
  std::snprintf(text.data(), text.size(), "%.*g", count, value);
  return text.data();
}

const char* to_string(UnitSource source) {
  switch (source) {
    case UnitSource::kGiven: return "given";
    case UnitSource::kFile: return "file";
    case UnitSource::kGuessed: return "guessed";
    case UnitSource::kDefault: break;
  }
  return "default";
}

void set_unit(const ImportOptions& options, Skeleton& skeleton, double stated) {
  skeleton.unit.metres = options.metres_per_unit ? *options.metres_per_unit : stated > 0 ? stated : 1;
  skeleton.unit.source = options.metres_per_unit ? UnitSource::kGiven
                         : stated > 0            ? UnitSource::kFile
                                                 : UnitSource::kDefault;
}

bool is_plausible_height(double metres) { return metres >= kLeastHeight && metres <= kGreatestHeight; }

UnitGuess guess_unit(double units_tall) {
  if (!(units_tall > 0) || !std::isfinite(units_tall)) return {};
  for (const NamedUnit& unit : kUnits) {
    const double height = unit.metres * units_tall;
    if (height >= kLeastStanding && height <= kGreatestStanding) return {unit.metres, unit.name, height};
  }
  const double rounded = std::strtod(digits(kUsualHeight / units_tall, 2).c_str(), nullptr);
  return {rounded, "", rounded * units_tall};
}

double height_of(const SkeletonBodies& bodies, char up) {
  if (bodies.stature.source == StatureSource::kHand) return bodies.stature.value;
  const std::array<double, 3>& extents = bodies.segments.extents;
  return up == 0 ? *std::max_element(extents.begin(), extents.end()) : extents[static_cast<std::size_t>(up - 'x')];
}

std::string doubt_of_height(double metres, double metres_per_unit, bool is_person) {
  if (is_plausible_height(metres)) return {};
  std::string doubt = "the figure is " + digits(metres, 3) + " m tall, a person is 0.5 to 3 m";
  const UnitGuess guess = guess_unit(metres / metres_per_unit);
  if (!(guess.metres_per_unit > 0)) return doubt;
  doubt += "; --units " + digits(guess.metres_per_unit, 3) +
           (*guess.name == '\0' ? "" : std::string(" (") + guess.name + ")") + " makes " + digits(guess.height, 3) +
           " m";
  if (!is_person) doubt += ", if it is a person: its joints' names do not say";
  return doubt;
}

void fit_unit(const ImportOptions& options, Skeleton& skeleton) {
  if (!options.guesses_unit || skeleton.joint_names.empty()) return;
  const SkeletonView view = {skeleton.joint_names, skeleton.joint_parents, skeleton.is_end_site, skeleton.rest_offsets,
                             skeleton.rotations,   skeleton.positions,     skeleton.frame_count};
  const double height = height_of(guess_bodies(view, {}), options.up);
  if (is_plausible_height(height)) return;
  const double before = skeleton.unit.metres;
  const UnitGuess guess = guess_unit(height / before);
  if (!(guess.metres_per_unit > 0)) return;
  const double factor = guess.metres_per_unit / before;
  for (std::vector<double>* lengths : {&skeleton.rest_offsets, &skeleton.positions})
    for (double& length : *lengths) length *= factor;
  for (std::size_t i = 0; i < skeleton.skin.inverse_bind.size(); ++i)
    if (i % 4 != 3)
      skeleton.skin.inverse_bind[i] = static_cast<float>(factor * static_cast<double>(skeleton.skin.inverse_bind[i]));
  skeleton.unit.metres = guess.metres_per_unit;
  skeleton.unit.source = UnitSource::kGuessed;
  skeleton.notes.push_back("unit guessed: " + digits(guess.metres_per_unit, 3) + " m" +
                           (*guess.name == '\0' ? "" : std::string(" (") + guess.name + ")") + ", which makes " +
                           digits(height / before, 3) + " units " + digits(guess.height, 3) + " m tall, as a person");
  skeleton.alterations.push_back({AlterationKind::kGuessed, kGuessedUnits, 1, skeleton.notes.back()});
}

}  // namespace cab::scenes
