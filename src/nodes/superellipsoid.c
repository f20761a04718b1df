#include "nodes/common.h"

struct superellipsoid {
  double radii[3], e1, e2;
};

/* Beyond, powers leave single precision. */
#define EXPONENT(member, name_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct superellipsoid, member), \
   .initial = "1", .unit = "1", .range = ZS_RANGE_BETWEEN, .minimum = 0.01, .maximum = 10, \
   .doc = doc_}

static const zs_attribute attributes[] = {
  {.name = "radii",
   .type = ZS_SCALE,
   .offset = offsetof(struct superellipsoid, radii),
   .initial = "1 1 1",
   .unit = "length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "half the extent along x, y and z"},
  EXPONENT(e1, "e1", "roundness from pole to pole: near 0 flat like a cylinder, 1 round, 2 pointed "
                     "like a double cone, above pinched"),
  EXPONENT(e2, "e2", "roundness about the z axis: near 0 a square, 1 a circle, 2 a square that "
                     "stands on a corner, above a pinched one"),
};

/* The p-norm (u^p + v^p)^(1/p), by the larger number and the ratio of the smaller to it, with
 * which no power is too large. */
#define NORM(LARGER, RATIO, P) LARGER " * (1 + " RATIO "^(" P "))^(1 / (" P "))"
#define RATIO(SMALLER, LARGER) "clamp(" SMALLER " / max(" LARGER ", 1e-30), 0, 1)"

const zs_kind zs_kind_superellipsoid = {
  .name = "superellipsoid",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "an ellipsoid that may be squarer or more pinched",
  .doc = "Of (|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) = F, with the radii a, b and c, "
         "f is (1 - F^(e1/2)) times the smallest radius. In the formula, s is the part of x and y.",
  .source = "A. Barr, Superquadrics and angle-preserving transformations, 1981",
  .trait = "distance bound where neither exponent is above 1",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct superellipsoid),
  .children = ZS_CHILDREN_NONE,
  .formula = "let u = abs(x / radii.x); let v = abs(y / radii.y); let w = abs(z / radii.z); "
             "let m = max(u, v); let t = " RATIO("min(u, v)", "m") "; "
             "let s = " NORM("m", "t", "2 / e2") "; "
             "let n = max(s, w); let q = " RATIO("min(s, w)", "n") "; "
             "min(radii.x, min(radii.y, radii.z)) * (1 - " NORM("n", "q", "2 / e1") ")",
};
