/* Slices in files, joined into a solid. */
#include "nodes/stack.h"

#include "base/key.h"
#include "base/names.h"
#include "files/volume_read.h"
#include "scene/tree.h"
#include "stack/join.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { CLOSED, OPEN };
enum { C0, C1 };
static const char *const methods[] = {"auto", "linear", "extended", "variational", NULL};
/* By the number of the choice. */
static const zs_join_method join_methods[] = {ZS_JOIN_AUTO, ZS_JOIN_LINEAR, ZS_JOIN_EXTENDED,
                                              ZS_JOIN_VARIATIONAL};
static const char *const continuities[] = {"c0", "c1", NULL};
static const char *const caps[] = {"closed", "open", NULL};

static const zs_attribute attributes[] = {
  {.name = "src", .type = ZS_FILES, .offset = offsetof(struct stack, src), .unit = "",
   .doc = "the slices: PNG, PGM or TIFF files by a pattern, such as `slices/*.png`, in natural "
          "order (9 before 10); the pages of one TIFF file; SVG files, the groups of one SVG file, or "
          "text files of polygons (.txt, .csv, .xy), by the same pattern; or one NRRD, MHD, NIfTI or "
          "VTI volume, in its own coordinates"},
  ZS_LENGTH(struct stack, spacing, "spacing", "1", ZS_RANGE_POSITIVE,
            "how far the files' slices are apart"),
  {.name = "levels", .type = ZS_NUMBERS, .offset = offsetof(struct stack, levels),
   .initial = "", .unit = "length",
   .doc = "instead of `spacing`: where each file's slice lies, ascending; z of `origin` is then "
          "left out"},
  ZS_IMAGE_PIXEL(struct stack, ". Of outlines: how finely f is sampled; a 128th of the longest side "
                               "when it is not given"),
  {.name = "level", .type = ZS_NUMBER, .offset = offsetof(struct stack, level), .initial = "",
   .unit = "1",
   .doc = "inside is what is at least as bright, where 0 is black and 1 is white, or in a volume "
          "as large; 0.5 when it is not given"},
  {.name = "label", .type = ZS_NUMBERS, .offset = offsetof(struct stack, label), .initial = "",
   .unit = "1",
   .doc = "instead of `level`: inside is what has this number in the file, or one of these"},
  {.name = "every", .type = ZS_INTEGER, .offset = offsetof(struct stack, every), .initial = "1",
   .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 1, .maximum = 1e6,
   .doc = "take every n-th slice only, the first one too"},
  ZS_POINT(struct stack, origin, "origin", "0 0 0",
           "where the first picture's corner is that has the least x and y, or the origin of "
           "outlines"),
  ZS_IMAGE_Y(struct stack),
  ZS_SELECT(struct stack, method, "method", "auto", methods,
            "`linear`: distances to the outlines, in straight lines from slice to slice; "
            "`extended`: distances that move with the shapes, by a registration of neighbouring "
            "slices; `variational`: the surface of least bending through the outlines of every "
            "four slices; `auto`: variational, but extended where thin parts move by more than "
            "their thickness, between slices without a common pixel, and of two slices alone"),
  ZS_SELECT(struct stack, continuity, "continuity", "c0", continuities,
            "`c1`: no creases at slices, which only `linear` has: its straight lines become cubics"),
  ZS_SELECT(struct stack, caps, "caps", "closed", caps,
            "`closed`: the solid ends at the first and the last slice; `open`: it goes on as they "
            "are"),
};

static bool check_ascending(const zs_node *node, zs_diag *diag)
{
  const zs_numbers *levels = &((const struct stack *)node->parameters)->levels;
  for (size_t i = 1; i < levels->count; i++)
    if (!(levels->values[i] > levels->values[i - 1]))
      return zs_node_fail(node, diag, "levels", "%g does not lie beyond %g before it",
                          levels->values[i], levels->values[i - 1]);
  return true;
}

/* Files of one sort: pictures, outlines, or one volume. */
static bool check_files(const zs_node *node, zs_diag *diag)
{
  const zs_files *src = &((const struct stack *)node->parameters)->src;
  for (size_t i = 0; i < src->count; i++) {
    const char *name = zs_stack_file_name(src->paths[i]);
    if (src->count > 1 && zs_volume_is_name(name))
      return zs_node_misuse(node, diag, "src", "'%.80s' is a volume; expected one such file, or "
                            "pictures", name);
    if (zs_stack_is_outline(name) != zs_stack_is_outlines(node))
      return zs_node_misuse(node, diag, "src", "'%.80s' is no file like '%.80s'; expected pictures "
                            "or outlines, not both", name, zs_stack_file_name(src->paths[0]));
  }
  return true;
}

