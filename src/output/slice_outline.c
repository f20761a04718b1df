/* Lines where a slice's values are some number: marching squares, with the solid on one side of
 * every line all the way. */
#include "output/slice.h"

#include "field/program.h"

#include <stdlib.h>
#include <string.h>

/* Samples as the picture has them, with one more all around that has no value. */
typedef struct samples {
  const zs_slicer *slicer;
  float level;
  bool whole; /* samples without a value are outside; else no line is there */
  uint32_t width, height;
  zs_eval *eval; /* of whole outlines: what they are refined by */
} samples;

static float value_at(const samples *s, uint32_t i, uint32_t j)
{
  const zs_slice_plane *p = &s->slicer->plane;
  if (i == 0 || j == 0 || i > p->count[0] || j > p->count[1])
    return NAN;
  const size_t at = (size_t)(p->row + j - 1) * p->width + p->column + i - 1;
  return s->slicer->values ? s->slicer->values[at] : s->slicer->pixels[at] ? 1 : -1;
}

static bool is_inside(const samples *s, float value)
{
  return value >= s->level; /* no for NaN */
}

/* Edges between samples: number 2 k from sample k to the right, 2 k + 1 down. */
static uint32_t edge_of(const samples *s, uint32_t i, uint32_t j, unsigned side)
{
  static const unsigned right[4] = {0, 1, 0, 0}, down[4] = {0, 0, 1, 0};
  return 2 * ((j + down[side]) * s->width + i + right[side]) + (side % 2);
}

/* Lines as lists of edges: the one after each, and whether there is one before. */
enum { NONE = UINT32_MAX };
typedef struct lines {
  uint32_t *next;
  bool *follows;
} lines;

static void connect(lines *l, uint32_t from, uint32_t to)
{
  l->next[from] = to;
  l->follows[to] = true;
}

/* The lines through the square whose first corner is sample (i, j): from each edge where, going
 * around, the inside begins, to one where it ends.  When opposite corners are inside the mean
 * says whether they are joined. */
static void add_square(const samples *s, uint32_t i, uint32_t j, lines *l)
{
  const float f[4] = {value_at(s, i, j), value_at(s, i + 1, j), value_at(s, i + 1, j + 1),
                      value_at(s, i, j + 1)};
  uint32_t begins[2], ends[2];
  unsigned count = 0;
  for (unsigned k = 0; k < 4; k++)
    if (!s->whole && isnan(f[k]))
      return;
  for (unsigned k = 0; k < 4; k++) {
    if (is_inside(s, f[k]) || !is_inside(s, f[(k + 1) % 4]))
      continue;
    begins[count] = edge_of(s, i, j, k);
    unsigned end = (k + 1) % 4;
    while (is_inside(s, f[(end + 1) % 4]))
      end = (end + 1) % 4;
    ends[count++] = edge_of(s, i, j, end);
  }
  const bool joined = count == 2 && is_inside(s, (f[0] + f[1] + f[2] + f[3]) / 4);
  for (unsigned k = 0; k < count; k++)
    connect(l, begins[k], ends[joined ? 1 - k : k]);
}

/* ---- Places ------------------------------------------------------------------------------ */

/* The samples at both ends of an edge, the one inside first, as places in the picture; returns
 * where between them the line is, by their values. */
static double ends_of(const samples *s, uint32_t edge, double ends[2][2], bool *known)
{
  const zs_slice_plane *p = &s->slicer->plane;
  const uint32_t k = edge / 2, at[2] = {k % s->width, k / s->width};
  const uint32_t other[2] = {at[0] + !(edge % 2), at[1] + edge % 2};
  const float f[2] = {value_at(s, at[0], at[1]), value_at(s, other[0], other[1])};
  const int in = is_inside(s, f[0]) ? 0 : 1;
  const uint32_t *corner[2] = {at, other};
  for (int e = 0; e < 2; e++) {
    ends[e][0] = p->column + corner[e ^ in][0] - 0.5;
    ends[e][1] = p->row + corner[e ^ in][1] - 0.5;
  }
  *known = !isnan(f[0]) && !isnan(f[1]);
  const float t = (s->level - f[in]) / (f[1 - in] - f[in]);
  return t >= 0 && t <= 1 ? (double)t : 0.5; /* NaN and infinities: half-way */
}

