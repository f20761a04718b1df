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
      count += zs_ones(crossing[axis][row]);
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

/* ---- Edges and cells ---------------------------------------------------------------- */

static void find_crossing(const zs_brick_rows rows, zs_row_bits crossing[3])
{
  for (unsigned z = 0; z < ZS_BRICK; z++)
    for (unsigned y = 0; y < ZS_BRICK; y++) {
      const uint32_t signs = rows[z][y];
      const unsigned row = z * ZS_BRICK + y;
      crossing[0][row] = (uint16_t)(signs ^ signs >> 1);
      crossing[1][row] = (uint16_t)(signs ^ rows[z][y + 1]);
      crossing[2][row] = (uint16_t)(signs ^ rows[z + 1][y]);
    }
}

static unsigned find_first(const zs_row_bits crossing[3], uint16_t first[ZS_BRICK_ROWS])
{
  zs_row_bits counts;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    counts[row] = (uint16_t)(zs_ones(crossing[0][row]) + zs_ones(crossing[1][row]) +
                             zs_ones(crossing[2][row]));
  unsigned sum = 0;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    first[row] = (uint16_t)sum;
    sum += counts[row];
  }
  return sum;
}

static void find_cells(const zs_brick_rows rows, zs_row_bits cells)
{
  for (unsigned z = 0; z < ZS_BRICK; z++)
    for (unsigned y = 0; y < ZS_BRICK; y++) {
      const uint32_t a = rows[z][y], b = rows[z][y + 1], c = rows[z + 1][y],
                     d = rows[z + 1][y + 1];
      const uint32_t any = a | b | c | d, all = a & b & c & d;
      cells[z * ZS_BRICK + y] = (uint16_t)((any | any >> 1) & ~(all & all >> 1));
    }
}

/* ---- Vertices -------------------------------------------------------------------------- */

static void find_lines(unsigned n, const uint16_t *edges, const double cell[3], zs_roots *roots)
{
  for (unsigned k = 0; k < 3; k++) {
    const float side = (float)cell[k];
    float *from = roots->from[k], *along = roots->along[k];
    for (unsigned i = 0; i < n; i++) {
      const int edge = edges[i];
      const float start = side * (float)((edge >> 4 * k & (ZS_BRICK - 1)) - ZS_BRICK / 2);
      const float step = (edge >> ZS_EDGE_AXIS & 3) == (int)k ? side : 0;
      const int inside = edge >> ZS_EDGE_INSIDE & 1;
      from[i] = inside ? start : start + step;
      along[i] = inside ? step : -step;
    }
  }
}

static void find_normals(unsigned n, float gradient[3][ZS_BLOCK])
{
  for (unsigned i = 0; i < n; i++) {
    const float x = gradient[0][i], y = gradient[1][i], z = gradient[2][i];
    const float most = larger(fabsf(x), larger(fabsf(y), fabsf(z)));
    const float u = x / most, v = y / most, w = z / most;
    const float length = sqrtf(u * u + v * v + w * w); /* 1 .. sqrt(3), or NaN */
    gradient[0][i] = length >= 1 ? -u / length : 0;
    gradient[1][i] = length >= 1 ? -v / length : 0;
    gradient[2][i] = length >= 1 ? -w / length : 0;
  }
}

static inline float smaller(float a, float b)
{
  return a < b ? a : b;
}

/* Extend one box along one axis by the normals of edges that are `among`. */
static inline void extend(unsigned n, const float *normal, const float *among, float *box_lo,
                          float *box_hi)
{
  float lo = *box_lo, hi = *box_hi;
  for (unsigned i = 0; i < n; i++) {
    lo = smaller(lo, among[i] > 0 ? normal[i] : lo);
    hi = larger(hi, among[i] > 0 ? normal[i] : hi);
  }
  *box_lo = lo;
  *box_hi = hi;
}

static void hold_normals(unsigned n, const float normal[3][ZS_BLOCK], const uint16_t *edges,
                         zs_brick *brick)
{
  float among[ZS_BLOCK];
  for (unsigned i = 0; i < n; i++)
    among[i] = 1;
  for (unsigned k = 0; k < 3; k++)
    extend(n, normal[k], among, &brick->all_normals.lo[k], &brick->all_normals.hi[k]);
  for (unsigned side = 0; side < 3; side++) {
    zs_normal_box *box = &brick->side_normals[side];
    for (unsigned i = 0; i < n; i++) {
      const unsigned edge = edges[i];
      among[i] = (edge >> 4 * side & (ZS_BRICK - 1)) == 0 && (edge >> ZS_EDGE_AXIS & 3) != side;
    }
    for (unsigned k = 0; k < 3; k++)
      extend(n, normal[k], among, &box->lo[k], &box->hi[k]);
  }
}

static void pack(unsigned n, const float from[3][ZS_BLOCK], float *packed)
{
  for (unsigned i = 0; i < n; i++)
    for (unsigned k = 0; k < 3; k++)
      packed[3 * i + k] = from[k][i];
}

static void find_places(unsigned n, const float place[3][ZS_BLOCK], const double origin[3],
                        float *packed)
{
  for (unsigned i = 0; i < n; i++)
    for (unsigned k = 0; k < 3; k++)
      packed[3 * i + k] = (float)(origin[k] + (double)place[k][i]);
}

const zs_row_kernels ZS_KERNELS(zs_row_kernels) = {
  .signs = find_signs,
  .inner = find_inner,
  .close = find_close,
  .crossing = find_crossing,
  .first = find_first,
  .cells = find_cells,
  .lines = find_lines,
  .normals = find_normals,
  .hold = hold_normals,
  .pack = pack,
  .places = find_places,
  .steps = find_steps,
};
