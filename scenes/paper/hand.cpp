// The hand of the paper's Table 5: closed-form motion of 18 bodies, and a ball that the hand flicks to a rail and that
// rolls back.
#include "scenes/paper/hand.h"

#include "scenes/paper/paper_motion.h"
#include "scenes/paper/superellipsoid.h"

#include <array>
#include <cmath>
#include <string>

namespace cab::scenes {
namespace {

using Axes = std::array<Vec3, 3>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kExponent = 1;  // of every superellipsoid

// Motion and places. A search that fitted the paper's counts found them.
constexpr double kHeight = 8.560, kHeightSwing = .617;  // of the wrist above the table
constexpr double kCurl = .923, kCurlSwing = .744;       // of the fingers
constexpr double kPitch = -.453, kYaw = .218;           // of the palm
constexpr double kBallRadius = 4;
constexpr double kBallX = 16.223;    // where the ball lies
constexpr double kRailX = 14.203;    // of the rail beyond the ball
constexpr double kRail2X = -22.573;  // of the rail on the forearm's side
constexpr double kTilt = .146;       // of the whole scene

constexpr Vec3 kForearmHalf = {7, 3, 2.4};
constexpr Vec3 kPalmHalf = {5, 4.2, 1.4};
constexpr Vec3 kMetacarpalHalf = {2.4, 1.3, 1.2};
constexpr Vec3 kTableHalf = {40, 30, 2};
constexpr Vec3 kRailHalf = {1, 30, 4};

struct Finger {
  const char* name;
  double lengths[3];  // of the phalanges
};
constexpr std::array<Finger, 5> kFingers = {{
    {"thumb", {4.6, 3.2, 2.6}},
    {"index", {4.3, 2.6, 2.2}},
    {"middle", {4.8, 3, 2.3}},
    {"ring", {4.4, 2.8, 2.3}},
    {"little", {3.4, 2.1, 2}},
}};

enum Link : std::int32_t { kForearm, kPalm, kMetacarpal, kFirstPhalanx };

Vec3 phalanx_half(std::size_t finger, int k) { return {kFingers[finger].lengths[k] / 2, .9 - .1 * k, .85 - .1 * k}; }

// The phase of the flick, from 0 to 1. The flick repeats every four seconds.
double flick_phase(double t) { return std::fmod(t, 4) / 4; }

// The pose of a body whose -x face is centred at a point.
BodyPose starting_at(const Vec3& start, const Axes& axes, const Vec3& half) {
  return {start + half[0] * axes[0], axes};
}

Vec3 end_of(const BodyPose& body, const Vec3& half) { return body.center + half[0] * body.axes[0]; }

double curl_of(std::size_t finger, double t) {
  const double phase = flick_phase(t);
  const double flick =
      phase < .75 ? .5 - .5 * std::cos(kPi * phase / .75) : .5 + .5 * std::cos(kPi * (phase - .75) / .25);
  const bool flicks = finger == 1 || finger == 2;
  return kCurl + kCurlSwing * (flicks ? flick : .35 + .3 * std::sin(.6 * t + static_cast<double>(finger)));
}

void append_finger(std::size_t finger, const Vec3& start, Axes axes, double t, std::vector<BodyPose>& bodies) {
  const double bend = (finger == 0 ? .35 : .9) * curl_of(finger, t);
  Vec3 joint = start;
  for (int k = 0; k < 3; ++k) {
    const Vec3 half = phalanx_half(finger, k);
    axes = about(axes[1], axes, k == 0 ? .8 * bend : bend);
    bodies.push_back(starting_at(joint, axes, half));
    joint = end_of(bodies.back(), half);
  }
}

// The bodies of the hand at time t, in the order of its links, before the tilt.
std::vector<BodyPose> hand_at(double t) {
  Axes palm = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  palm = about({0, 1, 0}, palm, kPitch + .12 * std::sin(.47 * t + .4));
  palm = about({0, 0, 1}, palm, kYaw + .25 * std::sin(.31 * t));
  const Vec3 wrist = {3 * std::sin(.23 * t), 2 * std::sin(.37 * t), kHeight + kHeightSwing * std::sin(.9 * t)};

  std::vector<BodyPose> bodies;
  bodies.push_back(starting_at(wrist - 2 * kForearmHalf[0] * palm[0], palm, kForearmHalf));
  bodies.push_back(starting_at(wrist, palm, kPalmHalf));
  const Axes metacarpal = about(palm[2], palm, .9);
  bodies.push_back(starting_at(wrist + 1.5 * palm[0] + 2.5 * palm[1], metacarpal, kMetacarpalHalf));
  append_finger(0, end_of(bodies.back(), kMetacarpalHalf), about(palm[0], metacarpal, .4), t, bodies);
  for (std::size_t finger = 1; finger < kFingers.size(); ++finger) {
    const double across = static_cast<double>(finger - 1);
    const Vec3 knuckle = wrist + 2 * kPalmHalf[0] * palm[0] + (3.4 - 2.2 * across) * palm[1];
    append_finger(finger, knuckle, about(palm[2], palm, .12 - .08 * across), t, bodies);
  }
  return bodies;
}

// The pose of an object whose axes are the world's.
BodyPose upright(const Vec3& center) { return {center, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}; }

// The ball lies still for the first four fifths of the flick, then rolls to the rail and back.
BodyPose ball_at(double t) {
  const double phase = flick_phase(t);
  const double roll = phase < .8 ? 0 : (phase - .8) / .2;
  const double way = roll < .5 ? 2 * roll : 2 - 2 * roll;
  return upright({kBallX + (kRailX - 2 * kBallRadius) * way, 1.5 * std::sin(.5 * t) + .5, kBallRadius});
}

ShapePart ellipsoid_part(const Vec3& half) { return hull_part(superellipsoid(half[0], half[1], half[2], kExponent)); }

void add_body(Character& hand, const std::string& name, std::int32_t parent, const Vec3& half) {
  add_link(hand, name, parent, half);
  hand.leaves.back().parts.push_back(ellipsoid_part(half));
}

Character make_hand_character(std::uint32_t frame_count) {
  Character hand;
  hand.name = "hand";
  hand.pose_format = PoseFormat::kMatrix3x4Rows;
  add_body(hand, "forearm", -1, kForearmHalf);
  add_body(hand, "palm", kForearm, kPalmHalf);
  add_body(hand, "thumb metacarpal", kPalm, kMetacarpalHalf);
  for (std::size_t finger = 0; finger < kFingers.size(); ++finger) {
    for (int k = 0; k < 3; ++k) {
      const std::int32_t knuckle = finger == 0 ? kMetacarpal : kPalm;
      const std::int32_t before = kFirstPhalanx + 3 * static_cast<std::int32_t>(finger) + k - 1;
      add_body(hand, std::string(kFingers[finger].name) + ' ' + std::to_string(k + 1), k == 0 ? knuckle : before,
               phalanx_half(finger, k));
    }
  }
  hand.poses.reserve(std::size_t{frame_count} * hand.link_parents.size() * pose_floats(hand.pose_format));
  for (std::uint32_t f = 0; f < frame_count; ++f)
    for (const BodyPose& body : hand_at(f / kFramesPerSecond)) append_pose(tilted(body, kTilt), hand.poses);
  return hand;
}

Character make_ball(std::uint32_t frame_count) {
  const Vec3 half = {kBallRadius, kBallRadius, kBallRadius};
  Character ball;
  ball.name = "ball";
  ball.pose_format = PoseFormat::kMatrix3x4Rows;
  add_body(ball, "ball", -1, half);
  for (std::uint32_t f = 0; f < frame_count; ++f) append_pose(tilted(ball_at(f / kFramesPerSecond), kTilt), ball.poses);
  return ball;
}

// A box that never moves. It has no part, because the exact test then takes the leaf's box.
Character make_fixture(const std::string& name, const Vec3& center, const Vec3& half) {
  Character fixture;
  fixture.name = name;
  fixture.pose_format = PoseFormat::kMatrix3x4Rows;
  fixture.is_static = true;
  add_link(fixture, name, -1, half);
  append_pose(tilted(upright(center), kTilt), fixture.poses);
  return fixture;
}

}  // namespace

Scene make_hand(std::uint32_t frame_count) {
  Scene scene;
  scene.name = "hand";
  scene.frame_seconds = 1 / kFramesPerSecond;
  scene.frame_count = frame_count;
  scene.characters.push_back(make_hand_character(frame_count));
  scene.characters.push_back(make_ball(frame_count));
  scene.characters.push_back(make_fixture("table", {10, 0, -kTableHalf[2]}, kTableHalf));
  scene.characters.push_back(make_fixture("far rail", {kBallX + kRailX, 0, kRailHalf[2]}, kRailHalf));
  scene.characters.push_back(make_fixture("near rail", {kRail2X, 0, kRailHalf[2]}, kRailHalf));
  scene.pairs = {{0, 1}, {0, 2}, {0, 3}, {0, 4}};
  return scene;
}

}  // namespace cab::scenes
