#include "samples/transform.h"

#include <math.h>
#include <stdlib.h>

/* What a line works with, each as long as the line. */
typedef struct line {
  size_t count;
  double spacing;
  double *height;    /* squared distances so far */
  uint32_t *carried;
  size_t *lowest;    /* samples whose parabolas make up the envelope, ... */
  double *from;      /* ... and where each begins to be the lowest */
} line;

/* Where the parabola of sample j falls below that of i, which stands before it. */
static double crossing(const line *l, size_t i, size_t j)
{
  const double a = l->spacing * (double)i, b = l->spacing * (double)j;
  return ((l->height[j] - l->height[i]) / (b - a) + (a + b)) / 2;
}

/* The lower envelope; returns how many parabolas it has. */
static size_t build(const line *l)
{
  size_t used = 0;
  for (size_t j = 0; j < l->count; j++) {
    if (isinf(l->height[j]))
      continue;
    double from = -INFINITY;
    while (used && (from = crossing(l, l->lowest[used - 1], j)) <= l->from[used - 1])
      used--;
    l->from[used] = used ? from : -INFINITY;
    l->lowest[used++] = j;
  }
  return used;
}

static void pass_line(const line *l, float *squares, uint32_t *nearest, size_t stride)
{
  for (size_t i = 0; i < l->count; i++) {
    l->height[i] = (double)squares[i * stride];
    if (nearest)
      l->carried[i] = nearest[i * stride];
  }
  const size_t used = build(l);
  for (size_t i = 0, k = 0; used && i < l->count; i++) {
    const double at = l->spacing * (double)i;
    while (k + 1 < used && l->from[k + 1] <= at)
      k++;
    const double away = at - l->spacing * (double)l->lowest[k];
    squares[i * stride] = (float)(l->height[l->lowest[k]] + away * away);
    if (nearest)
      nearest[i * stride] = l->carried[l->lowest[k]];
  }
}

bool zs_transform_pass(float *squares, uint32_t *nearest, const size_t count[3], int axis,
                       double spacing)
{
  const size_t n = count[axis];
  line l = {.count = n, .spacing = spacing};
  l.height = malloc(n * sizeof *l.height);
  l.from = malloc(n * sizeof *l.from);
  l.lowest = malloc(n * sizeof *l.lowest);
  l.carried = malloc(n * sizeof *l.carried);
  const bool memory = l.height && l.from && l.lowest && l.carried;
  const size_t stride = axis == 0 ? 1 : axis == 1 ? count[0] : count[0] * count[1];
  /* Lines begin where the coordinate along the axis is 0. */
  const size_t all = count[0] * count[1] * count[2];
  for (size_t block = 0; memory && block < all; block += stride * n)
    for (size_t i = 0; i < stride; i++)
      pass_line(&l, squares + block + i, nearest ? nearest + block + i : NULL, stride);
  free(l.height);
  free(l.from);
  free(l.lowest);
  free(l.carried);
  return memory;
}
