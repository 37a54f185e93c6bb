#include "perf/judge/oracle/rotation_limit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "perf/judge/oracle/random.h"

namespace cab::oracle {
namespace {

using Axes = std::array<Vec3<double>, 3>;

constexpr int kRandomStarts = 60;
constexpr std::size_t kRefinedStarts = 6;
constexpr double kFirstStep = .25, kLastStep = 1e-4;  // rad; at the last the surface is flat to 1e-7 or so

// The surface of the box along the axes about all boxes.
double surface_along(const Axes& axes, const std::vector<OracleBox<double>>& boxes) {
  double half[3];
  for (std::size_t a = 0; a < 3; ++a) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const OracleBox<double>& box : boxes) {
      const double at = dot(axes[a], center_of(box));
      double reach = 0;
      for (std::size_t k = 0; k < 3; ++k) reach += box.half[k] * std::fabs(dot(axes[a], axis_of(box, k)));
      low = std::min(low, at - reach);
      high = std::max(high, at + reach);
    }
    half[a] = (high - low) / 2;
  }
  return surface_of(half);
}

// The axes rotated about one of them.
Axes rotated(const Axes& axes, std::size_t about, double angle) {
  const std::size_t i = (about + 1) % 3, j = (about + 2) % 3;
  Axes out = axes;
  out[i] = std::cos(angle) * axes[i] + std::sin(angle) * axes[j];
  out[j] = std::cos(angle) * axes[j] - std::sin(angle) * axes[i];
  return out;
}

Axes random_axes(Random& random) {
  double axis[3][3];
  random.rotation(axis);
  return {to_vec3(axis[0]), to_vec3(axis[1]), to_vec3(axis[2])};
}

// Rotates axes about one of them while that shrinks the surface. If no rotation by the step does, the step is halved.
double refined(Axes axes, double best, const std::vector<OracleBox<double>>& boxes) {
  for (double step = kFirstStep; step > kLastStep;) {
    bool gained = false;
    for (std::size_t about = 0; about < 3; ++about)
      for (const double angle : {step, -step}) {
        const Axes candidate = rotated(axes, about, angle);
        const double found = surface_along(candidate, boxes);
        if (found >= best) continue;
        best = found;
        axes = candidate;
        gained = true;
      }
    if (!gained) step /= 2;
  }
  return best;
}

}  // namespace

double rotation_limit(const std::vector<OracleBox<double>>& boxes) {
  std::vector<std::pair<double, Axes>> starts;
  const auto add = [&](const Axes& axes) { starts.emplace_back(surface_along(axes, boxes), axes); };
  add({{{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}}});
  for (const OracleBox<double>& box : boxes) add({axis_of(box, 0), axis_of(box, 1), axis_of(box, 2)});
  Random random(1);
  for (int r = 0; r < kRandomStarts; ++r) add(random_axes(random));
  std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  double best = starts.front().first;
  for (std::size_t s = 0; s < std::min(kRefinedStarts, starts.size()); ++s)
    best = std::min(best, refined(starts[s].second, starts[s].first, boxes));
  return best;
}

}  // namespace cab::oracle
