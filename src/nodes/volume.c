/* Sampled fields from files: density volumes, distance fields, segmentations. */
#include "nodes/sampled.h"

#include "base/key.h"
#include "field/program.h"
#include "files/volume_read.h"
#include "scene/tree.h"

#include <math.h>
#include <stdlib.h>

/* Larger values are as good as endless. */
static const double ENDLESS = 1e30;

struct volume {
  const char *src;
  double level, label;
  int sign, interpolation, outside;
};

static const char *const words[] = {"auto", NULL};
static const char *const signs[] = {"positive", "negative", NULL};
enum { SIGN_POSITIVE };

static const zs_attribute attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct volume, src), .unit = "",
   .doc = "an NRRD, MetaImage (.mhd, .mha), NIfTI-1 (.nii, .nii.gz) or VTK image (.vti) file"},
  {.name = "level", .type = ZS_NUMBER, .offset = offsetof(struct volume, level),
   .initial = "auto", .unit = "1", .choices = words,
   .doc = "the value at the surface; auto is 0 where there are values of both signs, and else half "
          "way between the least and the greatest"},
  ZS_SELECT(struct volume, sign, "sign", "positive", signs,
            "`positive`: inside, values are above the level; `negative`: they are below it, as "
            "distances are in many programs"),
  ZS_PLAIN(struct volume, label, "label", "", ZS_RANGE_ANY,
           "instead of a level, of a segmentation: the solid is where the value is this number"),
  ZS_SAMPLED_ATTRIBUTES(struct volume),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  if (zs_node_has(node, "label") && (zs_node_has(node, "level") || zs_node_has(node, "sign")))
    return zs_node_misuse(node, diag, "label",
                          "'label' cannot be combined with 'level' and 'sign'");
  return true;
}

/* From the file's values to f: scale * (value - level), or 1/2 where the value is the label
 * and -1/2 elsewhere, times scale. */
typedef struct conversion {
  double level, label, scale;
  bool by_label;
} conversion;

static double converted(const conversion *c, double value)
{
  if (c->by_label)
    return value == c->label ? c->scale / 2 : -c->scale / 2;
  return fmin(fmax(c->scale * (value - c->level), -ENDLESS), ENDLESS); /* NaN is -ENDLESS */
}

/* The least and greatest finite value. */
static bool find_extremes(const zs_volume *volume, double *lo, double *hi, zs_diag *diag)
{
  const size_t row = volume->size[0], rows = zs_volume_count(volume) / row;
  double *values = malloc(row * sizeof *values);
  if (!values)
    return zs_fail_memory(diag);
  *lo = INFINITY;
  *hi = -INFINITY;
  for (size_t r = 0; r < rows; r++) {
    zs_volume_values(volume, r * row, row, values);
    for (size_t i = 0; i < row; i++)
      if (isfinite(values[i])) {
        *lo = values[i] < *lo ? values[i] : *lo;
        *hi = values[i] > *hi ? values[i] : *hi;
      }
  }
  free(values);
  return true;
}

/* Decide where the surface is; an error where nothing says so, a warning where there is
 * none. */
static bool choose(conversion *c, const zs_node *node, const zs_volume *volume, zs_diag *diag)
{
  const struct volume *p = node->parameters;
  double lo = 0, hi = 0, side = INFINITY;
  if (!find_extremes(volume, &lo, &hi, diag))
    return false;
  for (int k = 0; k < 3; k++)
    side = fmin(side, hypot(hypot(volume->matrix[k], volume->matrix[4 + k]),
                            volume->matrix[8 + k]));
  *c = (conversion){.level = p->level, .label = p->label, .by_label = !isnan(p->label)};
  c->scale = c->by_label ? side : p->sign == SIGN_POSITIVE ? 1 : -1;
  if (isnan(p->level) && !c->by_label) {
    if (!(lo < hi))
      return zs_node_fail(node, diag, "src", "all samples are the same, %g; 'level' has to say "
                          "whether that is inside", lo);
    c->level = lo < 0 && hi > 0 ? 0 : lo + (hi - lo) / 2;
  }
  const zs_place place = zs_node_place(node, c->by_label ? "label" : "level");
  if (!c->by_label && (converted(c, lo) >= 0) == (converted(c, hi) >= 0))
    zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
              "no surface: the samples are from %g to %g, all on the same side of %g", lo, hi,
              c->level);
  return true;
}

