#include "rbf/tree.h"

#include "base/array.h"
#include "field/program.h"
#include "rbf/poll.h"
#include "rbf/sum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  TOP = 4,               /* octrees along each side of the cube */
  TOPS = TOP * TOP * TOP,
  DEPTH = 6, FLAT_DEPTH = 8, /* divisions of a top cell: to a hundredth of the unit box */
  POLL_DEPTH = 3,            /* of the cells between which progress is told */
  ORDER = 5,             /* nodes along a cell's side */
  NODES = ORDER * ORDER * ORDER
};

/* What a polynomial leaves out, by the sum of its coefficients of highest order. */
static const double TAIL = 2;
/* Away from the centres, where f is larger, cells.h is off by up to this part of it. */
static const double AWAY = 1e-5;
/* Cells away from the unit box are no smaller than this part of the distance. */
static const double GRADING = 0.1;
/* A Gaussian may rise and fall between the nodes of a cell whose half side is more than so many of
 * its widths, unless it is so many of them away from all centres. */
static const double WIDTHS = 1, REACH = 6;

/* f over a cell lies in lo .. hi, and no farther than `rest` from the plane
 * value + slope . t, the cell being -1 <= t_k <= 1. */
typedef struct node {
  float lo, hi;
  float value, slope[3], rest;
  uint32_t children; /* the first of eight; 0: none */
} node;

struct zs_rbf_tree {
  node *nodes; /* TOPS top cells come first, x fastest */
  size_t count;
  double half; /* the cube's side's */
  bool flat;   /* of a sum that is: its cells are those above the plane z = 0 */
};

/* An octree being grown. */
typedef struct grown {
  node *nodes;
  size_t count, capacity;
} grown;

/* What is the same for all cells. */
typedef struct builder {
  const zs_rbf_sum *sum;
  zs_rbf_poll *poll;
  double place[ORDER], fit[ORDER * ORDER]; /* nodes, and values there to coefficients */
} builder;

typedef struct cell {
  double middle[3], half;
} cell;

/* ---- Cells ------------------------------------------------------------------------- */

/* Enclose f over a cell. */
static node enclose(const builder *b, const cell *c)
{
  const zs_cells_kernels *kernels = zs_cells_select(b->sum->kernel);
  double point[3][ZS_BLOCK], f[1][ZS_BLOCK], series[NODES], size = 0, tail = 0;
  for (unsigned n = 0; n < NODES; n++) {
    point[0][n] = c->middle[0] + c->half * b->place[n % ORDER];
    point[1][n] = c->middle[1] + c->half * b->place[n / ORDER % ORDER];
    point[2][n] =
      b->sum->terms.flat ? 0 : c->middle[2] + c->half * b->place[n / ORDER / ORDER];
  }
  kernels->evaluate(b->sum->cells, &b->sum->terms, NODES, (const double(*)[ZS_BLOCK])point, f,
                    false);
  kernels->transform(b->fit, ORDER, ORDER, f[0], series);
  const unsigned linear[3] = {1, ORDER, ORDER * ORDER};
  double plane = 0;
  for (unsigned n = 1; n < NODES; n++) {
    const unsigned i = n % ORDER, j = n / ORDER % ORDER, k = n / ORDER / ORDER;
    size += fabs(series[n]);
    if (i == ORDER - 1 || j == ORDER - 1 || k == ORDER - 1)
      tail += fabs(series[n]);
  }
  for (int k = 0; k < 3; k++)
    plane += fabs(series[linear[k]]);
  const double error = TAIL * tail + b->sum->tolerance + b->sum->cells->error +
                       AWAY * (fabs(series[0]) + size);
  return (node){.lo = (float)(series[0] - size - error),
                .hi = (float)(series[0] + size + error),
                .value = (float)series[0],
                .slope = {(float)series[1], (float)series[ORDER], (float)series[ORDER * ORDER]},
                .rest = (float)(size - plane + error)};
}

/* Whether what is between the nodes of a cell may be anything. */
static bool is_blind(const builder *b, const cell *c)
{
  const zs_rbf_radial radial = b->sum->terms.radial;
  if (radial.kernel != ZS_RBF_GAUSSIAN)
    return false;
  const double sigma = 1 / sqrt(radial.rate);
  double gap = 0;
  for (int k = 0; k < 3; k++)
    gap = fmax(gap, fabs(c->middle[k]) - c->half - 0.5);
  return c->half > WIDTHS * sigma && gap < REACH * sigma;
}

/* Make room for eight more nodes; their index, or 0 when memory is out. */
static uint32_t add_children(grown *g)
{
  node *nodes = zs_array_grown(g->nodes, g->count + 8, &g->capacity, sizeof *nodes);
  if (!nodes)
    return 0;
  g->nodes = nodes;
  g->count += 8;
  return (uint32_t)(g->count - 8);
}

static bool is_small(const builder *b, const cell *c, int level)
{
  double distance = 0;
  for (int k = 0; k < 3; k++)
    distance = fmax(distance, fabs(c->middle[k]) - c->half - 0.5);
  return level == (b->sum->terms.flat ? FLAT_DEPTH : DEPTH) || c->half < GRADING * distance;
}

/* Tell that a cell is done which will not be divided. */
static bool tell(const builder *b, int level)
{
  return level > POLL_DEPTH ||
         zs_rbf_poll_rounds(b->poll, (size_t)1 << 3 * (POLL_DEPTH - level));
}

