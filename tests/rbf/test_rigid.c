/* Rigid motions: recovered, best, no more than is needed, and on the way. */
#include "../random.h"

#include "rbf/rigid.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const double PI = 3.14159265358979323846;

static void apply(const double m[12], const double x[3], double y[3])
{
  for (int i = 0; i < 3; i++)
    y[i] = m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3];
}

static double gap(const double a[3], const double b[3])
{
  return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* A unit quaternion that is as likely as any other (w first). */
static void random_quaternion(uint64_t *state, double q[4])
{
  double size;
  do {
    size = 0;
    for (int i = 0; i < 4; i++) {
      q[i] = random_between(state, -1, 1);
      size += q[i] * q[i];
    }
  } while (size > 1 || size < 0.01);
  for (int i = 0; i < 4; i++)
    q[i] /= sqrt(size);
}

/* v + 2 w (u x v) + 2 u x (u x v): no formula that the room uses. */
static void turn(const double q[4], const double v[3], double out[3])
{
  double a[3], b[3];
  for (int k = 0; k < 3; k++)
    a[k] = q[1 + (k + 1) % 3] * v[(k + 2) % 3] - q[1 + (k + 2) % 3] * v[(k + 1) % 3];
  for (int k = 0; k < 3; k++)
    b[k] = q[1 + (k + 1) % 3] * a[(k + 2) % 3] - q[1 + (k + 2) % 3] * a[(k + 1) % 3];
  for (int k = 0; k < 3; k++)
    out[k] = v[k] + 2 * q[0] * a[k] + 2 * b[k];
}

/* The part t of the way from no rotation to q, along the short arc. */
static void slerp(const double q[4], double t, double out[4])
{
  const double sign = q[0] < 0 ? -1 : 1, a = acos(fmin(1, sign * q[0]));
  const double here = a < 1e-8 ? 1 - t : sin((1 - t) * a) / sin(a);
  const double there = sign * (a < 1e-8 ? t : sin(t * a) / sin(a));
  for (int i = 0; i < 4; i++)
    out[i] = (i == 0 ? here : 0) + there * q[i];
}

enum { MOST = 20 };

typedef struct cloud {
  size_t count;
  double from[3 * MOST], to[3 * MOST], middle[2][3];
} cloud;

static void set_middles(cloud *c)
{
  memset(c->middle, 0, sizeof c->middle);
  for (size_t i = 0; i < c->count; i++)
    for (int k = 0; k < 3; k++) {
      c->middle[0][k] += c->from[3 * i + k] / (double)c->count;
      c->middle[1][k] += c->to[3 * i + k] / (double)c->count;
    }
}

static void random_cloud(uint64_t *state, size_t count, double size, double off, cloud *c)
{
  c->count = count;
  for (size_t i = 0; i < 3 * count; i++)
    c->from[i] = off + size * random_between(state, -1, 1);
}

static void move(cloud *c, const double q[4], const double by[3])
{
  for (size_t i = 0; i < c->count; i++) {
    turn(q, c->from + 3 * i, c->to + 3 * i);
    for (int k = 0; k < 3; k++)
      c->to[3 * i + k] += by[k];
  }
  set_middles(c);
}

static double squares(const cloud *c, const double m[12])
{
  double sum = 0;
  for (size_t i = 0; i < c->count; i++) {
    double y[3];
    apply(m, c->from + 3 * i, y);
    sum += pow(gap(y, c->to + 3 * i), 2);
  }
  return sum;
}

static void check_motion(const double m[12])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double product =
        m[4 * i] * m[4 * j] + m[4 * i + 1] * m[4 * j + 1] + m[4 * i + 2] * m[4 * j + 2];
      assert_true(fabs(product - (i == j)) < 1e-14);
    }
  const double determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) -
                             m[1] * (m[4] * m[10] - m[6] * m[8]) +
                             m[2] * (m[4] * m[9] - m[5] * m[8]);
  assert_true(fabs(determinant - 1) < 1e-14);
}

/* Points that were moved as a body, of any size and anywhere, go where they went, and on the
 * way as quaternions do. */
static void motions_are_found(void **unused)
{
  (void)unused;
  static const double sizes[] = {1, 1e-3, 1e5, 1e-150, 1e150};
  uint64_t state = 3;
  for (int t = 0; t < 300; t++) {
    const double size = sizes[t % 5], by[3] = {3 * size, -size, 0.5 * size};
    double q[4];
    cloud c;
    random_cloud(&state, 3 + random_below(&state, 10), size, t % 3 ? 0 : 20 * size, &c);
    random_quaternion(&state, q);
    if (t % 7 == 0)
      q[0] = q[1] = q[2] = 0, q[3] = 1; /* half a turn */
    move(&c, q, by);
    zs_rigid rigid;
    assert_true(zs_rigid_fit(3, c.from, c.to, c.count, &rigid));
    assert_true(rigid.angle >= 0 && rigid.angle <= PI + 1e-15);
    const double part = random_between(&state, 0, 1);
    double whole[12], forward[12], inverse[12], half[4];
    zs_rigid_at(&rigid, 1, whole, NULL);
    zs_rigid_at(&rigid, part, forward, inverse);
    check_motion(whole);
    check_motion(forward);
    slerp(q, part, half);
    for (size_t i = 0; i < c.count; i++) {
      double there[3], way[3], back[3], expected[3], arm[3];
      apply(whole, c.from + 3 * i, there);
      assert_true(gap(there, c.to + 3 * i) < 1e-12 * size * 30);
      apply(forward, c.from + 3 * i, way);
      apply(inverse, way, back);
      assert_true(gap(back, c.from + 3 * i) < 1e-12 * size * 30);
      if (t % 7 == 0)
        continue; /* either way round */
      for (int k = 0; k < 3; k++)
        arm[k] = c.from[3 * i + k] - c.middle[0][k];
      turn(half, arm, expected);
      for (int k = 0; k < 3; k++)
        expected[k] += (1 - part) * c.middle[0][k] + part * c.middle[1][k];
      assert_true(gap(way, expected) < 1e-11 * size * 30);
    }
    zs_rigid_at(&rigid, 0, forward, NULL);
    for (int i = 0; i < 12; i++)
      assert_true(fabs(forward[i] - (i % 5 == 0)) <= (i % 4 == 3 ? 1e-13 * size * 30 : 1e-15));
  }
}

