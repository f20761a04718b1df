/* Block, gradient and bounds kernels of chains.  Compiled once per instruction
 * set.
 *
 * Values and gradients are computed as those of unions: an intersection is the
 * complement of the union of complements. */
#include "field/chain.h"

#include "field/field.h"
#include "field/joint.h"
#include "field/shape.h"

/* ---- Links ---------------------------------------------------------------------------- */

/* A link in single precision. */
typedef struct link {
  shape_place place;
  shape_parameters parameters;
  float sign;              /* what the primitive's value is multiplied with */
  zs_primitive_shape shape;
  unsigned alike;          /* links from this one on that differ in numbers only */
} link;

enum { PREPARED = 128 /* links at a time, which fit into the nearest cache */ };

#define SHAPES(F) \
  F(BALL, ball) F(TUBE, tube) F(CUBOID, cuboid) F(CYLINDER, cylinder) F(TORUS, torus) \
    F(CAPSULE, capsule)

static shape_parameters parameters_of(const zs_link *link)
{
  switch (link->shape) {
#define CASE(SHAPE, NAME) \
  case ZS_PRIMITIVE_##SHAPE: \
    return NAME##_parameters(link->primitive->parameter);
    SHAPES(CASE)
#undef CASE
  default:
    return make_parameters(0, 0, 0, 0);
  }
}

/* Links of a chain from `first` on, for points in axes parallel to the scene's about
 * the frame's origin; frame is NULL for registers. */
static void prepare(const zs_chain *chain, uint32_t first, unsigned n, const zs_frame *frame,
                    link *links)
{
  for (unsigned i = n; i-- > 0;) {
    const zs_link *from = &chain->links[first + i];
    find_place(from->primitive, frame, &links[i].place);
    links[i].parameters = parameters_of(from);
    links[i].sign = (float)(from->negated ? -chain->blend.side : chain->blend.side);
    links[i].shape = from->shape;
    const bool alike = i + 1 < n && links[i].shape == links[i + 1].shape &&
                       links[i].place.kind == links[i + 1].place.kind;
    links[i].alike = alike ? links[i + 1].alike + 1 : 1;
  }
}

/* ---- Points ----------------------------------------------------------------------------- */

/* The frame that links are prepared for. */
static const zs_frame *link_frame(const zs_chain *chain, const zs_frame *frame, zs_frame *parallel)
{
  if (!chain->root)
    return NULL;
  if (frame->parallel)
    return frame;
  *parallel = zs_frame_at(frame->origin);
  return parallel;
}

/* A point's coordinates along the axes of the scene. */
static inline shape_point in_scene_axes(const zs_frame *frame, shape_point p)
{
  zs_lanes at[3];
  for (int k = 0; k < 3; k++) {
    const zs_lanes across = p.x * (float)frame->axes[0][k] + p.y * (float)frame->axes[1][k];
    const zs_lanes along = zs_lanes_all((float)frame->axes[2][k]);
    at[k] = frame->perspective ? p.z * (along + across) : p.z * along + across;
  }
  return (shape_point){at[0], at[1], at[2]};
}

static inline shape_point load_point(const zs_block_arguments *x, const zs_chain *chain, size_t i)
{
  const shape_point p = {zs_lanes_load(x->in[0] + i), zs_lanes_load(x->in[1] + i),
                         zs_lanes_load(x->in[2] + i)};
  return chain->root && !x->frame->parallel ? in_scene_axes(x->frame, p) : p;
}

/* The value that the first link is joined with. */
static inline zs_lanes load_so_far(const zs_block_arguments *x, const zs_chain *chain, size_t i)
{
  if (chain->begins)
    return zs_lanes_all(-INFINITY);
  return zs_lanes_all((float)chain->blend.side) * zs_lanes_load(x->in[ZS_CHAIN_SO_FAR] + i);
}

/* ---- Values ------------------------------------------------------------------------------ */

enum { VECTORS = 4 /* at a time, so that their latencies overlap */ };

typedef struct tile {
  shape_point at[VECTORS];
  zs_lanes f[VECTORS];
} tile;

