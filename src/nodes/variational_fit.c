/* Fits of <variational>: from samples to constraints to a fit, remembered by
 * all that it depends on. */
#include "nodes/variational.h"

#include "base/key.h"
#include "field/program.h"
#include "rbf/greedy.h"
#include "rbf/normals.h"
#include "rbf/witnesses.h"
#include "scene/tree.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* The automatic length of one unit beyond space, by the size of the largest shape. */
static const double SEPARATION = 0.25;

/* The samples of one shape, or of the whole node when it has none. */
typedef struct group {
  const zs_node *node;
  const double *at; /* beyond space */
  zs_rbf_samples samples;
} group;

/* What a fit depends on. */
typedef struct request {
  const zs_node *node;
  const struct variational *settings;
  const zs_variational_warp *warp;
  unsigned dimension; /* of space */
  unsigned extra;     /* dimensions beyond it */
  group *groups;
  size_t count;
  double separation;
} request;

/* ---- Sharing ------------------------------------------------------------------------ */

struct zs_variational_sum {
  atomic_uint references;
  zs_rbf_sum *sum;
};

static void *fit_ref(void *data)
{
  zs_variational_fit *fit = data;
  atomic_fetch_add_explicit(&fit->references, 1, memory_order_relaxed);
  return fit;
}

