// What is read of a robot's files as bytes, from a child process.
#pragma once

#include "scenes/robot/robot.h"
#include "scenes/robot/state_file.h"

#include <string>

namespace cab::scenes {

std::string robot_payload(const Robot& robot);

// The robot in the bytes, which may be anything. Every index is one of an item of the robot, parents come before their
// children, numbers of joints are finite, and texts are printable. Shapes are as the engine checks them. Throws
// PayloadError.
Robot read_robot_payload(const std::string& bytes);

std::string triangles_payload(const LeafTriangles& triangles);

// The same of whole triangles with finite corners. Throws PayloadError.
LeafTriangles read_triangles_payload(const std::string& bytes);

std::string disabled_pairs_payload(const DisabledPairs& disabled);

// The same for pairs of links of a robot. Throws PayloadError.
DisabledPairs read_disabled_pairs_payload(const std::string& bytes, const Robot& robot);

std::string joint_states_payload(const JointStates& states);

// The same for states of a robot: at least one, with a finite value for each variable. Throws PayloadError.
JointStates read_joint_states_payload(const std::string& bytes, const Robot& robot);

}  // namespace cab::scenes