ZS_INLINE void join_alike(tile *t, const link *links, unsigned n, shape *distance, mapping *place,
                          joint_numbers c, joint_profile *rise)
{
  zs_lanes f[VECTORS];
  for (int v = 0; v < VECTORS; v++)
    f[v] = t->f[v];
  for (unsigned i = 0; i < n; i++) {
    const shape_map m = map_of(&links[i].place);
    const shape_numbers s = numbers_of(links[i].parameters);
    const zs_lanes against = zs_lanes_all(-links[i].sign), r = zs_lanes_all(links[i].sign) * s.r;
    for (int v = 0; v < VECTORS; v++) {
      const zs_lanes d = distance(place(&m, t->at[v].x, t->at[v].y, t->at[v].z), s);
      const zs_lanes g = zs_lanes_multiply_add(against, d, r);
      f[v] = joined(f[v], g, c, rise);
    }
  }
  for (int v = 0; v < VECTORS; v++)
    t->f[v] = f[v];
}

ZS_INLINE void join_links(tile *t, const link *links, unsigned n, joint_numbers c,
                          joint_profile *rise)
{
  for (unsigned i = 0; i < n; i += links[i].alike) {
    const link *from = &links[i];
    switch (2 * (int)from->shape + (from->place.kind != MOVED)) {
#define CASE(SHAPE, NAME) \
  case 2 * ZS_PRIMITIVE_##SHAPE: \
    join_alike(t, from, from->alike, NAME, moved, c, rise); \
    break; \
  case 2 * ZS_PRIMITIVE_##SHAPE + 1: \
    join_alike(t, from, from->alike, NAME, affine, c, rise); \
    break;
      SHAPES(CASE)
#undef CASE
    default:
      break;
    }
  }
}

/* The last vectors of a block repeat where a tile is longer than what is left. */
static inline size_t vector_at(size_t i, int v, size_t n)
{
  const size_t at = i + (size_t)v * ZS_WIDTH;
  return at < n ? at : n - ZS_WIDTH;
}

ZS_INLINE void chain_value(const zs_block_arguments *x, joint_numbers c, joint_profile *rise)
{
  _Alignas(64) float so_far[ZS_EVAL_ROWS * ZS_BLOCK]; /* the output may be an input */
  link links[PREPARED];
  const zs_chain *chain = x->data;
  zs_frame parallel;
  const zs_frame *frame = link_frame(chain, x->frame, &parallel);
  const size_t n = x->n;
  for (uint32_t first = 0; first < chain->count; first += PREPARED) {
    const uint32_t left = chain->count - first;
    const unsigned count = left < PREPARED ? left : PREPARED;
    prepare(chain, first, count, frame, links);
    for (size_t i = 0; i < n; i += VECTORS * ZS_WIDTH) {
      tile t;
      for (int v = 0; v < VECTORS; v++) {
        const size_t at = vector_at(i, v, n);
        t.at[v] = load_point(x, chain, at);
        t.f[v] = first ? zs_lanes_load(so_far + at) : load_so_far(x, chain, at);
      }
      join_links(&t, links, count, c, rise);
      for (int v = 0; v < VECTORS; v++)
        zs_lanes_store(so_far + vector_at(i, v, n), t.f[v]);
    }
  }
  for (size_t i = 0; i < n; i += ZS_WIDTH)
    zs_lanes_store(x->out + i, (float)chain->blend.side * zs_lanes_load(so_far + i));
}

/* ---- Gradients ------------------------------------------------------------------------------ */

/* The value so far, its derivative by what came before the chain, and its gradient by
 * the chain's coordinates. */
typedef struct slopes {
  zs_lanes f, weight, g[3];
} slopes;

/* A link that is added, not taken away, has no effect where its primitive is further away
 * than this; `f` is the value so far. */
ZS_INLINE zs_lanes distance_with_effect(zs_lanes f, shape_numbers s, joint_numbers c,
                                        joint_profile *rise)
{
  const zs_lanes reach = zs_lanes_all(rise == extremum_rise ? 0 : c.k);
  const zs_lanes sizes = zs_lanes_absolute(s.r) + zs_lanes_absolute(f) + reach;
  return zs_lanes_multiply_add(zs_lanes_all(8 * JOINT_UNIT), sizes, s.r + reach - f);
}

