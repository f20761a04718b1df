#include "nodes/common.h"

struct quadric {
  double squares[3], products[3], linear[3], constant;
};

#define COEFFICIENTS(member, name_, doc_) \
  {.name = name_, .type = ZS_VECTOR3, .offset = offsetof(struct quadric, member), \
   .initial = "0 0 0", .unit = "1", .doc = doc_}

static const zs_attribute attributes[] = {
  COEFFICIENTS(squares, "squares", "factors of x^2, y^2 and z^2"),
  COEFFICIENTS(products, "products", "factors of x y, y z and z x"),
  COEFFICIENTS(linear, "linear", "factors of x, y and z"),
  ZS_PLAIN(struct quadric, constant, "constant", "0", ZS_RANGE_ANY, "what is added to them"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct quadric *p = node->parameters;
  for (int k = 0; k < 3; k++)
    if (p->squares[k] != 0 || p->products[k] != 0 || p->linear[k] != 0)
      return true;
  return zs_node_fail(node, diag, NULL,
                      "all factors are 0; expected 'squares', 'products' or 'linear'");
}

const zs_kind zs_kind_quadric = {
  .name = "quadric",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "where a polynomial of degree two in x, y and z is not negative",
  .doc = "Ellipsoids, paraboloids, hyperboloids of one sheet and of two, cylinders, cones and "
         "pairs of planes, in any position. f is the polynomial, not a distance.",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct quadric),
  .children = ZS_CHILDREN_NONE,
  .formula = "squares.x * x^2 + squares.y * y^2 + squares.z * z^2 + "
             "products.x * x * y + products.y * y * z + products.z * z * x + "
             "linear.x * x + linear.y * y + linear.z * z + constant",
  .check = check,
};
