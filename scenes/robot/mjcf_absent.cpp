// MJCF in a build without libmujoco.
#include "scenes/import/printable.h"
#include "scenes/robot/mjcf.h"

namespace cab::scenes {

bool reads_mjcf() { return false; }

Robot read_mjcf(const XmlText& text, const RobotOptions&, LeafTriangles*) {
  throw ImportError(
      printable(text.path()) +
      ": MJCF is not built in: libmujoco was not found (Debian: libmujoco-dev libgl-dev) when cab was configured");
}

}  // namespace cab::scenes
