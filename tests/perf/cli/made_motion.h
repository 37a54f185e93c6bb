// A small motion file made from a formula: a figure 1.8 m tall that bends its chest, arms and legs.
#pragma once

#include <sstream>
#include <string>

namespace cab::tests {

// Bends by these degrees per frame, so that figures with different phases touch in some frames and not in others.
struct MadeMotion {
  int frames = 40;
  int phase = 0;           // shifts all bends
  double x = 0;            // metres where the hips start
  double x_per_frame = 0;  // metres that they move each frame
};

inline double bend(int step, int period, double degrees) {
  const int place = ((step % period) + period) % period;
  return degrees * (2 * place < period ? 2.0 * place / period : 2.0 - 2.0 * place / period) - degrees / 2;
}

inline std::string bvh_text(const MadeMotion& motion) {
  std::ostringstream text;
  const auto joint = [&](const char* name, const char* offset, const char* inside) {
    text << "JOINT " << name << "\n{\nOFFSET " << offset << "\nCHANNELS 3 Zrotation Xrotation Yrotation\n" << inside;
  };
  const auto limb = [&](const char* upper, const char* at, const char* lower, const char* then, const char* end) {
    joint(upper, at, "");
    joint(lower, then, "End Site\n{\nOFFSET ");
    text << end << "\n}\n}\n}\n";
  };
  text << "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\n"
          "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n";
  joint("chest", "0 0.25 0", "");
  joint("head", "0 0.35 0", "End Site\n{\nOFFSET 0 0.25 0\n}\n}\n");
  limb("left_arm", "0.2 0.3 0", "left_forearm", "0.28 0 0", "0.3 0 0");
  limb("right_arm", "-0.2 0.3 0", "right_forearm", "-0.28 0 0", "-0.3 0 0");
  text << "}\n";
  limb("left_thigh", "0.1 -0.05 0", "left_shin", "0 -0.45 0", "0 -0.45 0");
  limb("right_thigh", "-0.1 -0.05 0", "right_shin", "0 -0.45 0", "0 -0.45 0");
  text << "}\nMOTION\nFrames: " << motion.frames << "\nFrame Time: 0.04\n";
  for (int f = 0; f < motion.frames; ++f) {
    const int step = f + motion.phase;
    text << motion.x + motion.x_per_frame * f << " 0.95 0 0 0 " << bend(step, 30, 60);
    for (int channel = 0; channel < 10 * 3; ++channel) text << ' ' << bend(step + 3 * channel, 12 + channel % 7, 50);
    text << '\n';
  }
  return text.str();
}

}  // namespace cab::tests