/* Enclose f over a cell, dividing it while no sign is certain and it is not
 * small.  False when memory is out, or cancelled. */
static bool grow(const builder *b, grown *g, size_t index, const cell *c, int level)
{
  if (b->sum->terms.flat && c->middle[2] != c->half) { /* away from the plane z = 0 */
    g->nodes[index] = (node){.lo = INFINITY, .hi = -INFINITY};
    return tell(b, level);
  }
  const bool blind = is_blind(b, c);
  const node whole =
    blind ? (node){.lo = -INFINITY, .hi = INFINITY, .rest = INFINITY} : enclose(b, c);
  g->nodes[index] = whole;
  if (whole.lo >= 0 || whole.hi < 0 || is_small(b, c, level))
    return tell(b, level);
  const uint32_t first = add_children(g);
  if (!first)
    return false;
  float lo = INFINITY, hi = -INFINITY;
  for (uint32_t i = 0; i < 8; i++) {
    cell child = {.half = c->half / 2};
    for (int k = 0; k < 3; k++)
      child.middle[k] = c->middle[k] + (i >> k & 1 ? child.half : -child.half);
    if (!grow(b, g, first + i, &child, level + 1))
      return false;
    lo = fminf(lo, g->nodes[first + i].lo);
    hi = fmaxf(hi, g->nodes[first + i].hi);
  }
  g->nodes[index].lo = lo;
  g->nodes[index].hi = hi;
  g->nodes[index].children = first;
  return level != POLL_DEPTH || tell(b, level);
}

static void top_middle(double half, unsigned index, double middle[3])
{
  const unsigned at[3] = {index % TOP, index / TOP % TOP, index / TOP / TOP};
  for (int k = 0; k < 3; k++)
    middle[k] = half * ((2 * at[k] + 1) / (double)TOP - 1);
}

/* ---- Building ------------------------------------------------------------------------ */

static bool grow_top(const builder *b, unsigned index, grown *g)
{
  const double half = b->sum->cells->half;
  cell top = {.half = half / TOP};
  g->nodes = malloc(sizeof *g->nodes);
  g->count = g->capacity = 1;
  top_middle(half, index, top.middle);
  return g->nodes && grow(b, g, 0, &top, 0);
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

zs_rbf_tree *zs_rbf_tree_new(const zs_rbf_sum *sum, const zs_control *control, zs_diag *diag)
{
  zs_rbf_poll poll = {.control = control, .stage = "bounds"};
  builder b = {.sum = sum, .poll = &poll};
  for (unsigned m = 0; m < ORDER; m++) {
    b.place[m] = zs_chebyshev_node(ORDER, m);
    zs_chebyshev_fit(ORDER, b.fit);
  }
  grown *tops = calloc(TOPS, sizeof *tops);
  bool done = tops && zs_rbf_poll_begin(&poll, (size_t)TOPS << 3 * POLL_DEPTH, 0, 1);
  if (done) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(zs_control_threads(control)) \
  reduction(&& : done)
    for (unsigned t = 0; t < TOPS; t++)
      done = done && grow_top(&b, t, &tops[t]);
  }
  zs_rbf_tree *tree = done ? join(tops) : NULL;
  if (tree) {
    tree->half = sum->cells->half;
    tree->flat = sum->terms.flat;
  }
  for (unsigned t = 0; tops && t < TOPS; t++)
    free(tops[t].nodes);
  free(tops);
  if (!tree)
    zs_rbf_poll_fail(&poll, diag);
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

static void widen(float result[2], double lo, double hi)
{
  result[0] = fminf(result[0], nextafterf((float)lo, -INFINITY));
  result[1] = fmaxf(result[1], nextafterf((float)hi, INFINITY));
}

/* Widen `result` by what a leaf says of the part of a box inside it. */
static void ask_leaf(const node *n, const double middle[3], double half, const float lo[3],
                     const float hi[3], float result[2])
{
  double least = (double)n->value - (double)n->rest, most = (double)n->value + (double)n->rest;
  for (int k = 0; k < 3; k++) {
    const double slope = (double)n->slope[k];
    const double a = slope * fmax(((double)lo[k] - middle[k]) / half, -1);
    const double b = slope * fmin(((double)hi[k] - middle[k]) / half, 1);
    least += fmin(a, b);
    most += fmax(a, b);
  }
  widen(result, fmax(least, (double)n->lo), fmin(most, (double)n->hi));
}

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
    within = within && ((tree->flat && k == 2) ||
                        ((double)lo[k] <= cell_lo && (double)hi[k] >= cell_hi));
  }
  if (n->lo >= result[0] && n->hi <= result[1])
    return;
  if (within) {
    widen(result, (double)n->lo, (double)n->hi);
    return;
  }
  if (!n->children) {
    ask_leaf(n, middle, half, lo, hi, result);
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
    if (!(lo[k] <= hi[k] && (double)lo[k] >= -tree->half && (double)hi[k] <= tree->half))
      return;
  result[0] = INFINITY;
  result[1] = -INFINITY;
  for (unsigned t = 0; t < TOPS; t++) {
    double middle[3];
    top_middle(tree->half, t, middle);
    ask(tree, t, middle, tree->half / TOP, lo, hi, result);
  }
  if (isinf(result[0]) || isinf(result[1]))
    result[0] = result[1] = NAN;
}
