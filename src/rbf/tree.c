#include "rbf/tree.h"

#include "rbf/sum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  TOP = 4,               /* octrees along each side of the cube */
  TOPS = TOP * TOP * TOP,
  DEPTH = 7              /* divisions of a top cell: to a fiftieth of the unit box */
};
static const double HALF = 5; /* half the cube's side */

/* The series of centres with h < EXPANDED R are worth more than what is known
 * of them one by one; h is the radius of the ball around a cell. */
static const double EXPANDED = 0.9;
/* A cell's series serve all cells below it, down to the smallest.  They leave
 * out no more in all than this part of what f varies in those. */
static const double INHERITED = 0.5;

/* Visits of centres that an octree may cost, by their number; the rest of the
 * work is alike.  It ends there where f is no more than its own rounding. */
static const double MOST_WORK = 700;
/* Cells away from the unit box are no smaller than this part of the distance. */
static const double GRADING = 0.1;

/* f over a cell lies in lo .. hi. */
typedef struct node {
  float lo, hi;
  uint32_t children; /* the first of eight; 0: none */
} node;

struct zs_rbf_tree {
  node *nodes; /* TOPS top cells come first, x fastest */
  size_t count;
};

/* An octree being grown. */
typedef struct grown {
  node *nodes;
  size_t count, capacity;
  double work; /* centres visited */
} grown;

/* What is the same for all cells. */
typedef struct builder {
  const zs_rbf_sum *sum;
  zs_series_layout *layout;
  double polynomial; /* sum of its coefficients' sizes */
  double inherited;  /* what the series of a centre of unit weight may leave out */
} builder;

/* One thread's lists of centres: those near the cell of each level, and those
 * to expand. */
typedef struct scratch {
  uint32_t *near[DEPTH + 2], *expanded;
} scratch;

/* A cell: the series of everything that is not near, off by at most `error`;
 * `mass` bounds the terms of that part, added up without their signs. */
typedef struct cell {
  double middle[3], half;
  double series[ZS_SERIES_SHORT_TERMS], error, mass;
  const uint32_t *near;
  size_t near_count;
} cell;

/* ---- Polynomials ----------------------------------------------------------------- */

/* Enclose a polynomial over |t_k| <= half, monomial by monomial. */
static void polynomial_bounds(const zs_series_layout *layout, const double c[ZS_SERIES_SHORT_TERMS],
                              double half, double *lo, double *hi)
{
  double power[ZS_SERIES_SHORT + 1] = {1};
  for (int k = 1; k <= ZS_SERIES_SHORT; k++)
    power[k] = power[k - 1] * half;
  *lo = *hi = c[0];
  for (int n = 1; n < ZS_SERIES_SHORT_TERMS; n++) {
    const uint8_t *p = layout->power[n];
    const double most = c[n] * power[layout->order[n]];
    const bool even = p[0] % 2 == 0 && p[1] % 2 == 0 && p[2] % 2 == 0;
    *lo += even ? fmin(most, 0) : -fabs(most);
    *hi += even ? fmax(most, 0) : fabs(most);
  }
}

/* ---- Cells ------------------------------------------------------------------------- */

static double distance(const builder *b, const double middle[3], uint32_t centre)
{
  const zs_rbf_centre *c = &b->sum->centres[centre];
  double x = middle[0] - c->x, y = middle[1] - c->y, z = middle[2] - c->z;
  return sqrt(x * x + y * y + z * z + c->lift);
}

static double radius_of(const cell *c)
{
  return 1.7320508075688774 * c->half;
}

/* What the series of a centre leaves out. */
static double remainder_of(const builder *b, uint32_t centre, double distance, double q)
{
  return fabs(b->sum->centres[centre].weight) *
         zs_series_remainder(b->layout, b->sum->kernel, distance, q);
}

/* Enclose phi (r) over r_lo .. r_hi. */
static void kernel_range(zs_rbf_kernel kernel, double r_lo, double r_hi, double *lo, double *hi)
{
  double a = zs_rbf_phi(kernel, r_lo * r_lo), b = zs_rbf_phi(kernel, r_hi * r_hi);
  *lo = fmin(a, b);
  *hi = fmax(a, b);
  /* r^n log r falls to -1 / (n e) at e^(-1/n). */
  const double n = kernel == ZS_RBF_TPS2 ? 2 : kernel == ZS_RBF_TPS4 ? 4 : 0;
  if (n > 0 && r_lo < exp(-1 / n) && r_hi > exp(-1 / n))
    *lo = -exp(-1) / n;
}

