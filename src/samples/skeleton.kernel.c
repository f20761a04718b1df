/* Block, gradient and bounds kernels of the fields about skeletons.  Compiled once per
 * instruction set. */
#include "samples/skeleton_pieces.h"

/* Boxes go no farther out than this, in radii. */
static const float WIDE = 1e9f;

/* What is added up at the points of a block. */
typedef struct block {
  unsigned n;
  const float *at[3];
  _Alignas(64) float sum[4][ZS_BLOCK];     /* f and its derivatives by x, y and z */
  _Alignas(64) float nearest[4][ZS_BLOCK]; /* of a part: the square, and the way from there */
} block;

#define FOR_VECTORS(i, n) for (unsigned i = 0; i < (n); i += ZS_WIDTH)

static void add_to(float *sum, zs_lanes by)
{
  zs_lanes_store(sum, zs_lanes_load(sum) + by);
}

static void load_point(const block *b, unsigned i, zs_lanes x[3])
{
  for (int k = 0; k < 3; k++)
    x[k] = zs_lanes_load(b->at[k] + i);
}

/* ---- Blocks --------------------------------------------------------------------------- */

/* How near a part's nearest piece is. */
ZS_INLINE void find_nearest(block *b, const zs_skeleton *skeleton, const zs_skeleton_part *part,
                            bool gradient)
{
  for (uint32_t j = 0; j < part->count; j++)
    FOR_VECTORS(i, b->n)
    {
      zs_lanes x[3], way[3];
      load_point(b, i, x);
      const zs_lanes square = zs_skeleton_from_piece(&skeleton->pieces[part->first + j], x, way);
      const zs_lanes least = j ? zs_lanes_load(b->nearest[0] + i) : zs_lanes_all(INFINITY);
      const zs_lanes_mask nearer = square < least;
      zs_lanes_store(b->nearest[0] + i, zs_lanes_select(nearer, square, least));
      for (int k = 0; k < 3 && gradient; k++) {
        float *own = b->nearest[k + 1] + i;
        zs_lanes_store(own, j ? zs_lanes_select(nearer, way[k], zs_lanes_load(own)) : way[k]);
      }
    }
}

ZS_INLINE void add_falloff(block *b, const zs_skeleton *skeleton, const zs_skeleton_part *part,
                           bool gradient)
{
  const float weight = (float)part->weight, scale = skeleton->pieces[part->first].form.scale;
  find_nearest(b, skeleton, part, gradient);
  FOR_VECTORS(i, b->n)
  {
    zs_lanes slope;
    const zs_lanes f =
      zs_skeleton_falloff(skeleton->field, zs_lanes_load(b->nearest[0] + i), &slope);
    add_to(b->sum[0] + i, weight * f);
    for (int k = 1; k < 4 && gradient; k++)
      add_to(b->sum[k] + i, 2 * weight * slope * zs_lanes_load(b->nearest[k] + i) * scale);
  }
}

ZS_INLINE void add_cauchy(block *b, const zs_skeleton *skeleton, const zs_skeleton_part *part,
                          bool gradient)
{
  for (uint32_t j = 0; j < part->count; j++) {
    const zs_skeleton_piece *piece = &skeleton->pieces[part->first + j];
    const float unit = piece->form.unit;
    FOR_VECTORS(i, b->n)
    {
      zs_lanes x[3], slope[3];
      load_point(b, i, x);
      add_to(b->sum[0] + i, unit * zs_skeleton_cauchy(piece, x, slope));
      for (int k = 0; k < 3 && gradient; k++)
        add_to(b->sum[k + 1] + i, unit * slope[k] * piece->form.scale);
    }
  }
}

/* The box around the points of a block. */
static void find_extent(const block *b, float lo[3], float hi[3])
{
  for (int k = 0; k < 3; k++) {
    zs_lanes least = zs_lanes_all(INFINITY), most = -least;
    FOR_VECTORS(i, b->n)
    {
      const zs_lanes x = zs_lanes_load(b->at[k] + i);
      least = zs_lanes_smaller(x, least); /* leaves out what is not a number */
      most = zs_lanes_larger(x, most);
    }
    lo[k] = INFINITY;
    hi[k] = -INFINITY;
    for (int l = 0; l < ZS_WIDTH; l++) {
      lo[k] = fminf(lo[k], least[l]);
      hi[k] = fmaxf(hi[k], most[l]);
    }
  }
}

