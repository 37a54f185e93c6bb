// Pictures of `cab sweep` as SVG, drawn by gnuplot. The gnuplot scripts contain the data, and stay beside the pictures.
#pragma once

#include <string>
#include <vector>

#include "perf/measure/sweep/cells.h"

namespace cab::perf {

// Makes the folder if it is missing. Throws std::runtime_error if that fails, or if gnuplot does not run. Then the
// message says what to install.
void prepare_plots(const std::string& folder);

// Draws into a folder; returns the names of the pictures. Per run: false-positives-SCENE (time against false positives)
// and growth-SCENE (time against the surface of inner boxes), if its cells differ in these. Per family of three or more
// scenes: which strategy is fastest at which number (crossover-detailed, crossover-ropes), and scaling-uniform. Runs
// are drawn by their first instruction set, thread count and exact test; scaling by all thread counts. Throws
// std::runtime_error if gnuplot fails.
std::vector<std::string> plot_sweep(const std::string& folder, const std::vector<SweepRun>& runs);

}  // namespace cab::perf
