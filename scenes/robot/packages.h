// Where the packages of package:// paths may be.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace cab::scenes {

// Folders of packages by the name in their package.xml, the likeliest first.
using PackageFolders = std::map<std::string, std::vector<std::string>>;

// The files package.xml in the folders above a robot's file; in the folders beside those, of the nearest few; and in
// and up to two folders below each folder of ROS_PACKAGE_PATH. Lists folders, of each so many entries at most, and
// opens no file.
std::vector<std::string> package_files(const std::string& robot_path);

// The packages of such files. What is no package.xml is passed over.
PackageFolders read_packages(const std::vector<std::string>& files);

// The folders above a robot's file that are named so, or have a folder that is, the nearest first.
std::vector<std::string> folders_named(const std::string& package, const std::string& robot_path);

// The folders where ROS has a package of this name: PREFIX/share/NAME of AMENT_PREFIX_PATH, then NAME of
// ROS_PACKAGE_PATH.
std::vector<std::string> installed_folders_named(const std::string& package);

}  // namespace cab::scenes
