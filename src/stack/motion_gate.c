/* Where motions can be undone, and where they are needed. */
#include "stack/motion_fields.h"

#include <math.h>
#include <string.h>

enum {
  LIMITING = 40, /* rounds of smoothing where the displacement changes too fast */
  REACH = 3      /* of a thickness, in pixels to each side */
};

/* How fast the displacement may change, for its inverse to be found by iterations that take out the
 * growth. */
static const float MOST_CHANGE = 1.5F;
/* The part of a thickness that has to be missing for the gate to open, and to be open. */
static const float MISSING = 0.3F, OPEN = 0.7F;
/* How far it has to be open along the outlines, on the average, to be opened at all, and as
 * far as it is: here and there tips end, which moves nothing. */
static const float RARE = 0.2F, COMMON = 0.5F;
/* How far from an outline is along it, in pixels. */
static const float BESIDE = 3;

/* How fast the displacement changes, in either slice. */
static float change_at(const zs_motion *m, size_t pixel)
{
  const zs_field_neighbours n =
    zs_field_around(m->width, m->height, pixel % m->width, pixel / m->width);
  float most = 0;
  for (int up = 0; up < 2; up++) {
    float sum = 0;
    for (int along = 0; along < 2; along++) {
      float slope[2];
      for (int k = 0; k < 2; k++)
        slope[k] = along ? (m->u[k][n.down] - m->u[k][n.up]) / 2
                         : (m->u[k][n.right] - m->u[k][n.left]) / 2;
      zs_motion_shrink(&m->growth, up ? 0.5F : -0.5F, slope);
      sum += slope[0] * slope[0] + slope[1] * slope[1];
    }
    most = fmaxf(most, sum);
  }
  return sqrtf(most);
}

void zs_motion_limit(zs_motion *m, float *const work[4])
{
  const size_t w = m->width, h = m->height;
  for (int round = 0; round < LIMITING; round++) {
    bool fast = false;
    for (size_t i = 0; i < w * h; i++) {
      const float change = change_at(m, i);
      work[1][i] = change > MOST_CHANGE;
      fast = fast || change > MOST_CHANGE;
    }
    if (!fast)
      return;
    zs_field_spread(work[1], work[0], w, h, 2);
    zs_field_blur(work[1], work[0], w, h, 1);
    for (int k = 0; k < 2; k++) {
      memcpy(work[2], m->u[k], w * h * sizeof *work[2]);
      zs_field_blur(work[2], work[0], w, h, 1.5);
      for (size_t i = 0; i < w * h; i++)
        m->u[k][i] += work[1][i] * (work[2][i] - m->u[k][i]);
    }
  }
}

static float smooth_step(float t)
{
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

/* Half-way thicknesses of the solid (sign 1) or of what is open (-1), plain and moved. */
static void open_gate(zs_motion *m, const float *from, const float *to, float sign,
                      float *const work[4])
{
  const size_t w = m->width, h = m->height;
  for (size_t i = 0; i < w * h; i++) {
    const float x = (float)(i % w), y = (float)(i / w), ux = m->u[0][i] / 2, uy = m->u[1][i] / 2;
    work[2][i] = sign * (from[i] + to[i]) / 2;
    work[3][i] = sign * (zs_motion_sample(from, w, h, x - ux, y - uy) +
                          zs_motion_sample(to, w, h, x + ux, y + uy)) / 2;
  }
  zs_field_spread(work[2], work[0], w, h, REACH);
  zs_field_spread(work[3], work[0], w, h, REACH);
  for (size_t i = 0; i < w * h; i++) {
    const float plain = fmaxf(work[2][i], 0), moved = work[3][i];
    const float need = moved > 0.5F ? (moved - plain) / fmaxf(moved, 1) : 0;
    m->gate[i] = fmaxf(m->gate[i], smooth_step((need - MISSING) / (OPEN - MISSING)));
  }
}

void zs_motion_find_gate(zs_motion *m, const float *from, const float *to, float *const work[4])
{
  if (m->apart) {
    for (size_t i = 0; i < m->width * m->height; i++)
      m->gate[i] = 1;
    return;
  }
  open_gate(m, from, to, 1, work);
  open_gate(m, from, to, -1, work);
  zs_field_spread(m->gate, work[0], m->width, m->height, 3);
  zs_field_blur(m->gate, work[0], m->width, m->height, 4);
  float sum = 0, count = 1e-6F;
  for (size_t i = 0; i < m->width * m->height; i++)
    if (fminf(fabsf(from[i]), fabsf(to[i])) < BESIDE) {
      sum += m->gate[i];
      count++;
    }
  const float part = smooth_step((sum / count - RARE) / (COMMON - RARE));
  for (size_t i = 0; i < m->width * m->height; i++)
    m->gate[i] *= part;
}
