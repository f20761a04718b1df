#include "samples/arc_tree.h"

#include <math.h>
#include <stdlib.h>

enum { PROBES = 9 /* of a piece of an arc, where the tree has to be 0 */ };

typedef struct spot {
  double at[2];
  size_t corner;
} spot;

typedef struct builder {
  zs_arc_tree *tree;
  spot *spots;   /* corners of the chain at hand, by x, then y */
  bool *on_hull; /* by corner, of the chain at hand */
} builder;

static const double *corner(const builder *b, size_t i)
{
  return b->tree->ring.edges[i % b->tree->ring.count].from;
}

static double turn_of(const double *a, const double *b, const double *c)
{
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static int compare_spots(const void *a, const void *b)
{
  const spot *p = a, *q = b;
  for (int k = 0; k < 2; k++)
    if (p->at[k] != q->at[k])
      return p->at[k] < q->at[k] ? -1 : 1;
  return 0;
}

/* Mark corners on the border of the hull of corners first .. first + count - 1 (Andrew). */
static bool find_hull(builder *b, size_t first, size_t count)
{
  size_t *stack = malloc(count * sizeof *stack);
  if (!stack)
    return false;
  for (size_t i = 0; i < count; i++) {
    const double *p = corner(b, first + i);
    b->spots[i] = (spot){{p[0], p[1]}, first + i};
    b->on_hull[(first + i) % b->tree->ring.count] = false;
  }
  qsort(b->spots, count, sizeof *b->spots, compare_spots);
  for (int pass = 0; pass < 2; pass++) {
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
      const size_t c = b->spots[pass ? count - 1 - i : i].corner;
      while (used >= 2 &&
             turn_of(corner(b, stack[used - 2]), corner(b, stack[used - 1]), corner(b, c)) < 0)
        used--;
      stack[used++] = c;
    }
    for (size_t i = 0; i < used; i++)
      b->on_hull[stack[i] % b->tree->ring.count] = true;
  }
  free(stack);
  return true;
}

static zs_arc_item *add_item(builder *b, zs_arc_item **last, zs_arc_item value)
{
  zs_arc_item *added = ZS_ARENA_NEW(&b->tree->arena, zs_arc_item, 1);
  if (!added)
    return NULL;
  *added = value;
  if (*last)
    (*last)->next = added;
  *last = added;
  return added;
}

static bool find_chain(builder *b, size_t first, size_t count, unsigned level, zs_arc_item *chain);

/* The part of a chain between two corners of its hull. */
static bool add_part(builder *b, size_t from, size_t to, unsigned level, zs_arc_item *chain,
                     zs_arc_item **last)
{
  zs_arc_item *added = add_item(b, last, (zs_arc_item){.kind = ZS_ARC_EDGE, .edge = from});
  if (!added)
    return false;
  if (!chain->count++)
    chain->first = added;
  if (to == from + 1)
    return true;
  added->kind = chain->kind == ZS_ARC_ALL ? ZS_ARC_SOME : ZS_ARC_ALL;
  return find_chain(b, from, to - from, level + 1, added);
}

/* The chain of `count` edges from corner `first` on: what is to the left of all of them, or
 * of some.  Edges along the hull of its corners stand for themselves, and what lies between
 * two corners of the hull is a chain of the other kind.  False when memory is out. */
static bool find_chain(builder *b, size_t first, size_t count, unsigned level, zs_arc_item *chain)
{
  const bool closed = count == b->tree->ring.count;
  size_t *stops = malloc((count + 1) * sizeof *stops), stop_count = 0;
  if (!stops || !find_hull(b, first, closed ? count : count + 1)) {
    free(stops);
    return false;
  }
  for (size_t i = first; i <= first + count; i++)
    if (i == first || i == first + count || b->on_hull[i % b->tree->ring.count])
      stops[stop_count++] = i;
  if (stop_count == 2 && count > 1) /* nothing but the ends, by rounding: each for itself */
    for (stop_count = 0; stop_count <= count; stop_count++)
      stops[stop_count] = first + stop_count;
  const unsigned own = level + (unsigned)ceil(log2((double)stop_count));
  b->tree->levels = own > b->tree->levels ? own : b->tree->levels;
  zs_arc_item *last = NULL;
  bool done = true;
  for (size_t i = 0; done && i + 1 < stop_count; i++)
    done = add_part(b, stops[i], stops[i + 1], own, chain, &last);
  free(stops);
  return done;
}