/* Some centres: their weights without signs, and how far the farthest is. */
typedef struct load {
  double weights, distance;
} load;

static inline void add_load(load *l, double weight, double distance)
{
  l->weights += fabs(weight);
  l->distance = distance > l->distance ? distance : l->distance;
}

/* What the terms of centres add up to, without their signs, up to h from where
 * the distances are measured. */
static double mass_of(const builder *b, const load *l, double h)
{
  double lo, hi;
  kernel_range(b->sum->kernel, 0, l->distance + h, &lo, &hi);
  return l->weights * fmax(-lo, hi);
}

/* The same for the polynomial. */
static double polynomial_mass(const builder *b, const cell *c)
{
  double reach = 1 + radius_of(c);
  for (int k = 0; k < 3; k++)
    reach += fabs(c->middle[k]);
  return b->polynomial * reach * reach;
}

/* A cell inside `parent`.  `near` has room for the parent's. */
static void make_cell(const builder *b, const cell *parent, const double middle[3], double half,
                      uint32_t *near, uint32_t *expanded, cell *c)
{
  double by[3];
  *c = (cell){.half = half, .error = parent->error, .mass = parent->mass, .near = near};
  for (int k = 0; k < 3; k++) {
    c->middle[k] = middle[k];
    by[k] = middle[k] - parent->middle[k];
  }
  zs_series_shift(b->layout, parent->series, by, c->series);
  const double h = radius_of(c);
  load absorbed = {0};
  size_t count = 0;
  for (size_t i = 0; i < parent->near_count; i++) {
    const uint32_t centre = parent->near[i];
    const double r = distance(b, middle, centre);
    if (h < 0.5 * r && zs_series_remainder(b->layout, b->sum->kernel, r, h / r) < b->inherited) {
      expanded[count++] = centre;
      c->error += remainder_of(b, centre, r, h / r);
      add_load(&absorbed, b->sum->centres[centre].weight, r);
    } else {
      near[c->near_count++] = centre;
    }
  }
  c->mass += mass_of(b, &absorbed, h);
  b->sum->expand(b->layout, b->sum->kernel, middle, b->sum->centres, expanded, count, c->series);
}

/* A bound for what rounding makes of sums whose terms add up to `mass` without
 * their signs: in blocks, in whatever order, and in series. */
static double rounding_of(const builder *b, double mass)
{
  return mass * ((double)b->sum->count * 1.2e-16 + 1e-14);
}

/* What a cell's enclosure is off by, and f in its middle: little work, compared
 * with the series of the centres near it, which go to the list `expanded`.
 * `constant` is the part of the other near ones. */
static double error_of(const builder *b, const cell *c, uint32_t *expanded, size_t *count,
                       double *constant, double *value)
{
  const double h = radius_of(c);
  double error = c->error + b->sum->tolerance;
  load near = {0};
  *count = 0;
  *constant = 0;
  *value = c->series[0];
  for (size_t i = 0; i < c->near_count; i++) {
    const uint32_t centre = c->near[i];
    const double r = distance(b, c->middle, centre), weight = b->sum->centres[centre].weight;
    *value += weight * zs_rbf_phi(b->sum->kernel, r * r);
    add_load(&near, weight, r);
    if (h < EXPANDED * r) {
      expanded[(*count)++] = centre;
      error += remainder_of(b, centre, r, h / r);
    } else {
      double lo, hi;
      kernel_range(b->sum->kernel, fmax(r - h, 0), r + h, &lo, &hi);
      *constant += weight * (lo + hi) / 2;
      error += fabs(weight) * (hi - lo) / 2;
    }
  }
  return error + rounding_of(b, c->mass + mass_of(b, &near, h) + polynomial_mass(b, c));
}

/* Enclose f over a cell; without ends when the middle alone shows that no sign
 * would be certain. */