/* Neighbouring points have much the same links: most have no effect on a whole vector. */
ZS_INLINE void join_slope(slopes *t, shape_point at, const link *link, shape *distance,
                          shape_beyond *beyond, shape_gradient *gradient, joint_numbers c,
                          joint_profile *rise, joint_slope *slope)
{
  const shape_map m = map_of(&link->place);
  const shape_numbers s = numbers_of(link->parameters);
  const zs_lanes sign = zs_lanes_all(link->sign);
  const bool only_moved = link->place.kind == MOVED;
  const shape_point local = only_moved ? moved(&m, at.x, at.y, at.z) : affine(&m, at.x, at.y, at.z);
  if (link->sign > 0 &&
      !zs_lanes_bits(~beyond(local, s, distance_with_effect(t->f, s, c, rise))))
    return;
  const zs_lanes b = sign * (s.r - distance(local, s));
  const joint_weights w = joint_weights_of(t->f > b, slope(zs_lanes_absolute(t->f - b), c));
  t->f = joined(t->f, b, c, rise);
  const zs_lanes_mask counts = w.b != 0;
  const shape_point own = gradient(local, s);
  const shape_point by_place = only_moved ? own : by_inputs(&m, own);
  const zs_lanes of_link = sign * w.b;
  t->weight *= w.a;
  /* Where the link does not count, zeros keep their signs, whatever the other points do. */
  t->g[0] = zs_lanes_select(counts, w.a * t->g[0] + of_link * by_place.x, t->g[0]);
  t->g[1] = zs_lanes_select(counts, w.a * t->g[1] + of_link * by_place.y, t->g[1]);
  t->g[2] = zs_lanes_select(counts, w.a * t->g[2] + of_link * by_place.z, t->g[2]);
}

