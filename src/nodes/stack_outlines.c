/* Slices from drawn outlines: SVG files, the groups of one, and polygons in text files. */
#include "nodes/stack.h"

#include "base/array.h"
#include "base/names.h"
#include "field/program.h"
#include "files/image.h"
#include "files/rings.h"
#include "files/svg.h"
#include "files/volume_read.h"
#include "nodes/outlined.h"
#include "samples/polygon.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Pixels along the longest side when their size is not given. */
enum { ACROSS = 128 };
/* How far chords may be from curves: in pixels, or by the size of the whole. */
static const double TOLERANCE = 0.01, TOLERANCE_OF_WHOLE = 1e-5;

/* What is enclosed in each slice. */
typedef struct drawing {
  const zs_node *node;
  zs_fill *fills;
  size_t count, capacity; /* of those that are kept */
  size_t total;           /* slices in the files */
} drawing;

bool zs_stack_is_outline(const char *path)
{
  static const char *const endings[] = {".svg", ".txt", ".csv", ".xy"};
  for (size_t i = 0; i < ZS_COUNT_OF(endings); i++)
    if (zs_name_ends_in(path, endings[i]))
      return true;
  return false;
}

/* Room for the next slice; NULL after reporting. */
static zs_fill *next_fill(drawing *d, zs_diag *diag)
{
  zs_fill *fills = zs_array_grown(d->fills, d->count + 1, &d->capacity, sizeof *fills);
  if (!fills) {
    zs_fail_memory(diag);
    return NULL;
  }
  d->fills = fills;
  fills[d->count] = (zs_fill){0};
  return &fills[d->count++];
}

/* Whether the next slice is one of every n-th. */
static bool is_wanted(drawing *d)
{
  const struct stack *p = d->node->parameters;
  return d->total++ % (size_t)p->every == 0;
}

/* ---- Files -------------------------------------------------------------------------------- */

static bool add_outline(drawing *d, const zs_outline *outline, const char *name, zs_diag *diag)
{
  const struct stack *p = d->node->parameters;
  const bool given = zs_node_has(d->node, "pixel");
  zs_fill *fill = next_fill(d, diag);
  if (!fill || outline->stroke_count == 0)
    return fill;
  return zs_outlined_fill(outline, given ? TOLERANCE * p->pixel : TOLERANCE_OF_WHOLE, given,
                          d->node, "src", name, fill, diag);
}

static bool read_groups(drawing *d, const char *path, zs_diag *diag)
{
  const struct stack *p = d->node->parameters;
  zs_svg_groups all;
  bool done = zs_svg_read_groups(&all, path, p->y == ZS_IMAGE_Y_DOWN, diag);
  for (size_t i = 0; done && i < all.count; i++)
    done = !is_wanted(d) || add_outline(d, &all.groups[i].outline, all.groups[i].name, diag);
  zs_svg_groups_clear(&all);
  return done;
}

static bool read_svg(drawing *d, const char *path, zs_diag *diag)
{
  const struct stack *p = d->node->parameters;
  zs_outline outline;
  const bool done = zs_svg_read(&outline, path, NULL, p->y == ZS_IMAGE_Y_DOWN, diag) &&
                    add_outline(d, &outline, zs_stack_file_name(path), diag);
  zs_outline_clear(&outline);
  return done;
}

/* Rings inside others are holes. */
static bool read_rings(drawing *d, const char *path, zs_diag *diag)
{
  zs_rings rings;
  if (!zs_rings_read(&rings, path, diag))
    return false;
  zs_fill *fill = next_fill(d, diag);
  zs_fill_result result = ZS_FILL_MEMORY;
  if (fill && zs_fill_add_rings(fill, rings.points, rings.ends, rings.ring_count))
    result = fill->count ? zs_fill_resolve(fill, true) : ZS_FILL_EMPTY;
  else if (fill)
    zs_fail_memory(diag);
  zs_rings_clear(&rings);
  if (result == ZS_FILL_EMPTY || result == ZS_FILL_UNCLEAR)
    zs_node_fail(d->node, diag, "src", "'%.80s': the polygons %s", zs_stack_file_name(path),
                 result == ZS_FILL_EMPTY ? "enclose nothing"
                                         : "lie too close to each other to tell what they enclose");
  return result == ZS_FILL_DONE;
}

static bool read_files(drawing *d, zs_diag *diag)
{
  const struct stack *p = d->node->parameters;
  if (p->src.count == 1 && zs_name_ends_in(p->src.paths[0], ".svg"))
    return read_groups(d, p->src.paths[0], diag);
  for (size_t i = 0; i < p->src.count; i++) {
    const char *path = p->src.paths[i];
    if (is_wanted(d) && !(zs_name_ends_in(path, ".svg") ? read_svg(d, path, diag)
                                                : read_rings(d, path, diag)))
      return false;
  }
  return true;
}

/* ---- Grids -------------------------------------------------------------------------------- */

/* The lattice that all slices are drawn on. */
typedef struct lattice {
  double corner[2], pixel; /* the least x and y */
  size_t width, height;
} lattice;