static bool reaches(const zs_skeleton_part *part, const float lo[3], const float hi[3])
{
  for (int k = 0; k < 3; k++)
    if (part->lo[k] - (double)hi[k] >= part->reach || (double)lo[k] - part->hi[k] >= part->reach)
      return false;
  return true;
}

static bool meets(const zs_skeleton_group *group, const float lo[3], const float hi[3])
{
  for (int k = 0; k < 3; k++)
    if (hi[k] < group->lo[k] || lo[k] > group->hi[k])
      return false;
  return true;
}

ZS_INLINE void add_some(block *b, const zs_skeleton *skeleton, uint32_t first, uint32_t count,
                        const float lo[3], const float hi[3], bool gradient)
{
  for (uint32_t p = first; p < first + count; p++) {
    const zs_skeleton_part *part = &skeleton->parts[p];
    if (skeleton->field == ZS_SKELETON_CAUCHY)
      add_cauchy(b, skeleton, part, gradient);
    else if (reaches(part, lo, hi))
      add_falloff(b, skeleton, part, gradient);
  }
}

ZS_INLINE void add_parts(block *b, const zs_block_arguments *a, bool gradient)
{
  const zs_skeleton *skeleton = a->data;
  float lo[3], hi[3];
  b->n = a->n;
  for (int k = 0; k < 3; k++)
    b->at[k] = a->in[k];
  for (int k = 0; k < (gradient ? 4 : 1); k++)
    memset(b->sum[k], 0, a->n * sizeof(float));
  find_extent(b, lo, hi);
  if (!skeleton->group_count)
    add_some(b, skeleton, 0, skeleton->part_count, lo, hi, gradient);
  for (uint32_t g = 0; g < skeleton->group_count;) {
    const zs_skeleton_group *group = &skeleton->groups[g];
    const bool met = meets(group, lo, hi);
    if (met && group->next == g + 1)
      add_some(b, skeleton, group->first, group->count, lo, hi, gradient);
    g = met ? g + 1 : group->next;
  }
}

/* NaN where a coordinate is. */
static zs_lanes known_sum(const block *b, unsigned i)
{
  zs_lanes x[3];
  load_point(b, i, x);
  return zs_lanes_known((x[0] == x[0]) & (x[1] == x[1]) & (x[2] == x[2]),
                        zs_lanes_load(b->sum[0] + i));
}

static void value(const zs_block_arguments *a)
{
  block b;
  add_parts(&b, a, false);
  FOR_VECTORS(i, a->n)
  zs_lanes_store(a->out + i, known_sum(&b, i));
}

static void gradient(const zs_block_arguments *a)
{
  block b;
  add_parts(&b, a, true);
  FOR_VECTORS(i, a->n)
  {
    zs_lanes g[4] = {known_sum(&b, i)};
    for (unsigned k = 1; k < 4; k++) {
      g[k] = zs_lanes_all(0);
      for (unsigned j = 0; j < 3; j++)
        g[k] = zs_lanes_multiply_add(zs_lanes_load(b.sum[j + 1] + i),
                                     zs_lanes_load(a->in[j] + k * ZS_BLOCK + i), g[k]);
    }
    for (unsigned k = 0; k < 4; k++)
      zs_lanes_store(a->out + k * ZS_BLOCK + i, g[k]);
  }
}

/* ---- Bounds --------------------------------------------------------------------------------- */

/* Boxes as many as a vector has room for. */
typedef struct boxes {
  zs_lanes middle[3], half[3];
  zs_lanes largest; /* coordinate, of all of them */
} boxes;

/* What is known of a sum over them. */
typedef struct range {
  zs_lanes lo, hi, slack;
} range;

/* Half the sides of boxes in radii of a piece. */
ZS_INLINE void scaled_half(const zs_skeleton_form *form, const boxes *b, zs_lanes r[3])
{
  for (int k = 0; k < 3; k++)
    r[k] = zs_lanes_smaller(b->half[k] * form->scale, zs_lanes_all(WIDE));
}

/* How far coordinates may be off, by rounding. */
ZS_INLINE zs_lanes rounding(const zs_skeleton_form *form, const boxes *b)
{
  return zs_lanes_smaller(1e-6f * (b->largest * form->scale + form->largest),
                          zs_lanes_all(WIDE));
}

/* The least and the largest distance of a piece from boxes: distances are convex, so that
 * they are no smaller than the tangent at the middle says, and no larger than that of the
 * farthest corner from the middle's nearest point. */
