/* Compiled once per instruction set. */
#include "output/polygonize_rows.h"

#include <math.h>

extern const zs_row_kernels ZS_KERNELS(zs_row_kernels);

static void find_signs(const float f[ZS_BRICK_CORNERS], zs_row_bits signs)
{
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    unsigned bits = 0;
    for (unsigned x = 0; x < ZS_BRICK; x++)
      bits |= (unsigned)(f[row * ZS_BRICK + x] >= 0) << x;
    signs[row] = (uint16_t)bits;
  }
}

/* Ones of sixteen bits. */
static inline unsigned ones(unsigned bits)
{
  bits -= bits >> 1 & 0x5555;
  bits = (bits & 0x3333) + (bits >> 2 & 0x3333);
  bits = (bits + (bits >> 4)) & 0x0f0f;
  return (bits + (bits >> 8)) & 0x1f;
}

static unsigned find_inner(const zs_row_bits signs, const zs_row_bits real,
                           zs_row_bits crossing[3])
{
  unsigned count = 0;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    crossing[0][row] =
      (uint16_t)((signs[row] ^ signs[row] >> 1) & real[row] & real[row] >> 1 & 0x7fff);
  for (unsigned z = 0; z < ZS_BRICK; z++) {
    const unsigned at = z * ZS_BRICK, last = at + ZS_BRICK - 1;
    for (unsigned row = at; row < last; row++)
      crossing[1][row] = (uint16_t)((signs[row] ^ signs[row + 1]) & real[row] & real[row + 1]);
    crossing[1][last] = 0;
  }
  const unsigned last = ZS_BRICK_ROWS - ZS_BRICK;
  for (unsigned row = 0; row < last; row++)
    crossing[2][row] =
      (uint16_t)((signs[row] ^ signs[row + ZS_BRICK]) & real[row] & real[row + ZS_BRICK]);
  for (unsigned row = last; row < ZS_BRICK_ROWS; row++)
    crossing[2][row] = 0;
  for (unsigned axis = 0; axis < 3; axis++)
    for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
      count += ones(crossing[axis][row]);
  return count;
}

static inline float larger(float a, float b)
{
  return a > b ? a : b;
}

/* Corners at the brick's sides, which may have a crossing edge to a neighbour
 * outside, and those of crossing edges. */
static inline unsigned with_edges(const zs_row_bits crossing[3], unsigned row)
{
  const unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
  if (y == 0 || y == ZS_BRICK - 1 || z == 0 || z == ZS_BRICK - 1)
    return 0xffff;
  return 0x8001 | crossing[0][row] | crossing[0][row] << 1 | crossing[1][row] |
         crossing[1][row - 1] | crossing[2][row] | crossing[2][row - ZS_BRICK];
}

/* Slopes are those of the steeper side; at a brick's sides there is but one. */
static void find_close(const float *f, const zs_row_bits crossing[3],
                       const float per_cell[3], float limit, zs_row_bits close)
{
  static const float has_lower[ZS_BRICK] = {0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1},
                     has_upper[ZS_BRICK] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0};
  const float wx = limit * per_cell[0] * limit * per_cell[0],
              wy = limit * per_cell[1] * limit * per_cell[1],
              wz = limit * per_cell[2] * limit * per_cell[2];
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    const unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    const float *at = f + row * ZS_BRICK;
    const float *y0 = y ? at - ZS_BRICK : at, *y1 = y + 1 < ZS_BRICK ? at + ZS_BRICK : at;
    const float *z0 = z ? at - ZS_BRICK_ROWS : at;
    const float *z1 = z + 1 < ZS_BRICK ? at + ZS_BRICK_ROWS : at;
    unsigned bits = 0;
    for (unsigned x = 0; x < ZS_BRICK; x++) {
      const float v = at[x];
      const float dx = larger(has_lower[x] * fabsf(*(at + x - 1) - v),
                              has_upper[x] * fabsf(*(at + x + 1) - v));
      const float dy = larger(fabsf(y0[x] - v), fabsf(y1[x] - v));
      const float dz = larger(fabsf(z0[x] - v), fabsf(z1[x] - v));
      bits |= (unsigned)(v * v < wx * dx * dx + wy * dy * dy + wz * dz * dz) << x;
    }
    close[row] = (uint16_t)(bits & with_edges(crossing, row));
  }
}

static void find_steps(unsigned n, const float *f, const float gradient[3][ZS_BLOCK], float reach,
                       float *step)
{
  for (unsigned i = 0; i < n; i++) {
    const float x = fabsf(gradient[0][i]), y = fabsf(gradient[1][i]), z = fabsf(gradient[2][i]);
    const float most = larger(x, larger(y, z)), u = x / most, v = y / most, w = z / most;
    const float slope = most * sqrtf(u * u + v * v + w * w);
    const float missing = (reach - fabsf(f[i]) / slope) / slope;
    const float outward = f[i] >= 0 ? missing : -missing;
    step[i] = missing > 0 && slope < INFINITY ? outward : 0;
  }
}

const zs_row_kernels ZS_KERNELS(zs_row_kernels) = {find_signs, find_inner, find_close, find_steps};
