// Robots from files of either format.
#include "scenes/robot/robot.h"

#include "scenes/import/printable.h"
#include "scenes/robot/mjcf.h"
#include "scenes/robot/urdf.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

namespace cab::scenes {

Robot import_robot(const std::string& path, const RobotOptions& options) {
  const XmlText text(path);
  const std::string name = printable(path);
  const std::string root = text.root().Name();
  if (root != "robot" && root != "mujoco")
    throw ImportError(name + ": line " + std::to_string(text.root().GetLineNum()) + ": the first element is <" +
                      printable(root) + ">, but URDF begins with <robot> and MJCF with <mujoco>");
  Robot robot = root == "robot" ? read_urdf(text, options) : read_mjcf(text);
  if (robot.body.leaves.empty()) throw ImportError(name + ": no link has a collision shape");
  if (robot.body.leaves.size() > kMaxLeaves)
    throw ImportError(name + ": more than " + std::to_string(kMaxLeaves) + " collision shapes");
  return robot;
}

}  // namespace cab::scenes