/* Fill in a grid; false when memory is out. */
static bool fill(zs_voxels *voxels, const zs_volume *volume, const conversion *c, unsigned threads)
{
  const uint32_t *size = volume->size;
  bool memory = true;
#pragma omp parallel num_threads(threads) reduction(&& : memory)
  {
    double *values = malloc(size[0] * sizeof *values);
    memory = values != NULL;
#pragma omp for
    for (uint32_t k = 0; k < size[2]; k++)
      for (uint32_t j = 0; values && j < size[1]; j++) {
        float *row = zs_voxels_row(voxels, j, k);
        zs_volume_values(volume, ((size_t)k * size[1] + j) * size[0], size[0], values);
        for (uint32_t i = 0; i < size[0]; i++)
          row[i] = (float)converted(c, values[i]);
      }
    free(values);
  }
  return memory && zs_voxels_finish(voxels, threads);
}

static zs_sampled *sampled_of(const zs_node *node, const zs_volume *volume, unsigned threads,
                              zs_diag *diag)
{
  const struct volume *p = node->parameters;
  const bool cubic = p->interpolation == ZS_SAMPLED_CUBIC;
  double room = 1;
  for (int k = 0; k < 3; k++)
    room *= zs_voxels_room(volume->size[k], cubic);
  conversion c;
  if (!choose(&c, node, volume, diag))
    return NULL;
  zs_voxels *voxels = room <= INT32_MAX ? zs_voxels_new(volume->size, cubic) : NULL;
  zs_sampled *sampled = NULL;
  if (!voxels || !fill(voxels, volume, &c, threads))
    zs_voxels_free(voxels);
  else
    sampled = zs_sampled_new(voxels, volume->size, volume->matrix);
  if (!sampled)
    zs_fail_memory(diag);
  return sampled;
}

/* What the samples depend on: the attributes, and which state of the file it is. */
static bool key_of(const zs_node *node, uint64_t key[2])
{
  const struct volume *p = node->parameters;
  const double numbers[] = {isnan(p->level) ? 0 : p->level, isnan(p->level),
                            isnan(p->label) ? 0 : p->label, isnan(p->label), p->sign,
                            p->interpolation};
  zs_key_begin(key, "volume");
  zs_key_add(key, numbers, sizeof numbers);
  return zs_key_add_file(key, p->src);
}

static zs_sampled *find(zs_compiler *compiler, const zs_node *node)
{
  struct zs_cache *cache = zs_compiler_cache(compiler);
  zs_diag *diag = zs_compiler_diag(compiler);
  uint64_t key[2];
  const bool has_key = key_of(node, key);
  zs_sampled *sampled = has_key ? zs_cache_find(cache, key, &zs_sampled_type) : NULL;
  if (sampled)
    return sampled;
  zs_volume volume;
  if (!zs_volume_read(&volume, ((const struct volume *)node->parameters)->src, diag))
    return NULL;
  sampled = sampled_of(node, &volume, zs_control_threads(zs_compiler_control(compiler)), diag);
  zs_volume_clear(&volume);
  if (sampled && has_key && !zs_cache_add(cache, key, &zs_sampled_type, sampled))
    zs_fail_memory(diag);
  return sampled;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  zs_sampled *sampled = find(compiler, node);
  if (!sampled)
    return zs_emit_constant(compiler, 0);
  return zs_sampled_emit(compiler, sampled, ((const struct volume *)node->parameters)->outside, at);
}

const zs_kind zs_kind_volume = {
  .name = "volume",
  .family = ZS_FAMILY_DATA,
  .summary = "a field sampled on a grid, from a file",
  .doc = "f is the value without the level, in the file's own coordinates: its spacing, directions "
         "and origin count, and its unit of length is taken for the scene's. With `label` f is, "
         "near the surface, about as large as the distance. What is not a number is outside. The file "
         "is read once for all uses and all values of parameters.",
  .source = "B-splines: Unser, Aldroubi, Eden, \"B-spline signal processing\" (1993)",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct volume),
  .children = ZS_CHILDREN_NONE,
  .check = check,
  .emit = emit,
};