ZS_INLINE void join_slopes(slopes *t, shape_point at, const link *links, unsigned n,
                           joint_numbers c, joint_profile *rise, joint_slope *slope)
{
  for (const link *l = links; l < links + n; l++) {
    switch (l->shape) {
#define CASE(SHAPE, NAME) \
  case ZS_PRIMITIVE_##SHAPE: \
    join_slope(t, at, l, NAME, NAME##_beyond, NAME##_gradient_at, c, rise, slope); \
    break;
      SHAPES(CASE)
#undef CASE
    default:
      break;
    }
  }
}

/* From derivatives by the chain's coordinates to derivatives by the frame's. */
static inline zs_lanes by_frame(const zs_block_arguments *x, const zs_chain *chain,
                                const zs_lanes g[3], unsigned k, size_t i)
{
  if (!chain->root) {
    const size_t row = (size_t)(k + 1) * ZS_BLOCK + i;
    return term(g[0], x->in[0] + row) + term(g[1], x->in[1] + row) + term(g[2], x->in[2] + row);
  }
  if (x->frame->parallel)
    return g[k];
  const double *axis = x->frame->axes[k];
  return g[0] * (float)axis[0] + g[1] * (float)axis[1] + g[2] * (float)axis[2];
}

/* Everything of a vector is read before anything of it is written. */
static void store_slopes(const zs_block_arguments *x, const zs_chain *chain, const slopes *t,
                         size_t i)
{
  const zs_lanes side = zs_lanes_all((float)chain->blend.side);
  zs_lanes row[3];
  for (unsigned k = 0; k < 3; k++) {
    row[k] = side * by_frame(x, chain, t->g, k, i);
    if (!chain->begins)
      row[k] += term(t->weight, x->in[ZS_CHAIN_SO_FAR] + (size_t)(k + 1) * ZS_BLOCK + i);
  }
  zs_lanes_store(x->out + i, side * t->f);
  for (unsigned k = 0; k < 3; k++)
    zs_lanes_store(x->out + (size_t)(k + 1) * ZS_BLOCK + i, row[k]);
}

ZS_INLINE void chain_gradient(const zs_block_arguments *x, joint_numbers c, joint_profile *rise,
                              joint_slope *slope)
{
  const zs_lanes zero = zs_lanes_all(0);
  const zs_chain *chain = x->data;
  slopes so_far[ZS_BLOCK / ZS_WIDTH];
  link links[PREPARED];
  zs_frame parallel;
  const zs_frame *frame = link_frame(chain, x->frame, &parallel);
  for (uint32_t first = 0; first < chain->count; first += PREPARED) {
    const uint32_t left = chain->count - first;
    const unsigned count = left < PREPARED ? left : PREPARED;
    prepare(chain, first, count, frame, links);
    for (size_t i = 0; i < x->n; i += ZS_WIDTH) {
      slopes *t = &so_far[i / ZS_WIDTH];
      if (!first)
        *t = (slopes){.f = load_so_far(x, chain, i),
                      .weight = zs_lanes_all(1),
                      .g = {zero, zero, zero}};
      join_slopes(t, load_point(x, chain, i), links, count, c, rise, slope);
    }
  }
  for (size_t i = 0; i < x->n; i += ZS_WIDTH)
    store_slopes(x, chain, &so_far[i / ZS_WIDTH], i);
}

/* ---- Bounds --------------------------------------------------------------------------------- */

ZS_INLINE zs_intervals link_range(const zs_link *link, const zs_bounds *const in[3], unsigned part,
                                  const zs_frame *frame)
{
  const zs_primitive *p = link->primitive;
  zs_intervals range = {zs_lanes_all(NAN), zs_lanes_all(NAN)};
  switch (link->shape) {
#define CASE(SHAPE, NAME) \
  case ZS_PRIMITIVE_##SHAPE: \
    range = shape_range(p, in, part, frame, NAME, NAME##_parameters(p->parameter)); \
    break;
    SHAPES(CASE)
#undef CASE
  default:
    break;
  }
  return link->negated ? zs_intervals_negate(range) : range;
}

ZS_INLINE void chain_bounds(const zs_bounds_arguments *x, unsigned part, joint_numbers c,
                            zs_demand inputs, joint_profile *rise)
{
  enum { AHEAD = 8 /* links from fetching a primitive to using it */ };
  static const zs_choice link_alone = {.copy = {0, 0xffff}, .sign = {0, 0xffff}};
  const zs_chain *chain = x->data;
  const zs_frame *frame = chain->root ? x->frame : NULL;
  zs_intervals f = {zs_lanes_all(NAN), zs_lanes_all(NAN)};
  if (!chain->begins)
    f = zs_intervals_load(x->in[ZS_CHAIN_SO_FAR], part);
  for (uint32_t i = 0; i < chain->count; i++) {
    __builtin_prefetch(chain->links[i + AHEAD < chain->count ? i + AHEAD : i].primitive);
    const zs_intervals link = link_range(&chain->links[i], x->in, part, frame);
    zs_choice *choice = &x->links[i];
    if (!i && chain->begins) {
      f = link;
      *choice = link_alone;
    } else if (rise == extremum_rise) {
      f = extremum_range(f, link, c.side > 0, x->demand, choice, part);
    } else {
      f = smooth_range(f, link, c, x->demand, inputs, rise, choice, part);
    }
  }
  zs_intervals_store(x->out, part, f);
}

/* ---- Tables ------------------------------------------------------------------------------- */

static zs_blend as_union(const zs_chain *chain)
{
  zs_blend blend = chain->blend;
  blend.side = ZS_BLEND_UNION;
  return blend;
}

#define KERNELS(NAME, DEMAND) \
  static void NAME##_value(const zs_block_arguments *x) \
  { \
    const zs_blend blend = as_union(x->data); \
    chain_value(x, NAME##_numbers(&blend), NAME##_rise); \
  } \
  static void NAME##_gradient(const zs_block_arguments *x) \
  { \
    const zs_blend blend = as_union(x->data); \
    chain_gradient(x, NAME##_numbers(&blend), NAME##_rise, NAME##_slope); \
  } \
  static void NAME##_bounds(const zs_bounds_arguments *x) \
  { \
    const zs_blend *blend = &((const zs_chain *)x->data)->blend; \
    const zs_demand inputs = DEMAND; \
    ZS_FOR_PARTS(part) \
      chain_bounds(x, part, NAME##_numbers(blend), inputs, NAME##_rise); \
  }
#define SMOOTH_KERNELS(NAME) KERNELS(NAME, zs_smooth_##NAME.demand(blend, x->demand))
KERNELS(extremum, x->demand)
SMOOTH_KERNELS(quadratic)
SMOOTH_KERNELS(cubic)
SMOOTH_KERNELS(circular)
SMOOTH_KERNELS(chamfer)

const zs_chain_table ZS_KERNELS(zs_chain_kernels) = {
  [ZS_CHAIN_EXTREMUM] = {extremum_value, extremum_gradient, extremum_bounds},
  [ZS_CHAIN_QUADRATIC] = {quadratic_value, quadratic_gradient, quadratic_bounds},
  [ZS_CHAIN_CUBIC] = {cubic_value, cubic_gradient, cubic_bounds},
  [ZS_CHAIN_CIRCULAR] = {circular_value, circular_gradient, circular_bounds},
  [ZS_CHAIN_CHAMFER] = {chamfer_value, chamfer_gradient, chamfer_bounds},
};
