// The length unit of a file: what it says, and what makes a person of its figure.
#pragma once

#include <string>

#include "scenes/import/import.h"

namespace cab::scenes {

// Sets the unit of a skeleton to the given one, or to what its file states (0: nothing), or to metres.
void set_unit(const ImportOptions& options, Skeleton& skeleton, double stated = 0);

// Whether a figure of this height in metres can be a person: it may sit, or lack its head.
bool is_plausible_height(double metres);

// A unit in which a standing figure is as tall as a person.
struct UnitGuess {
  double metres_per_unit = 0;  // 0: there is none, because the figure has no height
  const char* name = "";       // of the unit; empty: none in use fits, and this one makes 1.7 m
  double height = 0;           // metres
};

// The usual unit that makes a standing person of a figure that is so many units tall, or else a rounded number.
UnitGuess guess_unit(double units_tall);

// How tall a figure is along an axis, or along the axis in which it is tallest (0), by the median over all frames. Of a
// hand alone: how tall its person is.
double height_of(const SkeletonBodies& bodies, char up);

// What is doubtful about the height of a figure in metres, with the unit that would help; empty if nothing is.
// is_person: its joints have the names of a person's.
std::string doubt_of_height(double metres, double metres_per_unit, bool is_person);

// With options.guesses_unit, makes a skeleton whose height is no person's as large as guess_unit says, with a note.
void fit_unit(const ImportOptions& options, Skeleton& skeleton);

// A number with so many digits that matter, without exponent for lengths of figures.
std::string digits(double value, int count);

}  // namespace cab::scenes