/* Outlines are in the scene's coordinates. */
static bool check_outlines(const zs_node *node, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  for (int i = 0; i < 2; i++)
    if (zs_node_has(node, i ? "label" : "level"))
      return zs_node_misuse(node, diag, i ? "label" : "level", "outlines have no %s",
                            i ? "labels" : "brightness");
  if (isnan(p->pixel))
    return zs_node_misuse(node, diag, "pixel", "outlines have no pixels; expected a length");
  for (size_t i = 0; zs_node_has(node, "y") && i < p->src.count; i++)
    if (!zs_name_ends_in(p->src.paths[i], ".svg"))
      return zs_node_misuse(node, diag, "y", "'%.80s' has y as it is",
                            zs_stack_file_name(p->src.paths[i]));
  return true;
}

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  static const char *const of_series[] = {"spacing", "levels", "pixel", "origin", "y"};
  const bool volume = zs_stack_is_volume(node);
  if (!check_files(node, diag) || (zs_stack_is_outlines(node) && !check_outlines(node, diag)))
    return false;
  for (size_t i = 0; volume && i < ZS_COUNT_OF(of_series); i++)
    if (zs_node_has(node, of_series[i]))
      return zs_node_misuse(node, diag, of_series[i], "the volume itself says where it lies");
  for (int i = 0; i < 2; i++)
    if (zs_node_has(node, i ? "label" : "levels") && (i ? p->label : p->levels).count == 0)
      return zs_node_misuse(node, diag, i ? "label" : "levels", "there are no numbers");
  if (zs_node_has(node, "level") && zs_node_has(node, "label"))
    return zs_node_misuse(node, diag, "label", "'label' cannot be combined with 'level'");
  if (zs_node_has(node, "levels") && zs_node_has(node, "spacing"))
    return zs_node_misuse(node, diag, "levels", "'levels' cannot be combined with 'spacing'");
  if (!volume && !isnan(p->level) && !(p->level > 0 && p->level <= 1))
    return zs_node_fail(node, diag, "level", "%g is no brightness; expected more than 0, up to 1",
                        p->level);
  return check_ascending(node, diag);
}

/* ---- Joined slices, as scenes remember them ---------------------------------------------- */

typedef struct shared {
  atomic_uint references;
  zs_joined joined;
  double matrix[12], pixel; /* from the scene to the raster; a pixel's side */
  double hi;                /* the greatest height in the raster; the least is 0 */
} shared;

static void *ref(void *data)
{
  atomic_fetch_add_explicit(&((shared *)data)->references, 1, memory_order_relaxed);
  return data;
}