static node enclose(const builder *b, const cell *c, uint32_t *expanded)
{
  double series[ZS_SERIES_SHORT_TERMS], constant, value, lo, hi;
  size_t count;
  const double error = error_of(b, c, expanded, &count, &constant, &value);
  if (error >= fabs(value))
    return (node){-INFINITY, INFINITY, 0};
  memcpy(series, c->series, sizeof series);
  series[0] += constant;
  b->sum->expand(b->layout, b->sum->kernel, c->middle, b->sum->centres, expanded, count, series);
  polynomial_bounds(b->layout, series, c->half, &lo, &hi);
  return (node){nextafterf((float)(lo - error), -INFINITY),
                nextafterf((float)(hi + error), INFINITY), 0};
}

/* Make room for eight more nodes; their index, or 0 when memory is out. */
static uint32_t add_children(grown *g)
{
  if (g->capacity - g->count < 8) {
    size_t capacity = 2 * g->capacity + 64;
    node *nodes = realloc(g->nodes, capacity * sizeof *nodes);
    if (!nodes)
      return 0;
    g->nodes = nodes;
    g->capacity = capacity;
  }
  g->count += 8;
  return (uint32_t)(g->count - 8);
}

static bool is_small(const cell *c, int level)
{
  double distance = 0;
  for (int k = 0; k < 3; k++)
    distance = fmax(distance, fabs(c->middle[k]) - c->half - 0.5);
  return level == DEPTH || c->half < GRADING * distance;
}

/* Enclose f over a cell, dividing it while no sign is certain and it is not
 * small.  False when memory is out. */
static bool grow(const builder *b, const scratch *s, grown *g, size_t index, const cell *c,
                 int level)
{
  node whole = enclose(b, c, s->expanded);
  g->nodes[index] = whole;
  g->work += (double)c->near_count;
  if (whole.lo >= 0 || whole.hi < 0 || is_small(c, level) ||
      g->work > MOST_WORK * (double)b->sum->count)
    return true;
  const uint32_t first = add_children(g);
  if (!first)
    return false;
  float lo = INFINITY, hi = -INFINITY;
  for (uint32_t i = 0; i < 8; i++) {
    cell child;
    double middle[3];
    for (int k = 0; k < 3; k++)
      middle[k] = c->middle[k] + (i >> k & 1 ? 0.5 : -0.5) * c->half;
    make_cell(b, c, middle, c->half / 2, s->near[level + 1], s->expanded, &child);
    if (!grow(b, s, g, first + i, &child, level + 1))
      return false;
    lo = fminf(lo, g->nodes[first + i].lo);
    hi = fmaxf(hi, g->nodes[first + i].hi);
  }
  g->nodes[index] = (node){fmaxf(lo, whole.lo), fminf(hi, whole.hi), first};
  return true;
}

static void top_middle(unsigned index, double middle[3])
{
  const unsigned at[3] = {index % TOP, index / TOP % TOP, index / TOP / TOP};
  for (int k = 0; k < 3; k++)
    middle[k] = HALF * ((2 * at[k] + 1) / (double)TOP - 1);
}

/* ---- Building ------------------------------------------------------------------------ */

static bool grow_top(const builder *b, const cell *all, unsigned index, grown *g)
{
  scratch s;
  uint32_t *lists = malloc((DEPTH + 3) * b->sum->count * sizeof *lists);
  g->nodes = malloc(sizeof *g->nodes);
  g->count = g->capacity = 1;
  bool done = lists && g->nodes;
  if (done) {
    double middle[3];
    cell top;
    for (int level = 0; level < DEPTH + 2; level++)
      s.near[level] = lists + (size_t)level * b->sum->count;
    s.expanded = lists + (size_t)(DEPTH + 2) * b->sum->count;
    top_middle(index, middle);
    make_cell(b, all, middle, HALF / TOP, s.near[0], s.expanded, &top);
    done = grow(b, &s, g, 0, &top, 0);
  }
  free(lists);
  return done;
}

/* Put the octrees into one list: the top nodes, then each tree's others. */
static zs_rbf_tree *join(const grown tops[TOPS])
{
  zs_rbf_tree *tree = calloc(1, sizeof *tree);
  if (!tree)
    return NULL;
  tree->count = TOPS;
  for (int t = 0; t < TOPS; t++)
    tree->count += tops[t].count - 1;
  tree->nodes = malloc(tree->count * sizeof *tree->nodes);
  if (!tree->nodes) {
    free(tree);
    return NULL;
  }
  size_t at = TOPS;
  for (int t = 0; t < TOPS; t++) {
    for (size_t i = 0; i < tops[t].count; i++) {
      node n = tops[t].nodes[i];
      if (n.children)
        n.children += (uint32_t)(at - 1);
      tree->nodes[i ? at - 1 + i : (size_t)t] = n;
    }
    at += tops[t].count - 1;
  }
  return tree;
}