/* Places on the plane where f changes its sign between samples, by halving. */
static void refine(const samples *s, const uint32_t *edges, size_t count, double (*places)[2])
{
  enum { BATCH = 256, HALVINGS = 22 };
  static const double corner[2] = {0, 0};
  double origin[3];
  zs_slice_place(&s->slicer->plane, corner, origin);
  for (size_t first = 0; first < count; first += BATCH) {
    const size_t n = count - first < BATCH ? count - first : BATCH;
    double ends[BATCH][2][2], from[BATCH], to[BATCH];
    bool known[BATCH];
    float x[BATCH], y[BATCH], z[BATCH], f[BATCH];
    for (size_t i = 0; i < n; i++) {
      ends_of(s, edges[first + i], ends[i], &known[i]);
      from[i] = 0;
      to[i] = 1;
    }
    for (int k = 0; k < HALVINGS; k++) {
      for (size_t i = 0; i < n; i++) {
        const double t = (from[i] + to[i]) / 2;
        const double at[2] = {(1 - t) * ends[i][0][0] + t * ends[i][1][0],
                              (1 - t) * ends[i][0][1] + t * ends[i][1][1]};
        double space[3];
        zs_slice_place(&s->slicer->plane, at, space);
        x[i] = (float)(space[0] - origin[0]);
        y[i] = (float)(space[1] - origin[1]);
        z[i] = (float)(space[2] - origin[2]);
      }
      zs_eval_values(s->eval, origin, n, x, y, z, f);
      for (size_t i = 0; i < n; i++)
        *(f[i] >= 0 ? &from[i] : &to[i]) = (from[i] + to[i]) / 2;
    }
    for (size_t i = 0; i < n; i++)
      for (int k = 0; known[i] && k < 2; k++)
        places[first + i][k] = (1 - from[i]) * ends[i][0][k] + from[i] * ends[i][1][k];
  }
}

/* ---- Lines ------------------------------------------------------------------------------- */

/* The edges of the line that goes through one, which are then done with. */
static size_t take_line(lines *l, uint32_t first, uint32_t *edges)
{
  size_t count = 0;
  uint32_t edge = first;
  do {
    edges[count++] = edge;
    const uint32_t next = l->next[edge];
    l->next[edge] = NONE;
    l->follows[edge] = false;
    edge = next;
  } while (edge != NONE && edge != first);
  return count;
}

static bool add_line(const samples *s, const uint32_t *edges, size_t count, bool closed,
                     double (*places)[2], zs_drawing *drawing)
{
  for (size_t i = 0; i < count; i++) {
    double ends[2][2];
    bool known;
    const double t = ends_of(s, edges[i], ends, &known);
    for (int k = 0; k < 2; k++)
      places[i][k] = (1 - t) * ends[0][k] + t * ends[1][k];
  }
  if (s->whole)
    refine(s, edges, count, places);
  bool good = zs_drawing_stroke(drawing, (zs_color){0, 0, 0}, 0, closed);
  for (size_t i = 0; i < count && good; i++)
    good = zs_drawing_point(drawing, places[i]);
  return good;
}

bool zs_slice_outline(zs_drawing *drawing, const zs_slicer *slicer, zs_field *field, float level,
                      bool whole)
{
  const uint32_t *count = slicer->plane.count;
  const samples s = {.slicer = slicer,
                     .level = level,
                     .whole = whole,
                     .width = count[0] + 2,
                     .height = count[1] + 2,
                     .eval = whole ? zs_eval_new(field, NULL) : NULL};
  const size_t n = 2 * (size_t)s.width * s.height;
  lines l = {malloc(n * sizeof *l.next), calloc(n, sizeof *l.follows)};
  uint32_t *edges = malloc(n * sizeof *edges);
  double(*places)[2] = malloc(n * sizeof *places);
  bool good = l.next && l.follows && edges && places && (s.eval || !whole);
  if (good)
    memset(l.next, 0xff, n * sizeof *l.next);
  for (uint32_t j = 0; j + 1 < s.height && good; j++)
    for (uint32_t i = 0; i + 1 < s.width; i++)
      add_square(&s, i, j, &l);
  /* Open lines first, from where they begin; what is left goes around. */
  for (int open = 1; open >= 0 && good; open--)
    for (uint32_t i = 0; i < n && good; i++)
      if (l.next[i] != NONE && !(open && l.follows[i])) {
        const size_t used = take_line(&l, i, edges);
        good = add_line(&s, edges, used, !open, places, drawing);
      }
  zs_eval_free(s.eval);
  free(l.next);
  free(l.follows);
  free(edges);
  free(places);
  return good;
}