ZS_INLINE void distances(const zs_skeleton_piece *piece, const boxes *b, zs_lanes *near,
                         zs_lanes *far)
{
  zs_lanes way[3], r[3], toward = zs_lanes_all(0), corner[3];
  const zs_lanes square = zs_skeleton_from_piece(piece, b->middle, way);
  const zs_lanes distance = zs_lanes_square_root(square);
  scaled_half(&piece->form, b, r);
  for (int k = 0; k < 3; k++) {
    toward = zs_lanes_multiply_add(zs_lanes_absolute(way[k]), r[k], toward);
    corner[k] = zs_lanes_absolute(way[k]) + r[k];
  }
  toward /= zs_lanes_larger(distance, zs_lanes_all(1e-18f));
  const zs_lanes off = rounding(&piece->form, b);
  *near = zs_lanes_larger((distance - toward) * (1 - 2e-6f) - off, zs_lanes_all(0));
  *far = zs_lanes_square_root(zs_lanes_square_sum(corner)) * (1 + 2e-6f) + off;
}

static void add_range(range *sum, zs_lanes lo, zs_lanes hi, float weight)
{
  sum->lo += weight > 0 ? weight * lo : weight * hi;
  sum->hi += weight > 0 ? weight * hi : weight * lo;
  sum->slack += 1e-6f * fabsf(weight) * hi;
}

static void add_falloff_range(range *sum, const zs_skeleton *skeleton,
                              const zs_skeleton_part *part, const boxes *b)
{
  zs_lanes near = zs_lanes_all(INFINITY), far = near, slope;
  for (uint32_t j = 0; j < part->count; j++) {
    zs_lanes least, most;
    distances(&skeleton->pieces[part->first + j], b, &least, &most);
    near = zs_lanes_smaller(near, least);
    far = zs_lanes_smaller(far, most);
  }
  add_range(sum, zs_skeleton_falloff(skeleton->field, far * far, &slope),
            zs_skeleton_falloff(skeleton->field, near * near, &slope), (float)part->weight);
}

/* Boxes that meet that of a group. */
static zs_lanes_mask meeting(const zs_skeleton_group *group, const boxes *b)
{
  zs_lanes_mask met = (zs_lanes_mask){0} - 1;
  const zs_lanes slack = 1e-6f * b->largest;
  for (int k = 0; k < 3; k++)
    met &= (b->middle[k] + b->half[k] + slack >= zs_lanes_all(group->lo[k])) &
           (b->middle[k] - b->half[k] - slack <= zs_lanes_all(group->hi[k]));
  return met;
}

/* Whether a group is so much smaller than every box that it counts as one. */
static bool is_small(const zs_skeleton_group *group, const boxes *b)
{
  static const float SMALL = 0.25f;
  float size = 0;
  zs_lanes side = zs_lanes_all(0);
  for (int k = 0; k < 3; k++) {
    size = fmaxf(size, group->hi[k] - group->lo[k]);
    side = zs_lanes_larger(side, 2 * b->half[k]);
  }
  return !zs_lanes_bits(side * SMALL < zs_lanes_all(size));
}

/* Of all parts; those of small groups between nothing and all of their weights. */
static void add_all_falloffs(range *sum, const zs_skeleton *skeleton, const boxes *b)
{
  const bool grouped = skeleton->group_count > 0;
  for (uint32_t p = 0; p < skeleton->part_count && !grouped; p++)
    add_falloff_range(sum, skeleton, &skeleton->parts[p], b);
  for (uint32_t g = 0; g < skeleton->group_count;) {
    const zs_skeleton_group *group = &skeleton->groups[g++];
    const zs_lanes_mask met = meeting(group, b);
    const bool any = zs_lanes_bits(met), whole = any && is_small(group, b);
    if (whole) {
      const zs_lanes zero = zs_lanes_all(0);
      sum->lo += zs_lanes_select(met, zs_lanes_all(group->below), zero);
      sum->hi += zs_lanes_select(met, zs_lanes_all(group->above), zero);
      sum->slack +=
        zs_lanes_select(met, zs_lanes_all(1e-6f * (group->above - group->below)), zero);
    } else if (any && group->next == g) {
      for (uint32_t p = group->first; p < group->first + group->count; p++)
        add_falloff_range(sum, skeleton, &skeleton->parts[p], b);
    }
    g = any && !whole ? g : group->next;
  }
}