static bool grow_all(const builder *b, grown tops[TOPS], unsigned threads)
{
  (void)threads; /* without OpenMP */
  const size_t count = b->sum->count;
  uint32_t *list = malloc(count * sizeof *list);
  if (!list)
    return false;
  for (size_t j = 0; j < count; j++)
    list[j] = (uint32_t)j;
  /* The first ten monomials are those of the fit. */
  cell all = {.half = HALF, .near = list, .near_count = count};
  memcpy(all.series, b->sum->polynomial, sizeof b->sum->polynomial);
  bool done = true;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) reduction(&& : done)
  for (unsigned t = 0; t < TOPS; t++)
    done = grow_top(b, &all, t, &tops[t]) && done;
  free(list);
  return done;
}

zs_rbf_tree *zs_rbf_tree_new(const zs_rbf_sum *sum, double slope, unsigned threads)
{
  builder b = {.sum = sum, .layout = zs_series_layout_new(ZS_SERIES_SHORT)};
  double weights = 0;
  for (size_t j = 0; j < sum->count; j++)
    weights += fabs(sum->centres[j].weight);
  for (int k = 0; k < 10; k++)
    b.polynomial += fabs(sum->polynomial[k]);
  b.inherited = INHERITED * slope * ldexp(HALF / TOP, -DEPTH) / weights;
  grown *tops = calloc(TOPS, sizeof *tops);
  bool done = b.layout && tops && grow_all(&b, tops, threads);
  zs_rbf_tree *tree = done ? join(tops) : NULL;
  for (unsigned t = 0; tops && t < TOPS; t++)
    free(tops[t].nodes);
  free(tops);
  free(b.layout);
  return tree;
}

void zs_rbf_tree_free(zs_rbf_tree *tree)
{
  if (!tree)
    return;
  free(tree->nodes);
  free(tree);
}

size_t zs_rbf_tree_bytes(const zs_rbf_tree *tree)
{
  return sizeof *tree + tree->count * sizeof *tree->nodes;
}

/* ---- Asking ---------------------------------------------------------------------------- */

/* Widen `result` by what a cell says of the part of a box inside it. */
static void ask(const zs_rbf_tree *tree, uint32_t index, const double middle[3], double half,
                const float lo[3], const float hi[3], float result[2])
{
  const node *n = &tree->nodes[index];
  bool within = true;
  for (int k = 0; k < 3; k++) {
    const double cell_lo = middle[k] - half, cell_hi = middle[k] + half;
    if ((double)hi[k] < cell_lo || (double)lo[k] > cell_hi)
      return;
    within = within && (double)lo[k] <= cell_lo && (double)hi[k] >= cell_hi;
  }
  if (n->lo >= result[0] && n->hi <= result[1])
    return;
  if (within || !n->children) {
    result[0] = fminf(result[0], n->lo);
    result[1] = fmaxf(result[1], n->hi);
    return;
  }
  for (uint32_t i = 0; i < 8; i++) {
    double part[3];
    for (int k = 0; k < 3; k++)
      part[k] = middle[k] + (i >> k & 1 ? 0.5 : -0.5) * half;
    ask(tree, n->children + i, part, half / 2, lo, hi, result);
  }
}

void zs_rbf_tree_bounds(const zs_rbf_tree *tree, const float lo[3], const float hi[3],
                        float result[2])
{
  result[0] = result[1] = NAN;
  for (int k = 0; k < 3; k++)
    if (!(lo[k] <= hi[k] && (double)lo[k] >= -HALF && (double)hi[k] <= HALF))
      return;
  result[0] = INFINITY;
  result[1] = -INFINITY;
  for (unsigned t = 0; t < TOPS; t++) {
    double middle[3];
    top_middle(t, middle);
    ask(tree, t, middle, HALF / TOP, lo, hi, result);
  }
  if (isinf(result[0]) || isinf(result[1]))
    result[0] = result[1] = NAN;
}
