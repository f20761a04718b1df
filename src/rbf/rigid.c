#include "rbf/rigid.h"

#include "base/vector3.h"
#include "rbf/dense.h"

#include <math.h>
#include <string.h>

zs_rigid zs_rigid_identity(void)
{
  return (zs_rigid){.axis = {0, 0, 1}};
}

/* ---- Rotations ------------------------------------------------------------------------ */

/* The rotation (3 x 3, row-major) by `angle` about an axis of length 1: Rodrigues. */
static void rotation(const double axis[3], double angle, double r[9])
{
  const double c = cos(angle), s = sin(angle), half = sin(angle / 2), u = 2 * half * half;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++)
      r[3 * i + j] = u * axis[i] * axis[j] + (i == j ? c : 0);
    r[3 * i + (i + 1) % 3] -= s * axis[(i + 2) % 3];
    r[3 * i + (i + 2) % 3] += s * axis[(i + 1) % 3];
  }
}

/* Axis and angle of a rotation, through the quaternion (w, x, y, z) whose largest component
 * comes from a sum without cancellation (Shepperd, 1978). */
static void set_rotation(zs_rigid *rigid, const double r[9])
{
  const double sum[4] = {1 + r[0] + r[4] + r[8], 1 + r[0] - r[4] - r[8],
                         1 - r[0] + r[4] - r[8], 1 - r[0] - r[4] + r[8]};
  int largest = 0;
  for (int i = 1; i < 4; i++)
    if (sum[i] > sum[largest])
      largest = i;
  double q[4];
  q[largest] = sum[largest];
  for (int k = 0; k < 3; k++) { /* differences are 4 w q_k, sums 4 q_i q_j */
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double difference = r[3 * j + i] - r[3 * i + j];
    const double both = r[3 * i + j] + r[3 * j + i];
    if (largest == 0)
      q[k + 1] = difference;
    else if (largest == k + 1)
      q[0] = difference;
    else
      q[(largest == i + 1 ? j : i) + 1] = both;
  }
  const double sign = q[0] < 0 ? -1 : 1, size = hypot(hypot(q[1], q[2]), q[3]);
  *rigid = zs_rigid_identity();
  if (size == 0)
    return;
  rigid->angle = 2 * atan2(size, sign * q[0]);
  for (int k = 0; k < 3; k++)
    rigid->axis[k] = sign * q[k + 1] / size;
}

/* The least rotation that turns one direction of length 1 into another.  Into the opposite one
 * it turns about z, or as near to z as can be. */
static void set_turn(zs_rigid *rigid, const double from[3], const double to[3])
{
  double axis[3];
  *rigid = zs_rigid_identity();
  zs_cross3(from, to, axis);
  rigid->angle = atan2(sqrt(zs_dot3(axis, axis)), zs_dot3(from, to));
  if (!(zs_dot3(axis, axis) > 1e-24)) {
    const double z[3] = {0, 0, 1}, x[3] = {1, 0, 0};
    const double *upright = fabs(from[2]) < 0.9 ? z : x;
    for (int k = 0; k < 3; k++)
      axis[k] = upright[k] - zs_dot3(upright, from) * from[k];
  }
  const double size = sqrt(zs_dot3(axis, axis));
  for (int k = 0; k < 3; k++)
    rigid->axis[k] = axis[k] / size;
}

/* ---- Fitting --------------------------------------------------------------------------- */

/* The sum of (to - its middle) (from - its middle)^T, up to a factor, column-major; and the
 * middles. */
static void covariance(const double *from, const double *to, size_t count, zs_rigid *rigid,
                       double m[9])
{
  double size[2] = {0, 0};
  memset(m, 0, 9 * sizeof *m);
  for (int k = 0; k < 3; k++) {
    rigid->from[k] = rigid->to[k] = 0;
    for (size_t i = 0; i < count; i++) {
      rigid->from[k] += from[3 * i + k] / (double)count;
      rigid->to[k] += to[3 * i + k] / (double)count;
    }
    for (size_t i = 0; i < count; i++) {
      size[0] = fmax(size[0], fabs(from[3 * i + k] - rigid->from[k]));
      size[1] = fmax(size[1], fabs(to[3 * i + k] - rigid->to[k]));
    }
  }
  if (size[0] == 0 || size[1] == 0)
    return;
  for (size_t n = 0; n < count; n++)
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        m[3 * j + i] += (to[3 * n + i] - rigid->to[i]) / size[1] *
                        ((from[3 * n + j] - rigid->from[j]) / size[0]) / (double)count;
}

/* The rotation R that makes the trace of R^T M largest, from M = U S V^T: U V^T, with the last
 * column of U turned round where that would be a reflection. */
static bool set_nearest(zs_rigid *rigid, const double m[9])
{
  zs_span span;
  const zs_dense_result result = zs_span_make(&span, 3, 3, m);
  if (result == ZS_DENSE_DONE && span.rank == 1) {
    const double v[3] = {span.right[0], span.right[3], span.right[6]};
    set_turn(rigid, v, span.basis);
  } else if (result == ZS_DENSE_DONE && span.rank > 1) {
    const double *u = span.basis;
    double v[9], r[9], normal[3], other[3];
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < 3; i++)
        v[3 * k + i] = span.right[3 * i + k];
    zs_cross3(u, u + 3, normal);
    zs_cross3(v, v + 3, other);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        r[3 * i + j] = u[i] * v[j] + u[3 + i] * v[3 + j] + normal[i] * other[j];
    set_rotation(rigid, r);
  }
  zs_span_free(&span);
  return result != ZS_DENSE_MEMORY;
}

bool zs_rigid_fit(unsigned dimension, const double *from, const double *to, size_t count,
                  zs_rigid *rigid)
{
  double m[9];
  zs_rigid found = zs_rigid_identity(), middle = found;
  covariance(from, to, count, &middle, m);
  if (dimension == 2) {
    /* tr(R^T M) = cos a (m00 + m11) + sin a (m10 - m01) */
    const double angle = atan2(m[1] - m[3], m[0] + m[4]);
    found.angle = fabs(angle);
    found.axis[2] = angle < 0 ? -1 : 1;
  } else if (!set_nearest(&found, m)) {
    return false;
  }
  memcpy(found.from, middle.from, sizeof found.from);
  memcpy(found.to, middle.to, sizeof found.to);
  *rigid = found;
  return true;
}

void zs_rigid_at(const zs_rigid *rigid, double t, double forward[12], double inverse[12])
{
  double r[9];
  rotation(rigid->axis, t * rigid->angle, r);
  for (int i = 0; i < 3; i++) {
    double ahead = (1 - t) * rigid->from[i] + t * rigid->to[i], back = rigid->from[i];
    for (int j = 0; j < 3; j++) {
      ahead -= r[3 * i + j] * rigid->from[j];
      back -= r[3 * j + i] * ((1 - t) * rigid->from[j] + t * rigid->to[j]);
      if (forward)
        forward[4 * i + j] = r[3 * i + j];
      if (inverse)
        inverse[4 * i + j] = r[3 * j + i];
    }
    if (forward)
      forward[4 * i + 3] = ahead;
    if (inverse)
      inverse[4 * i + 3] = back;
  }
}