void zs_variational_fit_unref(void *data)
{
  zs_variational_fit *fit = data;
  if (atomic_fetch_sub_explicit(&fit->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_rbf_free(fit->rbf);
  free(fit->points);
  free(fit);
}

static void *sum_ref(void *data)
{
  zs_variational_sum *sum = data;
  atomic_fetch_add_explicit(&sum->references, 1, memory_order_relaxed);
  return sum;
}

void zs_variational_sum_unref(void *data)
{
  zs_variational_sum *sum = data;
  if (atomic_fetch_sub_explicit(&sum->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_rbf_sum_free(sum->sum);
  free(sum);
}

const zs_cache_type zs_variational_fit_type = {fit_ref, zs_variational_fit_unref};
static const zs_cache_type sum_type = {sum_ref, zs_variational_sum_unref};

const zs_rbf_sum *zs_variational_sum_data(const zs_variational_sum *sum)
{
  return sum->sum;
}

/* ---- Keys ---------------------------------------------------------------------------- */

/* Mix some numbers into a key. */
static void mix(uint64_t key[2], const double *numbers, size_t count)
{
  zs_key_add(key, numbers, count * sizeof *numbers);
}

static zs_rbf_kernel kernel_of(const request *r)
{
  const int chosen = r->settings->kernel;
  return chosen ? (zs_rbf_kernel)(chosen - 1) : zs_rbf_default_kernel(r->dimension + r->extra);
}

static double number_or(double number, double otherwise)
{
  return isnan(number) ? otherwise : number;
}

/* 0: automatic, or of no meaning. */
static double sigma_of(const request *r)
{
  return kernel_of(r) == ZS_RBF_GAUSSIAN ? number_or(r->settings->sigma, 0) : 0;
}

static void key_of(const request *r, uint64_t key[2])
{
  const struct variational *p = r->settings;
  const double settings[] = {ZS_VARIATIONAL_VERSION,
                             kernel_of(r),
                             sigma_of(r),
                             p->degree,
                             p->smoothing,
                             p->sides,
                             p->budget,
                             r->dimension,
                             r->extra,
                             number_or(p->normal_offset, -1),
                             number_or(p->tolerance, -1),
                             number_or(p->separation, -1)};
  key[0] = r->count;
  key[1] = ~key[0];
  mix(key, settings, ZS_COUNT_OF(settings));
  for (size_t g = 0; g < r->count; g++) {
    const zs_rbf_samples *samples = &r->groups[g].samples;
    const double count = (double)samples->count;
    mix(key, &count, 1);
    mix(key, r->groups[g].at, r->extra);
    for (size_t i = 0; i < samples->count; i++) {
      const zs_rbf_sample *sample = &samples->samples[i];
      const double rest[2] = {sample->value, sample->estimate};
      mix(key, sample->position, 3);
      mix(key, sample->normal, 3);
      mix(key, rest, 2);
    }
  }
  mix(key, r->warp->pairs, 6 * r->warp->pair_count);
}

/* ---- Constraints ---------------------------------------------------------------------- */

/* The constraints of all groups, with their coordinates beyond space. */
typedef struct collection {
  size_t count;
  double *positions, *values;
} collection;

static bool reserve(collection *all, const request *r, size_t total)
{
  const unsigned dimension = r->dimension + r->extra;
  double *positions = realloc(all->positions, (total + 1) * dimension * sizeof *positions);
  all->positions = positions ? positions : all->positions;
  double *values = realloc(all->values, (total + 1) * sizeof *values);
  all->values = values ? values : all->values;
  return positions && values;
}

static bool extend(collection *all, const request *r, const zs_rbf_constraints *c,
                   const double *at)
{
  const unsigned dimension = r->dimension + r->extra;
  if (c->count == 0)
    return true;
  if (!reserve(all, r, all->count + c->count))
    return false;
  for (size_t i = 0; i < c->count; i++) {
    double *to = all->positions + (all->count + i) * dimension;
    memcpy(to, c->positions + i * r->dimension, r->dimension * sizeof *to);
    for (unsigned k = 0; k < r->extra; k++)
      to[r->dimension + k] = r->separation * at[k];
  }
  memcpy(all->values + all->count, c->values, c->count * sizeof *all->values);
  all->count += c->count;
  return true;
}

static bool add_group(collection *all, const request *r, size_t g, zs_rbf_constraints *c,
                      zs_diag *diag)
{
  if (r->warp->dimension)
    zs_variational_warp_apply(r->warp, (int)g, c->positions, c->count);
  const bool memory = extend(all, r, c, r->groups[g].at);
  zs_rbf_constraints_clear(c);
  return memory || zs_fail_memory(diag);
}

static bool collect(collection *all, const request *r, const zs_control *control, zs_diag *diag)
{
  const struct variational *p = r->settings;
  const zs_rbf_rules rules = {r->dimension, p->normal_offset,
                              p->sides == ZS_VARIATIONAL_BOTH_SIDES};
  for (size_t g = 0; g < r->count; g++) {
    group *one = &r->groups[g];
    const zs_place *place = &one->node->place;
    zs_rbf_constraints c;
    if (!zs_rbf_samples_check(&one->samples, place, diag) ||
        !zs_rbf_normals_estimate(&one->samples, r->dimension, control, place, diag) ||
        !zs_rbf_constraints_build(&c, &one->samples, &rules, control, place, diag) ||
        !add_group(all, r, g, &c, diag))
      return false;
  }
  return true;
}

/* Places whose side of the surface is known from its samples. */
static bool collect_witnesses(collection *all, const request *r, const zs_control *control,
                              zs_diag *diag)
{
  for (size_t g = 0; g < r->count; g++) {
    zs_rbf_constraints c;
    if (!zs_rbf_witnesses_make(&c, &r->groups[g].samples, r->dimension, control))
      return zs_fail_memory(diag);
    if (!add_group(all, r, g, &c, diag))
      return false;
  }
  return true;
}

/* The size of the largest shape. */
static double size_of(const request *r)
{
  double size = 0;
  for (size_t g = 0; g < r->count; g++)
    size = fmax(size, zs_rbf_samples_size(&r->groups[g].samples));
  return size;
}

/* ---- Fits ------------------------------------------------------------------------------ */

/* What smoothing is in units of: of the points' extent, however they are turned. */
static double unit_of_smoothing(const request *r)
{
  const double size = size_of(r);
  return size > 0 ? pow(size, zs_rbf_power(kernel_of(r))) : 1;
}

static zs_rbf *fit_all(const request *r, const collection *all, const zs_control *control,
                       zs_diag *diag)
{
  const struct variational *p = r->settings;
  const zs_rbf_problem problem = {.dimension = r->dimension + r->extra,
                                  .kernel = kernel_of(r),
                                  .sigma = sigma_of(r),
                                  .degree = (unsigned)p->degree,
                                  .smoothing = p->smoothing * unit_of_smoothing(r),
                                  .count = all->count,
                                  .positions = all->positions,
                                  .values = all->values};
  const bool strict = !isnan(p->tolerance);
  return p->budget || strict
           ? zs_rbf_fit_greedily(&problem, p->budget ? (size_t)p->budget : all->count,
                                 number_or(p->tolerance, 0), strict, control, &r->node->place,
                                 diag)
           : zs_rbf_fit(&problem, control, &r->node->place, diag);
}

/* Add the witnesses that a fit is against to the constraints; `more` tells whether there
 * were any.  False after reporting. */
static bool hear(collection *all, const request *r, const collection *witnesses,
                 const zs_rbf *rbf, const zs_control *control, bool *more, zs_diag *diag)
{
  const unsigned dimension = rbf->dimension;
  bool *against = malloc(witnesses->count + 1);
  size_t count = 0;
  const bool done =
    (against || zs_fail_memory(diag)) &&
    zs_rbf_witnesses_against(rbf, witnesses->positions, witnesses->values, witnesses->count,
                             control, against, &count, diag) &&
    (reserve(all, r, all->count + count) || zs_fail_memory(diag));
  for (size_t i = 0; done && i < witnesses->count; i++)
    if (against[i]) {
      memcpy(all->positions + all->count * dimension, witnesses->positions + i * dimension,
             dimension * sizeof *all->positions);
      all->values[all->count++] = witnesses->values[i];
    }
  free(against);
  *more = count > 0;
  return done;
}

/* Fit the samples, and again with what they say about places where the fit went astray.
 * Gaussians are too narrow to be told anything far from where they are. */
static zs_rbf *solve(const request *r, const zs_control *control, zs_diag *diag)
{
  enum { ROUNDS = 4 };
  collection all = {0}, witnesses = {0};
  zs_rbf *rbf = NULL;
  double seconds = 0;
  bool more = collect(&all, r, control, diag) &&
              (kernel_of(r) == ZS_RBF_GAUSSIAN || collect_witnesses(&witnesses, r, control, diag));
  for (int round = 0; more; round++) {
    zs_rbf_free(rbf);
    rbf = fit_all(r, &all, control, diag);
    if (!rbf)
      break;
    rbf->seconds = seconds += rbf->seconds;
    if (round == ROUNDS)
      break;
    if (!hear(&all, r, &witnesses, rbf, control, &more, diag)) {
      zs_rbf_free(rbf);
      rbf = NULL;
      break;
    }
  }
  free(all.positions);
  free(all.values);
  free(witnesses.positions);
  free(witnesses.values);
  return rbf;
}

/* Keep the samples that lie on the surface, of a solid without shapes. */
static bool keep_points(zs_variational_fit *fit, const request *r)
{
  const zs_rbf_samples *samples = &r->groups[0].samples;
  if (r->extra || r->dimension < 3)
    return true;
  fit->points = malloc(3 * samples->count * sizeof *fit->points);
  for (size_t i = 0; fit->points && i < samples->count; i++)
    if (samples->samples[i].value == 0)
      memcpy(fit->points + 3 * fit->point_count++, samples->samples[i].position,
             3 * sizeof *fit->points);
  return fit->points != NULL;
}

static zs_variational_fit *make(request *r, const uint64_t key[2], const zs_control *control,
                                zs_diag *diag)
{
  r->separation = number_or(r->settings->separation, SEPARATION * size_of(r));
  zs_rbf *rbf = solve(r, control, diag);
  zs_variational_fit *fit = rbf ? calloc(1, sizeof *fit) : NULL;
  if (!fit) {
    if (rbf)
      zs_fail_memory(diag);
    zs_rbf_free(rbf);
    return NULL;
  }
  atomic_init(&fit->references, 1);
  memcpy(fit->key, key, sizeof fit->key);
  fit->rbf = rbf;
  fit->separation = r->separation;
  if (keep_points(fit, r))
    return fit;
  zs_variational_fit_unref(fit);
  zs_fail_memory(diag);
  return NULL;
}

/* One group for each shape, or one for all parts. */
static bool gather(request *r, zs_diag *diag)
{
  const zs_node *node = r->node;
  r->groups = calloc(node->child_count + 1, sizeof *r->groups);
  if (!r->groups)
    return zs_fail_memory(diag);
  for (size_t i = 0; i < node->child_count; i++)
    if (node->children[i]->kind == &zs_variational_shape)
      r->groups[r->count++] =
        (group){node->children[i], zs_variational_shape_at(node->children[i])->values, {0}};
  if (r->count == 0)
    r->groups[r->count++].node = node;
  for (size_t g = 0; g < r->count; g++)
    if (!zs_variational_gather(r->groups[g].node, r->dimension, &r->groups[g].samples, diag))
      return false;
  return true;
}

zs_variational_fit *zs_variational_fit_find(const zs_node *node, const zs_variational_warp *warp,
                                            struct zs_cache *cache, const zs_control *control,
                                            zs_diag *diag)
{
  const struct variational *p = node->parameters;
  request r = {.node = node,
               .settings = p,
               .warp = warp,
               .dimension = zs_variational_space(node),
               .extra = (unsigned)p->slice.count};
  zs_variational_fit *fit = NULL;
  if (gather(&r, diag)) {
    uint64_t key[2];
    key_of(&r, key);
    fit = zs_cache_find(cache, key, &zs_variational_fit_type);
    /* A file of fits can say what it likes: what is not of this shape is not this fit. */
    if (fit && fit->rbf->dimension != r.dimension + r.extra) {
      zs_variational_fit_unref(fit);
      fit = NULL;
    }
    if (!fit) {
      fit = make(&r, key, control, diag);
      /* What cannot be remembered is only made again. */
      if (fit && cache)
        zs_cache_add(cache, key, &zs_variational_fit_type, fit);
    }
  }
  for (size_t g = 0; r.groups && g < r.count; g++)
    zs_rbf_samples_clear(&r.groups[g].samples);
  free(r.groups);
  return fit;
}

zs_variational_sum *zs_variational_sum_find(const zs_variational_fit *fit, unsigned space,
                                            const double *extra, double accuracy,
                                            struct zs_cache *cache, const zs_control *control,
                                            zs_diag *diag)
{
  uint64_t key[2];
  memcpy(key, fit->key, sizeof key);
  mix(key, extra, fit->rbf->dimension - space);
  mix(key, &accuracy, 1);
  zs_variational_sum *sum = zs_cache_find(cache, key, &sum_type);
  if (sum)
    return sum;
  sum = calloc(1, sizeof *sum);
  if (!sum) {
    zs_fail_memory(diag);
    return NULL;
  }
  atomic_init(&sum->references, 1);
  sum->sum = zs_rbf_sum_new(fit->rbf, space, extra, accuracy, control, diag);
  if (!sum->sum) {
    free(sum);
    return NULL;
  }
  if (cache)
    zs_cache_add(cache, key, &sum_type, sum);
  return sum;
}
