// Pictures of `cab sweep` as SVG, drawn by gnuplot; its scripts, which hold their data, are kept beside them.
#pragma once

#include <string>
#include <vector>

#include "perf/sweep/cells.h"

namespace cab::perf {

// Makes the folder where it is missing. Throws std::runtime_error where it cannot, and one that says what to install
// where gnuplot does not run.
void prepare_plots(const std::string& folder);

// Draws into a folder; returns the names of the pictures. Of each run false-positives-SCENE
// (time against false positives) and growth-SCENE (time against the surface of inner boxes), where cells differ in these; of each family of scenes of
// which there are three or more, who is fastest at which number: crossover-detailed, crossover-ropes, scaling-uniform.
// Runs are drawn by their first instruction set, thread count and exact test; scaling by all thread counts.
// Throws std::runtime_error where gnuplot fails.
std::vector<std::string> plot_sweep(const std::string& folder, const std::vector<SweepRun>& runs);

}  // namespace cab::perf
