/* Compiled once per instruction set. */
#include "output/polygonize_rows.h"

#include "field/lanes.h"

extern const zs_row_kernels ZS_KERNELS(zs_row_kernels);

static void find_signs(const float f[ZS_BRICK_CORNERS], zs_row_bits signs)
{
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    ZS_FOR_PARTS(part)
      zs_set_bits(&signs[row], part, zs_lanes_load(f + row * ZS_BRICK + part) >= 0);
}

static void find_inner(const zs_row_bits signs, const zs_row_bits real, zs_row_bits crossing[3])
{
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

static inline zs_lanes load_anywhere(const float *from)
{
  zs_lanes a;
  memcpy(&a, from, sizeof a);
  return a;
}

static inline zs_lanes step_between(zs_lanes a, zs_lanes b)
{
  return zs_lanes_absolute(a - b);
}

/* Slopes are those of the steeper side; at a brick's sides there is but one. */
static void find_close(const float *f, const zs_row_bits crossing[3], const float per_cell[3],
                       float limit, zs_row_bits close)
{
  const zs_lanes one = zs_lanes_all(1), zero = zs_lanes_all(0);
  const float wx = limit * per_cell[0], wy = limit * per_cell[1], wz = limit * per_cell[2];
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    const unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    ZS_FOR_PARTS(part)
    {
      const zs_lanes column = zs_lanes_ascending() + (float)part;
      const zs_lanes has_lower = zs_lanes_select(column > 0, one, zero);
      const zs_lanes has_upper = zs_lanes_select(column < ZS_BRICK - 1, one, zero);
      const float *at = f + row * ZS_BRICK + part;
      const zs_lanes v = zs_lanes_load(at);
      const zs_lanes y0 = zs_lanes_load(y ? at - ZS_BRICK : at);
      const zs_lanes y1 = zs_lanes_load(y + 1 < ZS_BRICK ? at + ZS_BRICK : at);
      const zs_lanes z0 = zs_lanes_load(z ? at - ZS_BRICK_ROWS : at);
      const zs_lanes z1 = zs_lanes_load(z + 1 < ZS_BRICK ? at + ZS_BRICK_ROWS : at);
      const zs_lanes dx =
        wx * zs_lanes_larger(has_lower * step_between(load_anywhere(at - 1), v),
                             has_upper * step_between(load_anywhere(at + 1), v));
      const zs_lanes dy = wy * zs_lanes_larger(step_between(y0, v), step_between(y1, v));
      const zs_lanes dz = wz * zs_lanes_larger(step_between(z0, v), step_between(z1, v));
      zs_set_bits(&close[row], part, v * v < dx * dx + dy * dy + dz * dz);
    }
    close[row] &= (uint16_t)with_edges(crossing, row);
  }
}

/* Length of a gradient or the like, without overflow; NaN for that of zeros. */
static inline zs_lanes length_of(const zs_lanes g[3])
{
  const zs_lanes most = zs_lanes_larger(
    zs_lanes_absolute(g[0]), zs_lanes_larger(zs_lanes_absolute(g[1]), zs_lanes_absolute(g[2])));
  const zs_lanes u = g[0] / most, v = g[1] / most, w = g[2] / most;
  return most * zs_lanes_square_root(u * u + v * v + w * w);
}

static inline void load_gradient(const float gradient[3][ZS_BLOCK], unsigned i, zs_lanes g[3])
{
  for (int k = 0; k < 3; k++)
    g[k] = zs_lanes_load(gradient[k] + i);
}

