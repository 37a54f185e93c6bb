// Finds the frame step of an animation among the steps of its keys.
#include "scenes/import/scene_clock.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "scenes/import/import.h"
#include "scenes/import/limits.h"

namespace cab::scenes {
namespace {

constexpr double kDefaultTicksPerSecond = 25;  // assimp's own value for files that do not say
constexpr double kMinFrameSeconds = 1e-3;
// Steps this close count as one. KeyTimes of glTF are floats: at 100 s they round a step of 1 ms by up to 1.5 %.
constexpr double kSameStep = 1.04;
// Share of a frame. A key this close to a frame lies on it.
constexpr double kOnFrame = .05;
// The longest step of a sampled motion. Longer ones are poses that somebody set by hand.
constexpr double kLongestSampledStep = .125;
// Share of the tracks' time that a step must divide, for all tracks to follow it.
constexpr double kMostOfTime = .5;
// The same for a step that no track keeps, but of which keys are whole multiples, as where exporters drop keys.
constexpr double kNearlyAllOfTime = .9;
// Rates that a file may state, frames a second. Others are left to the keys: FBX states 1 where it means none.
constexpr double kLeastOwnRate = 1 / kLongestSampledStep, kGreatestOwnRate = 240;
// Share of a frame by which the last key may miss it, since times are rounded.
constexpr double kLastFrameTolerance = 1e-3;

double span_of(const KeyTimes& times) { return times.back() - times.front(); }

// Steps about one length, and how much speaks for them.
struct Step {
  double length = 0;
  double weight = 0;
};

// The steps, in order of length, that are about one length and weigh most together; of equal ones the shorter.
struct Window {
  std::size_t begin = 0, end = 0;
  double weight = 0;
};
Window heaviest(const std::vector<Step>& steps) {
  constexpr double kRounding = 1e-9;  // of sums of weights
  Window best;
  std::vector<double> sums(steps.size() + 1, 0);
  for (std::size_t s = 0; s < steps.size(); ++s) sums[s + 1] = sums[s] + steps[s].weight;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < steps.size(); ++begin) {
    while (end < steps.size() && steps[end].length <= kSameStep * steps[begin].length) ++end;
    const double weight = sums[end] - sums[begin];
    if (weight > best.weight * (1 + kRounding)) best = {begin, end, weight};
  }
  return best;
}

bool is_shorter(const Step& a, const Step& b) { return a.length < b.length; }

// A track's commonest step, and the time for which the track keeps it.
Step step_kept(const KeyTimes& times) {
  std::vector<Step> steps;
  for (std::size_t k = 1; k < times.size(); ++k)
    if (times[k] > times[k - 1]) steps.push_back({times[k] - times[k - 1], 1});
  std::sort(steps.begin(), steps.end(), is_shorter);
  const Window window = heaviest(steps);
  Step kept;
  for (std::size_t s = window.begin; s < window.end; ++s) kept.weight += steps[s].length;
  // The mean over a whole track has no rounding of single keys.
  if (window.end - window.begin + 1 == times.size())
    kept.length = span_of(times) / static_cast<double>(times.size() - 1);
  else if (window.end > window.begin)
    kept.length = kept.weight / static_cast<double>(window.end - window.begin);
  return kept;
}

bool divides(double step, double length) {
  const double frames = length / step;
  return std::fabs(frames - std::round(frames)) <= kOnFrame && frames > .5;
}

bool has_keys_between(const KeyTimes& times, double step) {
  for (std::size_t k = 1; k < times.size(); ++k)
    if (times[k] > times[k - 1] && !divides(step, times[k] - times[k - 1])) return true;
  return false;
}

// The share of the tracks' time between keys that are whole frames apart.
double share_on_frames(const std::vector<KeyTimes>& tracks, double step) {
  double on_frames = 0, all = 0;
  for (const KeyTimes& times : tracks) {
    for (std::size_t k = 1; k < times.size(); ++k)
      if (divides(step, times[k] - times[k - 1])) on_frames += times[k] - times[k - 1];
    all += span_of(times);
  }
  return all > 0 ? on_frames / all : 0;
}

// The step that tracks keep for most of their time, up to `longest`; 0 if none is.
double step_of_keepers(const std::vector<KeyTimes>& tracks, double longest) {
  struct Keeper {
    Step step;
    std::size_t keys;
    bool is_regular;
  };
  std::vector<Keeper> keepers;
  for (const KeyTimes& times : tracks) {
    const Step step = step_kept(times);
    if (!(step.length > 0) || step.length > longest || step.weight < kMostOfTime * span_of(times)) continue;
    keepers.push_back({step, times.size(), !has_keys_between(times, step.length)});
  }
  std::stable_sort(keepers.begin(), keepers.end(),
                   [](const Keeper& a, const Keeper& b) { return is_shorter(a.step, b.step); });
  std::vector<Step> steps;
  for (const Keeper& keeper : keepers) steps.push_back(keeper.step);
  const Window window = heaviest(steps);
  if (window.begin == window.end) return 0;
  // Of the track without extra keys that has the most, whose mean is the least rounded.
  const auto knows_less = [](const Keeper& a, const Keeper& b) {
    return a.is_regular != b.is_regular ? b.is_regular : a.keys < b.keys;
  };
  const double step = std::max_element(keepers.begin() + static_cast<std::ptrdiff_t>(window.begin),
                                       keepers.begin() + static_cast<std::ptrdiff_t>(window.end), knows_less)
                          ->step.length;
  return share_on_frames(tracks, step) >= kMostOfTime ? step : 0;
}

// The longest step of two keys, up to `longest`, that divides nearly all others; 0 if none does.
double common_divisor(const std::vector<KeyTimes>& tracks, double longest) {
  constexpr std::size_t kMostCandidates = 64;
  std::vector<Step> steps;
  for (const KeyTimes& times : tracks)
    for (std::size_t k = 1; k < times.size(); ++k)
      if (const double step = times[k] - times[k - 1]; step > 0 && step <= longest) steps.push_back({step, 1});
  std::sort(steps.begin(), steps.end(), is_shorter);
  // From the commonest on: each window is one candidate.
  double best = 0;
  for (std::size_t c = 0; c < kMostCandidates && !steps.empty(); ++c) {
    const Window window = heaviest(steps);
    const auto begin = steps.begin() + static_cast<std::ptrdiff_t>(window.begin);
    const auto end = steps.begin() + static_cast<std::ptrdiff_t>(window.end);
    const double mean = std::accumulate(begin, end, 0.0, [](double sum, const Step& s) { return sum + s.length; }) /
                        static_cast<double>(window.end - window.begin);
    if (mean > best && share_on_frames(tracks, mean) >= kNearlyAllOfTime) best = mean;
    steps.erase(begin, end);
  }
  return best;
}

std::string text_of(const char* format, double value) {
  std::array<char, 32> text = {};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace

void check_frames(double frames, std::size_t node_count, const std::string& path) {
  if (!(frames * static_cast<double>(node_count) <= static_cast<double>(kMaxJointFrames)))
    throw ImportError(path + ": frames x nodes is more than " + std::to_string(kMaxJointFrames));
}

SceneClock make_clock(std::vector<KeyTimes> tracks, const ClockOptions& options, const std::string& path,
                      std::vector<std::string>& notes, std::vector<Alteration>& alterations) {
  SceneClock clock;
  const auto stands_still = [](const KeyTimes& times) { return times.size() < 2 || !(times.back() > times.front()); };
  tracks.erase(std::remove_if(tracks.begin(), tracks.end(), stands_still), tracks.end());
  if (tracks.empty()) return clock;
  double ticks_per_second = options.ticks_per_second;
  const bool is_without_clock = ticks_per_second == 0;
  if (is_without_clock) ticks_per_second = kDefaultTicksPerSecond;
  if (!std::isfinite(ticks_per_second) || ticks_per_second < 0)
    throw ImportError(path + ": the ticks a second of its animation must be finite and above 0");
  if (is_without_clock) {
    notes.emplace_back("the file has no clock: 25 ticks a second assumed");
    alterations.push_back({AlterationKind::kGuessed, "clocks", 1, notes.back()});
  }

  double first = tracks[0].front(), last = tracks[0].back();
  const KeyTimes* densest = &tracks[0];
  for (const KeyTimes& times : tracks) {
    first = std::min(first, times.front());
    last = std::max(last, times.back());
    if (times.size() > densest->size()) densest = &times;
  }
  const double mean = span_of(*densest) / static_cast<double>(densest->size() - 1);
  const auto has_two_keys = [](const KeyTimes& times) { return times.size() == 2; };
  if (!std::all_of(tracks.begin(), tracks.end(), has_two_keys))
    tracks.erase(std::remove_if(tracks.begin(), tracks.end(), has_two_keys), tracks.end());

  const double longest_sampled = kLongestSampledStep * ticks_per_second;
  const char* from = "the step that tracks keep";
  double step = step_of_keepers(tracks, longest_sampled);
  if (!(step > 0) && options.own_rate >= kLeastOwnRate && options.own_rate <= kGreatestOwnRate) {
    step = ticks_per_second / options.own_rate;
    from = "the file's own rate";
  }
  if (!(step > 0)) step = step_of_keepers(tracks, kMaxFrameSeconds * ticks_per_second);
  if (!(step > 0)) {
    step = common_divisor(tracks, longest_sampled);
    from = "the step that divides those of the keys";
  }
  if (!(step > 0)) {
    step = mean;
    from = "the mean step of the densest track";
  }
  clock.frame_seconds = std::max(step / ticks_per_second, kMinFrameSeconds);
  if (!(clock.frame_seconds <= kMaxFrameSeconds))
    throw ImportError(path + ": the frame time of its animation is more than an hour");
  clock.first_tick = first;
  clock.ticks_per_frame = clock.frame_seconds * ticks_per_second;
  const double frames = std::floor((last - first) / clock.ticks_per_frame + kLastFrameTolerance) + 1;
  check_frames(frames, options.node_count, path);
  clock.frame_count = static_cast<std::uint32_t>(frames);

  const auto strays =
      static_cast<std::uint64_t>(std::count_if(tracks.begin(), tracks.end(), [&](const KeyTimes& times) {
        return has_keys_between(times, clock.ticks_per_frame);
      }));
  if (strays == 0) return clock;
  notes.push_back(std::to_string(strays) + " of " + std::to_string(tracks.size()) +
                  " tracks have keys between the frames, which are " + text_of("%.4g", clock.frame_seconds) +
                  " s apart (" + text_of("%.2f", 1 / clock.frame_seconds) + " a second), " + from);
  alterations.push_back({AlterationKind::kResampled, "tracks with keys between the frames", strays, notes.back()});
  return clock;
}

}  // namespace cab::scenes