/* The tangent of a sum at the middle of boxes, and how far it may be from there. */
typedef struct tangent {
  zs_lanes f, slope[3], beyond;
} tangent;

/* The kernel's second derivatives are at most 4 / (1 + u^2)^3, or across from there 20 / (1 +
 * u^2)^3 and 1. */
ZS_INLINE zs_lanes steepest_bend(zs_lanes near)
{
  const zs_lanes r = 1 / (1 + near * near), cube = r * r * r;
  return zs_lanes_larger(4 * cube, zs_lanes_smaller(20 * cube, zs_lanes_all(1)));
}

static void add_cauchy_range(range *sum, tangent *t, const zs_skeleton_piece *piece,
                             const boxes *b)
{
  const zs_skeleton_form *form = &piece->form;
  zs_lanes near, far, slope[3], r[3], p[3], farthest = zs_lanes_all(0);
  distances(piece, b, &near, &far);
  scaled_half(form, b, r);
  zs_skeleton_relative(form, b->middle, p);
  for (int i = 0; i < (int)piece->shape; i++) {
    zs_lanes corner[3];
    for (int k = 0; k < 3; k++)
      corner[k] = zs_lanes_absolute(p[k] - form->corner[i][k]) + r[k];
    farthest = zs_lanes_larger(farthest, zs_lanes_square_sum(corner));
  }
  const zs_lanes most = zs_lanes_square_root(farthest) * (1 + 2e-6f) + rounding(form, b);
  const zs_lanes least_f = 1 / (1 + most * most), most_f = 1 / (1 + near * near);
  const float measure = form->measure * form->unit;
  add_range(sum, least_f * least_f, most_f * most_f, measure);
  sum->slack += 4e-7f * fabsf(form->unit) * form->sides / (1 + near);
  t->f += form->unit * zs_skeleton_cauchy(piece, b->middle, slope);
  for (int k = 0; k < 3; k++)
    t->slope[k] += form->unit * slope[k] * form->scale;
  t->beyond += 0.5f * fabsf(measure) * steepest_bend(near) * zs_lanes_square_sum(r);
}

static void add_all_cauchy(range *sum, const zs_skeleton *skeleton, const boxes *b)
{
  tangent t = {0};
  for (uint32_t p = 0; p < skeleton->part_count; p++)
    for (uint32_t j = 0; j < skeleton->parts[p].count; j++)
      add_cauchy_range(sum, &t, &skeleton->pieces[skeleton->parts[p].first + j], b);
  for (int k = 0; k < 3; k++)
    t.beyond += zs_lanes_absolute(t.slope[k]) * (b->half[k] + 1e-6f * b->largest);
  const zs_lanes lo = t.f - t.beyond * (1 + 1e-5f), hi = t.f + t.beyond * (1 + 1e-5f);
  /* What is not a number says nothing. */
  sum->lo = zs_lanes_select(lo > sum->lo, lo, sum->lo);
  sum->hi = zs_lanes_select(hi < sum->hi, hi, sum->hi);
}

static void bounds(const zs_bounds_arguments *a)
{
  const zs_skeleton *skeleton = a->data;
  ZS_FOR_PARTS(part)
  {
    boxes b = {.largest = zs_lanes_all(0)};
    zs_lanes_mask known = (zs_lanes_mask){0} - 1;
    for (int k = 0; k < 3; k++) {
      const zs_intervals x = zs_intervals_load(a->in[k], part);
      const zs_lanes end = zs_lanes_all(1e17f);
      known &= zs_intervals_known(x);
      const zs_lanes lo = zs_lanes_clamped(x.lo, -end, end);
      const zs_lanes hi = zs_lanes_clamped(x.hi, -end, end);
      b.middle[k] = 0.5f * (lo + hi);
      b.half[k] = 0.5f * (hi - lo);
      b.largest += zs_lanes_larger(zs_lanes_absolute(lo), zs_lanes_absolute(hi));
    }
    range sum = {0};
    if (skeleton->field == ZS_SKELETON_CAUCHY)
      add_all_cauchy(&sum, skeleton, &b);
    else
      add_all_falloffs(&sum, skeleton, &b);
    zs_intervals_store(a->out, part,
                       zs_intervals_checked(sum.lo - sum.slack, sum.hi + sum.slack, known));
  }
}

const zs_kernels ZS_KERNELS(zs_skeleton_kernels) = {value, gradient, bounds};