/* A corner that is surely on the hull. */
static size_t lowest_corner(const zs_arc_ring *r)
{
  size_t lowest = 0;
  for (size_t i = 1; i < r->count; i++) {
    const double *p = r->edges[i].from, *q = r->edges[lowest].from;
    if (p[1] < q[1] || (p[1] == q[1] && p[0] < q[0]))
      lowest = i;
  }
  return lowest;
}

/* The distance of a point from an edge, positive on its left, or of an arc from both its
 * chord and its circle. */
static double edge_value(const zs_arc_ring *r, size_t i, const double p[2])
{
  const double *from = r->edges[i % r->count].from, *to = zs_arc_next(r, i % r->count)->from;
  const double bulge = r->edges[i % r->count].bulge;
  const double side = turn_of(from, to, p) / hypot(to[0] - from[0], to[1] - from[1]);
  double centre[2];
  if (bulge == 0)
    return side;
  const double radius = zs_arc_circle(from, to, bulge, centre);
  const double disc = radius - hypot(p[0] - centre[0], p[1] - centre[1]);
  return bulge > 0 ? fmax(side, disc) : fmin(side, -disc);
}

static double item_value(const zs_arc_ring *r, const zs_arc_item *tree, const double p[2])
{
  if (tree->kind == ZS_ARC_EDGE)
    return edge_value(r, tree->edge, p);
  double value = tree->kind == ZS_ARC_ALL ? INFINITY : -INFINITY;
  for (const zs_arc_item *i = tree->first; i; i = i->next) {
    const double v = item_value(r, i, p);
    value = tree->kind == ZS_ARC_ALL ? fmin(value, v) : fmax(value, v);
  }
  return value;
}

/* Look whether the tree is 0 along all arcs: one that reaches beyond the lines of other edges
 * may have lost a part there, or gained one.  Those are divided more finely in `written`; true
 * when there were any. */
static bool refine(const zs_arc_tree *tree, zs_arc_ring *written)
{
  const zs_arc_ring *r = &tree->ring;
  bool refined = false;
  for (size_t i = 0; i < r->count; i++) {
    zs_arc_edge *whole = &written->edges[r->edges[i].whole];
    const double *a = r->edges[i].from, *b = zs_arc_next(r, i)->from;
    const double small = 1e-9 * (fabs(a[0]) + fabs(a[1]) + hypot(b[0] - a[0], b[1] - a[1]));
    bool good = true;
    for (int k = 1; good && r->edges[i].bulge != 0 && k <= PROBES; k++) {
      double p[2];
      zs_arc_point(a, b, r->edges[i].bulge, k / (PROBES + 1.0), p);
      good = fabs(item_value(r, &tree->root, p)) <= small;
    }
    if (good || 2 * whole->pieces > ZS_ARC_MOST_PIECES || whole->pieces > r->edges[i].pieces)
      continue;
    whole->pieces *= 2;
    refined = true;
  }
  return refined;
}

static bool build(builder *b)
{
  const zs_arc_ring *r = &b->tree->ring;
  b->spots = malloc(r->count * sizeof *b->spots);
  b->on_hull = malloc(r->count * sizeof *b->on_hull);
  b->tree->root = (zs_arc_item){.kind = ZS_ARC_ALL};
  const bool done = b->spots && b->on_hull &&
                    find_chain(b, lowest_corner(r), r->count, 0, &b->tree->root);
  free(b->spots);
  free(b->on_hull);
  return done;
}

void zs_arc_tree_free(zs_arc_tree *tree)
{
  zs_arena_free(&tree->arena);
  free(tree->ring.edges);
  *tree = (zs_arc_tree){.levels = 0};
}

bool zs_arc_tree_build(zs_arc_tree *tree, zs_arc_ring *outline)
{
  *tree = (zs_arc_tree){.levels = 0};
  do {
    zs_arc_tree_free(tree);
    builder b = {.tree = tree};
    if (!zs_arc_divide(outline, &tree->ring) || !build(&b))
      return false;
  } while (refine(tree, outline));
  return true;
}
