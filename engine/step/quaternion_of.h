// The quaternion of a rotation matrix.
#pragma once

namespace cab {

// Writes the quaternion x y z w, with w >= 0, of a rotation by its largest component (Shepperd 1978). m: by row, then
// by column.
void quaternion_of(const double (&m)[3][3], double (&q)[4]);

}  // namespace cab