/* No other motion comes nearer, not even to mirror images: neither a little different one nor
 * any of many. */
static void nothing_is_nearer(void **unused)
{
  (void)unused;
  uint64_t state = 17;
  for (int t = 0; t < 60; t++) {
    cloud c;
    const unsigned dimension = t % 3 == 0 ? 2 : 3;
    random_cloud(&state, 1 + random_below(&state, 12), 1, 0, &c);
    for (size_t i = 0; i < c.count; i++)
      for (int k = 0; k < 3; k++) {
        const double noise = t % 2 ? 0.3 * random_between(&state, -1, 1) : 0;
        c.to[3 * i + k] = (k == 0 ? -1 : 1) * c.from[3 * i + k] + noise; /* mirrored */
      }
    for (size_t i = 0; dimension == 2 && i < c.count; i++)
      c.from[3 * i + 2] = c.to[3 * i + 2] = 0;
    set_middles(&c);
    zs_rigid rigid;
    double m[12];
    assert_true(zs_rigid_fit(dimension, c.from, c.to, c.count, &rigid));
    zs_rigid_at(&rigid, 1, m, NULL);
    check_motion(m);
    assert_true(dimension == 3 || fabs(rigid.axis[2]) == 1);
    const double least = squares(&c, m);
    for (int i = 0; i < 2000; i++) {
      zs_rigid other = rigid;
      double n[12];
      if (dimension == 3)
        for (int k = 0; k < 3; k++)
          other.axis[k] += i % 2 ? 0.05 * random_between(&state, -1, 1)
                                 : 2 * random_between(&state, -1, 1);
      const double length = hypot(hypot(other.axis[0], other.axis[1]), other.axis[2]);
      for (int k = 0; k < 3; k++)
        other.axis[k] /= length;
      other.angle = i % 2 ? rigid.angle + 0.05 * random_between(&state, -1, 1)
                          : random_between(&state, -PI, PI);
      zs_rigid_at(&other, 1, n, NULL);
      assert_true(squares(&c, n) >= least - 1e-12);
    }
  }
}

/* Points on a line turn by the angle between the lines, about what is across both; one point, or
 * several that are one, not at all. */
static void free_motions_are_least(void **unused)
{
  (void)unused;
  uint64_t state = 8;
  for (int t = 0; t < 200; t++) {
    double q[4], d[3] = {0.6, 0, 0.8}, e[3];
    const double by[3] = {1, 2, 3};
    cloud c = {.count = 2 + random_below(&state, 4)};
    random_quaternion(&state, q);
    turn(q, d, e);
    memcpy(d, e, sizeof d);
    random_quaternion(&state, q);
    if (t % 5 == 0) { /* the other way round: half a turn about an axis across d */
      const double across[3] = {d[1], -d[0], 0}, length = hypot(d[0], d[1]);
      q[0] = 0;
      for (int k = 0; k < 3; k++)
        q[1 + k] = across[k] / length;
    }
    for (size_t i = 0; i < c.count; i++) {
      const double s = i == 0 ? 1 : random_between(&state, -1, 1);
      for (int k = 0; k < 3; k++)
        c.from[3 * i + k] = 0.3 * k + s * d[k];
    }
    move(&c, q, by);
    turn(q, d, e);
    zs_rigid rigid;
    double m[12];
    assert_true(zs_rigid_fit(3, c.from, c.to, c.count, &rigid));
    const double cosine = d[0] * e[0] + d[1] * e[1] + d[2] * e[2];
    assert_true(fabs(cos(rigid.angle) - cosine) < 1e-6);
    assert_true(fabs(rigid.axis[0] * d[0] + rigid.axis[1] * d[1] + rigid.axis[2] * d[2]) < 1e-6);
    zs_rigid_at(&rigid, 1, m, NULL);
    check_motion(m);
    assert_true(squares(&c, m) < 1e-11);

    for (size_t i = 0; i < 3 * c.count; i++)
      c.from[i] = 0.7; /* all at one place */
    assert_true(zs_rigid_fit(3, c.from, c.to, c.count, &rigid) && rigid.angle == 0);
    assert_true(zs_rigid_fit(3, c.to, c.from, 1, &rigid) && rigid.angle == 0);
  }
  const zs_rigid still = zs_rigid_identity();
  double m[12];
  zs_rigid_at(&still, 0.3, m, NULL);
  for (int i = 0; i < 12; i++)
    assert_true(m[i] == (i % 5 == 0));
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(motions_are_found),
    cmocka_unit_test(nothing_is_nearer),
    cmocka_unit_test(free_motions_are_least),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
