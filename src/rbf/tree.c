#include "rbf/tree.h"

#include "rbf/sum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  TOP = 4,               /* octrees along each side of the cube */
  TOPS = TOP * TOP * TOP,
  DEPTH = 5              /* divisions of a top cell */
};
static const double HALF = 1.25; /* half the cube's side */

/* Centres with q below the first are expanded once for a cell and all below it;
 * below the second, for each cell anew; the others are bounded one by one. */
static const double INHERITED = 0.25, EXPANDED = 0.9;

/* max |C_9| of each kernel, rounded up; later ones are smaller. */
static const double TERM[ZS_RBF_KERNEL_COUNT] = {0.0321, 0.0157, 0.0187, 0.0312, 0.0241};

static double factorial(unsigned n)
{
  double product = 1;
  for (unsigned i = 2; i <= n; i++)
    product *= i;
  return product;
}

/* |a|! / a! */
static double multinomial(const uint8_t a[3])
{
  return factorial((unsigned)a[0] + a[1] + a[2]) /
         (factorial(a[0]) * factorial(a[1]) * factorial(a[2]));
}

/* What the moment of y^a, i = |a|, and a j contributes: it is multiplied by
 *   binomial (i + j, j) 2^i multinomial (a) t^a (t.t)^j
 * where (t.t)^j is a sum over the exponents of degree j, doubled. */
static void find_parts(zs_rbf_layout *layout)
{
  unsigned moment = 0, part = 0;
  for (unsigned n = 0; n < ZS_RBF_TAYLOR; n++) {
    const unsigned i = layout->degree[n];
    const uint8_t *a = layout->power[n];
    for (unsigned j = 0; i + 2 * j <= ZS_RBF_DEGREE; j++, moment++) {
      const double common = factorial(i + j) / (factorial(i) * factorial(j)) *
                            (double)(1u << i) * multinomial(a);
      for (unsigned m = layout->first[j]; m < layout->first[j + 1]; m++, part++) {
        const uint8_t *b = layout->power[m];
        layout->part[part].factor = common * multinomial(b);
        layout->part[part].moment = (uint16_t)moment;
        layout->part[part].to =
          layout->index[a[0] + 2 * b[0]][a[1] + 2 * b[1]][a[2] + 2 * b[2]];
      }
    }
  }
}

void zs_rbf_layout_init(zs_rbf_layout *layout)
{
  uint8_t n = 0;
  for (uint8_t degree = 0; degree <= ZS_RBF_DEGREE; degree++) {
    layout->first[degree] = n;
    for (uint8_t i = degree + 1; i-- > 0;)
      for (uint8_t j = (uint8_t)(degree - i + 1); j-- > 0;) {
        const uint8_t k = (uint8_t)(degree - i - j);
        layout->power[n][0] = i;
        layout->power[n][1] = j;
        layout->power[n][2] = k;
        layout->degree[n] = degree;
        layout->lower[n][0] = i ? layout->index[i - 1][j][k] : 0;
        layout->lower[n][1] = j ? layout->index[i][j - 1][k] : 0;
        layout->lower[n][2] = k ? layout->index[i][j][k - 1] : 0;
        layout->index[i][j][k] = n++;
      }
  }
  layout->first[ZS_RBF_DEGREE + 1] = n;
  find_parts(layout);
}

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
} grown;

/* What is the same for all cells. */
typedef struct builder {
  zs_rbf_layout layout;
  zs_rbf_kernel kernel;
  const zs_rbf_centre *centres;
  size_t count;
  zs_rbf_expand *expand;
  double rounding; /* of block sums */
} builder;

/* One thread's lists of centres: those near the cell of each level, and those
 * to expand. */
typedef struct scratch {
  uint32_t *near[DEPTH + 2], *expanded;
} scratch;

/* A cell: the series of everything that is not near, off by at most `error`. */
typedef struct cell {
  double middle[3], half;
  double taylor[ZS_RBF_TAYLOR], error;
  const uint32_t *near;
  size_t near_count;
} cell;

/* ---- Polynomials ----------------------------------------------------------------- */

/* Coefficients by exponents. */
typedef double cube[ZS_RBF_DEGREE + 1][ZS_RBF_DEGREE + 1][ZS_RBF_DEGREE + 1];

/* Taylor's shift of one row of `n` coefficients, `stride` apart: p (t + by). */
static void shift_row(double *c, size_t stride, int n, double by)
{
  for (int first = 0; first < n - 1; first++)
    for (int i = n - 2; i >= first; i--)
      c[(size_t)i * stride] += by * c[(size_t)(i + 1) * stride];
}

