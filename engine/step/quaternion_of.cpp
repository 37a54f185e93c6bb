#include "engine/step/quaternion_of.h"

#include <cmath>

namespace cab {

void quaternion_of(const double (&m)[3][3], double (&q)[4]) {
  const double trace = m[0][0] + m[1][1] + m[2][2];
  int largest = 3;
  double most = trace;
  for (int k = 0; k < 3; ++k)
    if (m[k][k] > most) most = m[k][k], largest = k;
  if (largest == 3) {
    q[3] = 1 + trace;
    q[0] = m[2][1] - m[1][2], q[1] = m[0][2] - m[2][0], q[2] = m[1][0] - m[0][1];
  } else {
    const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    q[i] = 1 + 2 * m[i][i] - trace;
    q[j] = m[j][i] + m[i][j], q[k] = m[k][i] + m[i][k];
    q[3] = m[k][j] - m[j][k];
  }
  const double sign = q[3] < 0 ? -1 : 1;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& component : q) component *= sign / length;
}

}  // namespace cab