static void find_steps(unsigned n, const float *f, const float gradient[3][ZS_BLOCK], float reach,
                       float *step)
{
  for (unsigned i = 0; i < n; i += ZS_WIDTH) {
    zs_lanes g[3];
    load_gradient(gradient, i, g);
    const zs_lanes v = zs_lanes_load(f + i), slope = length_of(g);
    const zs_lanes missing = (reach - zs_lanes_absolute(v) / slope) / slope;
    const zs_lanes outward = zs_lanes_select(v >= 0, missing, -missing);
    const zs_lanes_mask move = (missing > 0) & (slope < INFINITY);
    zs_lanes_store(step + i, zs_lanes_select(move, outward, zs_lanes_all(0)));
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

/* ---- Lists of edges --------------------------------------------------------------------
 *
 * Few rows of a brick have edges, and those have few: a loop over the bits of a row
 * ends where no processor expects it.  A run of bits at a time, there is none. */

typedef float run_floats __attribute__((vector_size(ZS_EDGE_RUN * sizeof(float))));
typedef int32_t run_numbers __attribute__((vector_size(ZS_EDGE_RUN * sizeof(int32_t))));
typedef uint16_t run_edges __attribute__((vector_size(ZS_EDGE_RUN * sizeof(uint16_t))));
typedef uint8_t run_places __attribute__((vector_size(ZS_EDGE_RUN)));

static const run_numbers RUN = {0, 1, 2, 3, 4, 5, 6, 7};

static inline run_numbers load_places(const uint8_t from[ZS_EDGE_RUN])
{
  run_places places;
  memcpy(&places, from, sizeof places);
  return __builtin_convertvector(places, run_numbers);
}

static inline run_floats load_run(const float *from)
{
  run_floats run;
  memcpy(&run, from, sizeof run);
  return run;
}

static inline void store_run(float *to, run_floats run)
{
  memcpy(to, &run, sizeof run);
}

static inline run_floats select_run(run_numbers mask, run_floats yes, run_floats no)
{
  return (run_floats)((mask & (run_numbers)yes) | (~mask & (run_numbers)no));
}

/* The bits of a row that belong to a part. */
static inline unsigned run_of(unsigned bits, const zs_part *part)
{
  return bits >> part->first[0] & ((1u << ZS_EDGE_RUN) - 1);
}

/* The rows of a part that have edges in it. */
static inline unsigned rows_with_edges(const zs_row_bits crossing[3], const zs_part *part,
                                       uint8_t rows[ZS_PART_ROWS])
{
  unsigned count = 0;
  for (unsigned i = 0; i < ZS_PART_ROWS; i++) {
    const unsigned row = zs_part_row(part, i);
    rows[count] = (uint8_t)row;
    count += run_of(crossing[0][row] | crossing[1][row] | crossing[2][row], part) != 0;
  }
  return count;
}

static unsigned find_ends(const float *f, const zs_row_bits crossing[3],
                          const zs_bit_table *table, float *inner, float *outer)
{
  static const unsigned stride[3] = {1, ZS_BRICK, ZS_BRICK_ROWS};
  unsigned count = 0;
  for (unsigned l = 0; l < ZS_PARTS; l++) {
    const zs_part part = zs_part_at(l);
    uint8_t rows[ZS_PART_ROWS];
    const unsigned row_count = rows_with_edges(crossing, &part, rows);
    for (unsigned i = 0; i < row_count; i++) {
      const unsigned row = rows[i];
      for (unsigned axis = 0; axis < 3; axis++) {
        const unsigned bits = run_of(crossing[axis][row], &part);
        const float *start = f + row * ZS_BRICK + part.first[0];
        const run_floats a = load_run(start), b = load_run(start + stride[axis]);
        const run_numbers places = load_places(table->places[bits]);
        /* One end is inside, the other is not. */
        store_run(inner + count, __builtin_shuffle(select_run(a > b, a, b), places));
        store_run(outer + count, __builtin_shuffle(select_run(a > b, b, a), places));
        count += table->counts[bits];
      }
    }
  }
  return count;
}

static void list_edges(const zs_brick *brick, const zs_row_bits inner_edges[3],
                       const zs_bit_table *table, zs_edge_list *list)
{
  static const float none[ZS_EDGE_RUN];
  const unsigned any = brick->ends ? ~0u : 0;
  const float *inner = any ? brick->ends : none, *outer = inner + (any & brick->end_count);
  const run_floats unknown = (run_floats){0} + NAN;
  unsigned count = 0;
  for (unsigned l = 0; l < ZS_PARTS; l++) {
    const zs_part part = zs_part_at(l);
    list->first[l] = count;
    uint8_t rows[ZS_PART_ROWS];
    const unsigned row_count = rows_with_edges(brick->crossing, &part, rows);
    for (unsigned i = 0; i < row_count; i++) {
      const unsigned row = rows[i];
      uint32_t vertex = (uint32_t)brick->first_vertex + brick->first[row];
      for (unsigned axis = 0; axis < 3; axis++) {
        const unsigned all = brick->crossing[axis][row], bits = run_of(all, &part);
        const unsigned known = table->counts[bits & any & run_of(inner_edges[axis][row], &part)];
        const run_numbers places = load_places(table->places[bits]);
        const run_numbers inside = (int)run_of(brick->signs[row], &part) >> places & 1;
        const run_numbers edges = (places + (int)(row * ZS_BRICK + part.first[0])) |
                                  (int)(axis << ZS_EDGE_AXIS) | inside << ZS_EDGE_INSIDE;
        const run_edges short_edges = __builtin_convertvector(edges, run_edges);
        const run_numbers vertices =
          RUN + (int)(vertex + table->counts[all & ((1u << part.first[0]) - 1)]);
        memcpy(list->edge + count, &short_edges, sizeof short_edges);
        memcpy(list->vertex + count, &vertices, sizeof vertices);
        store_run(list->f_inner + count, select_run(RUN < (int)known, load_run(inner), unknown));
        store_run(list->f_outer + count, select_run(RUN < (int)known, load_run(outer), unknown));
        inner += known;
        outer += known;
        vertex += table->counts[all & 255] + table->counts[all >> 8];
        count += table->counts[bits];
      }
    }
  }
  list->first[ZS_PARTS] = count;
}

static void number_edges(const zs_brick *brick, const zs_bit_table *table,
                         zs_edge_numbers numbers)
{
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    if (!zs_row_has(brick->crossing, row))
      continue;
    uint32_t number = (uint32_t)brick->first_vertex + brick->first[row];
    uint32_t *at = numbers + zs_reach_offset(0, row % ZS_BRICK, row / ZS_BRICK);
    for (unsigned axis = 0; axis < 3; axis++, at += ZS_REACH_CORNERS)
      for (unsigned x = 0; x < ZS_BRICK; x += ZS_EDGE_RUN) {
        const unsigned bits = brick->crossing[axis][row] >> x & ((1u << ZS_EDGE_RUN) - 1);
        const run_numbers run = load_places(table->below[bits]) + (int)number;
        memcpy(at + x, &run, sizeof run);
        number += table->counts[bits];
      }
  }
}

/* ---- Vertices -------------------------------------------------------------------------- */

static void find_lines(unsigned n, const uint16_t *edges, const double cell[3], zs_roots *roots)
{
  for (unsigned i = 0; i < n; i += ZS_WIDTH) {
    zs_lanes_mask edge;
    for (unsigned l = 0; l < ZS_WIDTH; l++)
      edge[l] = edges[i + l];
    const zs_lanes_mask axis = edge >> ZS_EDGE_AXIS & 3;
    const zs_lanes_mask inside = (edge >> ZS_EDGE_INSIDE & 1) != 0;
    for (int k = 0; k < 3; k++) {
      const float side = (float)cell[k];
      const zs_lanes_mask place = (edge >> 4 * k & (ZS_BRICK - 1)) - ZS_BRICK / 2;
      const zs_lanes start = side * __builtin_convertvector(place, zs_lanes);
      const zs_lanes step = zs_lanes_select(axis == k, zs_lanes_all(side), zs_lanes_all(0));
      zs_lanes_store(roots->from[k] + i, zs_lanes_select(inside, start, start + step));
      zs_lanes_store(roots->along[k] + i, zs_lanes_select(inside, step, -step));
    }
  }
}

static void find_normals(unsigned n, float gradient[3][ZS_BLOCK])
{
  for (unsigned i = 0; i < n; i += ZS_WIDTH) {
    zs_lanes g[3];
    load_gradient((const float(*)[ZS_BLOCK])gradient, i, g);
    const zs_lanes length = length_of(g);
    const zs_lanes_mask there = (length > 0) & (length < INFINITY);
    for (int k = 0; k < 3; k++)
      zs_lanes_store(gradient[k] + i, zs_lanes_select(there, -g[k] / length, zs_lanes_all(0)));
  }
}

/* A box for each lane. */
typedef struct lane_boxes {
  zs_lanes lo[3], hi[3];
} lane_boxes;

/* Extend the boxes by normals that are `among`. */
static inline void extend(lane_boxes *boxes, const zs_lanes normal[3], zs_lanes_mask among)
{
  for (int k = 0; k < 3; k++) {
    const zs_lanes lo = zs_lanes_select(among, normal[k], zs_lanes_all(INFINITY));
    const zs_lanes hi = zs_lanes_select(among, normal[k], zs_lanes_all(-INFINITY));
    boxes->lo[k] = zs_lanes_smaller(boxes->lo[k], lo);
    boxes->hi[k] = zs_lanes_larger(boxes->hi[k], hi);
  }
}

static void join(const lane_boxes *boxes, zs_normal_box *box)
{
  for (int k = 0; k < 3; k++)
    for (unsigned l = 0; l < ZS_WIDTH; l++) {
      const float lo = boxes->lo[k][l], hi = boxes->hi[k][l];
      box->lo[k] = lo < box->lo[k] ? lo : box->lo[k];
      box->hi[k] = hi > box->hi[k] ? hi : box->hi[k];
    }
}

enum { SIDES = 3, BOXES = SIDES + 1 /* the last one for all */ };

static void hold_normals(unsigned n, const float normal[3][ZS_BLOCK], const uint16_t *edges,
                         zs_brick *brick)
{
  lane_boxes boxes[BOXES];
  for (int b = 0; b < BOXES; b++)
    for (int k = 0; k < 3; k++) {
      boxes[b].lo[k] = zs_lanes_all(INFINITY);
      boxes[b].hi[k] = zs_lanes_all(-INFINITY);
    }
  for (unsigned i = 0; i < n; i += ZS_WIDTH) {
    zs_lanes v[3];
    zs_lanes_mask edge, there;
    load_gradient(normal, i, v);
    for (unsigned l = 0; l < ZS_WIDTH; l++) {
      edge[l] = edges[i + l];
      there[l] = i + l < n ? -1 : 0;
    }
    extend(&boxes[SIDES], v, there);
    for (int k = 0; k < SIDES; k++) {
      const zs_lanes_mask in_side = there & ((edge >> 4 * k & (ZS_BRICK - 1)) == 0) &
                                    ((edge >> ZS_EDGE_AXIS & 3) != k);
      if (zs_lanes_bits(in_side))
        extend(&boxes[k], v, in_side);
    }
  }
  join(&boxes[SIDES], &brick->all_normals);
  for (int k = 0; k < SIDES; k++)
    join(&boxes[k], &brick->side_normals[k]);
}

/* Written out so that compilers find the pattern. */
static void pack(unsigned n, const float from[3][ZS_BLOCK], float *packed)
{
  const float *x = from[0], *y = from[1], *z = from[2];
#pragma omp simd
  for (size_t i = 0; i < n; i++) {
    packed[3 * i] = x[i];
    packed[3 * i + 1] = y[i];
    packed[3 * i + 2] = z[i];
  }
}

static void find_places(unsigned n, const float place[3][ZS_BLOCK], const double origin[3],
                        float *packed)
{
  float moved[3][ZS_BLOCK];
  for (int k = 0; k < 3; k++) {
    const double from = origin[k];
#pragma omp simd
    for (size_t i = 0; i < n; i++)
      moved[k][i] = (float)(from + (double)place[k][i]);
  }
  pack(n, (const float(*)[ZS_BLOCK])moved, packed);
}

const zs_row_kernels ZS_KERNELS(zs_row_kernels) = {
  .signs = find_signs,
  .inner = find_inner,
  .close = find_close,
  .crossing = find_crossing,
  .first = find_first,
  .cells = find_cells,
  .ends = find_ends,
  .edges = list_edges,
  .numbers = number_edges,
  .lines = find_lines,
  .normals = find_normals,
  .hold = hold_normals,
  .pack = pack,
  .places = find_places,
  .steps = find_steps,
};