/* False after reporting. */
static bool find_lattice(const drawing *d, lattice *to, zs_diag *diag)
{
  const struct stack *p = d->node->parameters;
  double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY}, size[2];
  for (size_t i = 0; i < d->count; i++)
    for (size_t e = 0; e < d->fills[i].count; e++)
      for (int k = 0; k < 4; k++) {
        lo[k % 2] = fmin(lo[k % 2], d->fills[i].edges[e][k]);
        hi[k % 2] = fmax(hi[k % 2], d->fills[i].edges[e][k]);
      }
  for (int k = 0; k < 2; k++)
    size[k] = hi[k] - lo[k];
  if (!(size[0] > 0 && size[1] > 0))
    return zs_node_fail(d->node, diag, "src", "all %zu slices are empty", d->count);
  to->pixel = zs_node_has(d->node, "pixel") ? p->pixel : fmax(size[0], size[1]) / ACROSS;
  for (int k = 0; k < 2; k++) {
    /* A pixel more on each side: sides of whole pixels then lie between the centres. */
    size[k] = ceil(size[k] / to->pixel) + 2;
    to->corner[k] = (lo[k] + hi[k] - size[k] * to->pixel) / 2;
  }
  if (!(size[0] <= ZS_IMAGE_LARGEST && size[1] <= ZS_IMAGE_LARGEST &&
        size[0] * size[1] * (double)d->count <= ZS_VOLUME_MOST))
    return zs_node_fail(d->node, diag, zs_node_has(d->node, "pixel") ? "pixel" : "src",
                        "the slices have %g x %g pixels of %g; expected at most %d each way, and "
                        "%d in all %zu", size[0], size[1], to->pixel, ZS_IMAGE_LARGEST,
                        ZS_VOLUME_MOST, d->count);
  to->width = (size_t)size[0];
  to->height = (size_t)size[1];
  return true;
}

/* Distances in pixels, margins included, rows from the top; NULL when memory is out. */
static float *measured(const lattice *l, const zs_polygon *polygon, const double centre[2],
                       unsigned threads)
{
  enum { MARGIN = ZS_SLICES_MARGIN };
  const size_t width = l->width + 2 * MARGIN, height = l->height + 2 * MARGIN;
  float *distance = malloc(width * height * sizeof *distance);
  if (!distance)
    return NULL;
#pragma omp parallel for schedule(dynamic, 8) num_threads(threads)
  for (size_t j = 0; j < height; j++)
    for (size_t i = 0; i < width; i++) {
      const double x = l->corner[0] + ((double)i - MARGIN + 0.5) * l->pixel;
      const double y = l->corner[1] + ((double)height - MARGIN - 0.5 - (double)j) * l->pixel;
      distance[j * width + i] =
        (float)(zs_polygon_distance(polygon, x - centre[0], y - centre[1], NULL) / l->pixel);
    }
  return distance;
}

/* Whether some pixel is inside. */
static bool has_inside(const lattice *l, const float *distance)
{
  const size_t margins = 2 * ZS_SLICES_MARGIN;
  const size_t n = (l->width + margins) * (l->height + margins);
  for (size_t i = 0; i < n; i++)
    if (distance[i] >= 0)
      return true;
  return false;
}

/* Coordinates are moved to the middle of the lattice, where precision is best.  An outline between
 * the pixels' centres leaves the slice empty. */
static bool add_slice(zs_slices *slices, const lattice *l, zs_fill *fill, double at,
                      unsigned threads)
{
  const double centre[2] = {l->corner[0] + (double)l->width * l->pixel / 2,
                            l->corner[1] + (double)l->height * l->pixel / 2};
  zs_arena arena = {0};
  float *distance = NULL;
  if (fill->count > 0) {
    for (size_t e = 0; e < fill->count; e++)
      for (int k = 0; k < 4; k++)
        fill->edges[e][k] -= centre[k % 2];
    const zs_polygon *polygon = zs_polygon_of_edges(&arena, fill->edges, fill->count);
    distance = polygon ? measured(l, polygon, centre, threads) : NULL;
    if (!distance) {
      zs_arena_free(&arena);
      return false;
    }
  }
  zs_arena_free(&arena);
  if (distance && !has_inside(l, distance)) {
    free(distance);
    distance = NULL;
  }
  return zs_slices_add_distance(slices, l->width, l->height, distance, at);
}

static bool draw(zs_stack_read *read, const drawing *d, const lattice *l, const zs_control *control,
                 zs_diag *diag)
{
  const struct stack *p = d->node->parameters;
  const unsigned threads = zs_control_threads(control);
  for (size_t k = 0; k < d->count; k++) {
    const double z = zs_stack_height(d->node, k) / l->pixel;
    if (!add_slice(&read->slices, l, &d->fills[k], z, threads))
      return zs_fail_memory(diag);
  }
  const zs_image_place place = {
    l->pixel, (double)l->height,
    {p->origin[0] + l->corner[0], p->origin[1] + l->corner[1], zs_stack_first(d->node)}, false};
  zs_image_matrix(&place, read->matrix);
  read->pixel = l->pixel;
  return true;
}

bool zs_stack_read_outlines(zs_stack_read *read, const zs_node *node, const zs_control *control,
                            zs_diag *diag)
{
  drawing d = {.node = node};
  lattice l;
  const bool done = read_files(&d, diag) && zs_stack_check_levels(node, d.total, "slices", diag) &&
                    find_lattice(&d, &l, diag) && draw(read, &d, &l, control, diag);
  for (size_t i = 0; i < d.count; i++)
    zs_fill_clear(&d.fills[i]);
  free(d.fills);
  return done;
}