static void unref(void *data)
{
  shared *s = data;
  if (atomic_fetch_sub_explicit(&s->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_joined_clear(&s->joined);
  free(s);
}

static const zs_cache_type type = {ref, unref};

static zs_join_method method_of(const struct stack *p)
{
  const zs_join_method method = join_methods[p->method];
  return method == ZS_JOIN_LINEAR && p->continuity == C1 ? ZS_JOIN_CUBIC : method;
}

/* What the solid depends on: the attributes, and which state of the files it is. */
static bool key_of(const zs_node *node, uint64_t key[2])
{
  const struct stack *p = node->parameters;
  const double numbers[] = {p->spacing, isnan(p->pixel) ? -1 : p->pixel,
                            isnan(p->level) ? -1 : p->level, isnan(p->level),
                            p->origin[0], p->origin[1], p->origin[2], p->every, method_of(p), p->y,
                            (double)p->label.count, zs_node_has(node, "pixel")};
  zs_key_begin(key, "stack");
  zs_key_add(key, numbers, sizeof numbers);
  zs_key_add(key, p->label.values, p->label.count * sizeof *p->label.values);
  zs_key_add(key, p->levels.values, p->levels.count * sizeof *p->levels.values);
  for (size_t i = 0; i < p->src.count; i++)
    if (!zs_key_add_file(key, p->src.paths[i]))
      return false;
  return true;
}

/* Whether there is something to join. */
static bool check_slices(const zs_node *node, const zs_slices *s, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  bool any = false;
  for (size_t i = 0; i < s->count; i++)
    any = any || s->slices[i].distance;
  if (s->count < 2)
    return zs_node_fail(node, diag, p->every > 1 ? "every" : "src",
                        "found %zu slice%s; expected at least 2", s->count,
                        s->count == 1 ? "" : "s");
  if (any)
    return true;
  if (p->label.count == 1)
    return zs_node_fail(node, diag, "label", "no slice has a %g", p->label.values[0]);
  if (p->label.count)
    return zs_node_fail(node, diag, "label", "no slice has any of the %zu numbers",
                        p->label.count);
  return zs_node_fail(node, diag, zs_node_has(node, "level") ? "level" : "src",
                      "all %zu slices are empty", s->count);
}

static bool join(shared *to, const zs_node *node, const zs_stack_read *read,
                 const zs_control *control, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  const zs_slices *s = &read->slices;
  const zs_join_result result = zs_slices_join(&to->joined, s, method_of(p), control);
  if (result == ZS_JOIN_CANCELLED)
    return zs_fail(diag, ZS_CANCELLED, NULL, "cancelled");
  if (result == ZS_JOIN_MEMORY)
    return zs_fail_memory(diag);
  to->pixel = read->pixel;
  memcpy(to->matrix, read->matrix, sizeof to->matrix);
  for (int k = 0; k < 2; k++)
    to->matrix[4 * k + 3] += (double)s->margin - (double)to->joined.first[k];
  to->matrix[11] -= s->slices[0].height;
  to->hi = s->slices[s->count - 1].height - s->slices[0].height;
  return true;
}

/* NULL after reporting. */
static shared *make(zs_compiler *compiler, const zs_node *node)
{
  const zs_control *control = zs_compiler_control(compiler);
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_stack_read read;
  shared *s = calloc(1, sizeof *s);
  if (!s) {
    zs_fail_memory(diag);
    return NULL;
  }
  atomic_init(&s->references, 1);
  const bool done = zs_stack_read_slices(&read, compiler, node) &&
                    check_slices(node, &read.slices, diag) && join(s, node, &read, control, diag);
  zs_slices_clear(&read.slices);
  if (done)
    return s;
  unref(s);
  return NULL;
}

static shared *find(zs_compiler *compiler, const zs_node *node)
{
  struct zs_cache *cache = zs_compiler_cache(compiler);
  uint64_t key[2];
  const bool has_key = key_of(node, key);
  shared *s = has_key ? zs_cache_find(cache, key, &type) : NULL;
  if (s)
    return s;
  s = make(compiler, node);
  /* What cannot be remembered is only made again. */
  if (s && has_key && cache)
    zs_cache_add(cache, key, &type, s);
  return s;
}

/* Tell what moves between two slices: ways of the same height. */
static void tell_gap(zs_compiler *compiler, const zs_node *node, const shared *s,
                     const zs_join_way *ways, size_t count, const zs_coordinates *own)
{
  zs_correspondence all = {.element = node->kind->name, .line = node->place.line, .found = true,
                           .count = count, .places = 2};
  double *places = ZS_ARENA_NEW(zs_compiler_arena(compiler), double, 3 * (2 * count + 2));
  if (!places) {
    zs_fail_memory(zs_compiler_diag(compiler));
    return;
  }
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 3; k++) {
      places[6 * i + k] = (double)ways[i].from[k];
      places[6 * i + 3 + k] = (double)ways[i].to[k];
    }
  const double first = zs_stack_is_volume(node) ? 0 : zs_stack_first(node);
  const double heights[2] = {(double)ways[0].from[2], (double)ways[0].to[2]};
  for (int k = 0; k < 2; k++)
    all.level[k] = first + heights[k] * s->pixel;
  zs_correspondence_tell(compiler, &all, places, heights, own);
}

static void tell_ways(zs_compiler *compiler, const zs_node *node, const shared *s,
                      const zs_coordinates *own)
{
  const zs_joined *j = &s->joined;
  for (size_t from = 0, to; from < j->way_count; from = to) {
    for (to = from + 1; to < j->way_count && j->ways[to].from[2] == j->ways[from].from[2];)
      to++;
    tell_gap(compiler, node, s, j->ways + from, to - from, own);
  }
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct stack *p = node->parameters;
  shared *s = find(compiler, node);
  if (!s)
    return zs_emit_constant(compiler, 0);
  const double hi = s->hi, pixel = s->pixel;
  const zs_coordinates own = zs_coordinates_affine(at, s->matrix);
  tell_ways(compiler, node, s, &own);
  if (!zs_compiler_keep(compiler, s, unref))
    return zs_emit_constant(compiler, 0);
  zs_value f = zs_raster_emit(compiler, s->joined.raster, &own);
  const double rounding = 2.5e-7 * fabs(s->matrix[11]); /* of how far away the slices are */
  if (p->caps == CLOSED)
    f = zs_emit_cut(compiler, f, &own, -rounding, hi + rounding);
  return zs_emit_scaled(compiler, f, pixel);
}

const zs_kind zs_kind_stack = {
  .name = "stack",
  .family = ZS_FAMILY_INTERPOLATION,
  .summary = "slices in files, joined into one solid",
  .doc = "White is inside, as in `image`. The surface passes through the outlines of all slices, "
         "smoothly unless the method is linear; where pixels have two values alone it does not follow "
         "their stairs, but every pixel of a slice is on the side that it "
         "is in the file. f is sampled on layers about a pixel apart and interpolated by cubics; "
         "near the surface it is about the distance in the slices' planes; where the pixels of a "
         "volume are not square, the distance in slices that are stretched until they are. Slices "
         "may be empty, but not all of them. `zeroset info` lists what moves between slices with "
         "`extended` or `auto`, and `zeroset slice --correspondence` draws it. The solid is made "
         "once for all uses and all values of parameters.",
  .source = "radial functions: Savchenko et al., \"Function representation of solids "
            "reconstructed from scattered surface points and contours\" (1995); Turk, O'Brien, "
            "\"Shape transformation using variational implicit functions\" (1999)",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct stack),
  .children = ZS_CHILDREN_NONE,
  .check = check,
  .emit = emit,
};