/* The series about a point `by` further on. */
static void shift(const zs_rbf_layout *layout, const double from[ZS_RBF_TAYLOR],
                  const double by[3], double to[ZS_RBF_TAYLOR])
{
  enum { SIDE = ZS_RBF_DEGREE + 1 };
  cube c = {{{0}}};
  for (int n = 0; n < ZS_RBF_TAYLOR; n++) {
    const uint8_t *p = layout->power[n];
    c[p[0]][p[1]][p[2]] = from[n];
  }
  for (int axis = 0; axis < 3; axis++)
    for (int i = 0; i < SIDE; i++)
      for (int j = 0; j < SIDE - i; j++) {
        double *row = axis == 0 ? &c[0][i][j] : axis == 1 ? &c[i][0][j] : &c[i][j][0];
        shift_row(row, axis == 0 ? SIDE * SIDE : axis == 1 ? SIDE : 1, SIDE - i - j, by[axis]);
      }
  for (int n = 0; n < ZS_RBF_TAYLOR; n++) {
    const uint8_t *p = layout->power[n];
    to[n] = c[p[0]][p[1]][p[2]];
  }
}

/* Enclose a polynomial over |t_k| <= half, monomial by monomial. */
static void polynomial_bounds(const zs_rbf_layout *layout, const double c[ZS_RBF_TAYLOR],
                              double half, double *lo, double *hi)
{
  double power[ZS_RBF_DEGREE + 1] = {1};
  for (int k = 1; k <= ZS_RBF_DEGREE; k++)
    power[k] = power[k - 1] * half;
  *lo = *hi = c[0];
  for (int n = 1; n < ZS_RBF_TAYLOR; n++) {
    const uint8_t *p = layout->power[n];
    const double most = c[n] * power[layout->degree[n]];
    const bool even = p[0] % 2 == 0 && p[1] % 2 == 0 && p[2] % 2 == 0;
    *lo += even ? fmin(most, 0) : -fabs(most);
    *hi += even ? fmax(most, 0) : fabs(most);
  }
}

/* ---- Cells ------------------------------------------------------------------------- */

static double distance(const builder *b, const double middle[3], uint32_t centre)
{
  const zs_rbf_centre *c = &b->centres[centre];
  double x = middle[0] - c->x, y = middle[1] - c->y, z = middle[2] - c->z;
  return sqrt(x * x + y * y + z * z);
}

static double radius_of(const cell *c)
{
  return 1.7320508075688774 * c->half;
}

/* What the series of a centre at a distance leaves out. */
static double remainder_of(const builder *b, uint32_t centre, double distance, double q)
{
  static const unsigned twice_power[ZS_RBF_KERNEL_COUNT] = {1, 3, 5, 2, 4};
  double q3 = q * q * q, q9 = q3 * q3 * q3, power = distance;
  for (unsigned i = 1; i < twice_power[b->kernel]; i++)
    power *= distance;
  return TERM[b->kernel] * fabs(b->centres[centre].weight) * power * q9 / (1 - q);
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

/* A cell inside `parent`.  `near` has room for the parent's. */
static void make_cell(const builder *b, const cell *parent, const double middle[3], double half,
                      uint32_t *near, uint32_t *expanded, cell *c)
{
  double by[3];
  *c = (cell){.half = half, .error = parent->error, .near = near};
  for (int k = 0; k < 3; k++) {
    c->middle[k] = middle[k];
    by[k] = middle[k] - parent->middle[k];
  }
  shift(&b->layout, parent->taylor, by, c->taylor);
  const double h = radius_of(c);
  size_t count = 0;
  for (size_t i = 0; i < parent->near_count; i++) {
    const uint32_t centre = parent->near[i];
    const double r = distance(b, middle, centre);
    if (h < INHERITED * r) {
      expanded[count++] = centre;
      c->error += remainder_of(b, centre, r, h / r);
    } else {
      near[c->near_count++] = centre;
    }
  }
  b->expand(&b->layout, b->kernel, middle, b->centres, expanded, count, c->taylor);
}

/* What a cell's enclosure is off by, and f in its middle: little work, compared
 * with the series of the centres near it, which go to the list `expanded`.
 * `constant` is the part of the other near ones. */
static double error_of(const builder *b, const cell *c, uint32_t *expanded, size_t *count,
                       double *constant, double *value)
{
  const double h = radius_of(c);
  double error = c->error + b->rounding;
  *count = 0;
  *constant = 0;
  *value = c->taylor[0];
  for (size_t i = 0; i < c->near_count; i++) {
    const uint32_t centre = c->near[i];
    const double r = distance(b, c->middle, centre), weight = b->centres[centre].weight;
    *value += weight * zs_rbf_phi(b->kernel, r * r);
    if (h < EXPANDED * r) {
      expanded[(*count)++] = centre;
      error += remainder_of(b, centre, r, h / r);
    } else {
      double lo, hi;
      kernel_range(b->kernel, fmax(r - h, 0), r + h, &lo, &hi);
      *constant += weight * (lo + hi) / 2;
      error += fabs(weight) * (hi - lo) / 2;
    }
  }
  return error;
}

/* Enclose f over a cell; without ends when the middle alone shows that no sign
 * would be certain. */
static node enclose(const builder *b, const cell *c, uint32_t *expanded)
{
  double taylor[ZS_RBF_TAYLOR], constant, value, lo, hi;
  size_t count;
  const double error = error_of(b, c, expanded, &count, &constant, &value);
  if (error >= fabs(value))
    return (node){-INFINITY, INFINITY, 0};
  memcpy(taylor, c->taylor, sizeof taylor);
  taylor[0] += constant;
  b->expand(&b->layout, b->kernel, c->middle, b->centres, expanded, count, taylor);
  polynomial_bounds(&b->layout, taylor, c->half, &lo, &hi);
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

/* Enclose f over a cell, dividing it while no sign is certain and `level` is
 * not the last.  False when memory is out. */
static bool grow(const builder *b, const scratch *s, grown *g, size_t index, const cell *c,
                 int level)
{
  node whole = enclose(b, c, s->expanded);
  g->nodes[index] = whole;
  if (level == DEPTH || whole.lo >= 0 || whole.hi < 0)
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
  uint32_t *lists = malloc((DEPTH + 3) * b->count * sizeof *lists);
  g->nodes = malloc(sizeof *g->nodes);
  g->count = g->capacity = 1;
  bool done = lists && g->nodes;
  if (done) {
    double middle[3];
    cell top;
    for (int level = 0; level < DEPTH + 2; level++)
      s.near[level] = lists + (size_t)level * b->count;
    s.expanded = lists + (size_t)(DEPTH + 2) * b->count;
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

static zs_rbf_expand *expand_of_machine(void)
{
#if defined ZS_WITH_X86_KERNELS
  static zs_rbf_expand *const table[ZS_ISA_COUNT] = {zs_rbf_expand_baseline, zs_rbf_expand_avx2,
                                                     zs_rbf_expand_avx512};
  return table[zs_isa_select()];
#else
  return zs_rbf_expand_baseline;
#endif
}

/* A bound for what adding up a block's sums in double precision can be off, in
 * whatever order. */
static double rounding_of(const builder *b, const double polynomial[10])
{
  const double farthest = 1.7320508075688774 * (HALF + 0.5);
  double lo, hi, sum = 0;
  kernel_range(b->kernel, 0, farthest, &lo, &hi);
  for (size_t j = 0; j < b->count; j++)
    sum += fabs(b->centres[j].weight) * fmax(-lo, hi);
  for (int k = 0; k < 10; k++)
    sum += fabs(polynomial[k]) * HALF * HALF;
  return sum * (double)(b->count + ZS_RBF_TAYLOR) * 4.5e-16;
}

zs_rbf_tree *zs_rbf_tree_new(zs_rbf_kernel kernel, const zs_rbf_centre *centres, size_t count,
                             const double polynomial[10], unsigned threads)
{
  builder b = {.kernel = kernel, .centres = centres, .count = count, .expand = expand_of_machine()};
  zs_rbf_layout_init(&b.layout);
  b.rounding = rounding_of(&b, polynomial);
  grown *tops = calloc(TOPS, sizeof *tops);
  uint32_t *list = malloc(count * sizeof *list);
  bool done = tops && list;
  if (done) {
    for (size_t j = 0; j < count; j++)
      list[j] = (uint32_t)j;
    /* The first ten monomials are those of the fit. */
    cell all = {.half = HALF, .near = list, .near_count = count};
    memcpy(all.taylor, polynomial, 10 * sizeof *polynomial);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) reduction(&& : done)
    for (unsigned t = 0; t < TOPS; t++)
      done = grow_top(&b, &all, t, &tops[t]) && done;
  }
  zs_rbf_tree *tree = done ? join(tops) : NULL;
  for (unsigned t = 0; tops && t < TOPS; t++)
    free(tops[t].nodes);
  free(tops);
  free(list);
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
