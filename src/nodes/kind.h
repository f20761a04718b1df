/* What the scene language knows of an element: one constant table entry per
 * kind.  The reader, the compiler, the manual, the schemas and the tests all
 * work from these entries. */
#ifndef ZS_KIND_H
#define ZS_KIND_H

#include "base/diagnostic.h"
#include "base/expression.h"
#include "field/compiler.h"

/* ---- Attributes -------------------------------------------------------- */

typedef enum zs_attribute_type {
  ZS_NUMBER,  /* double */
  ZS_INTEGER, /* int */
  ZS_VECTOR2, /* double[2] */
  ZS_VECTOR3, /* double[3] */
  ZS_SCALE,   /* double[3]; one number stands for three */
  ZS_CHOICE,  /* int: index into choices */
  ZS_BOOLEAN, /* bool: "true" or "false" */
  ZS_TEXT,    /* const char * */
  ZS_FILE,    /* const char *: the path to open, checked and resolved */
  ZS_FILES,   /* zs_files: one path, or all that a pattern matches */
  ZS_NUMBERS, /* zs_numbers: any number of numbers */
  ZS_FORMULA  /* zs_formula: text in x, y, z (and f), the scene's parameters */
} zs_attribute_type;

typedef struct zs_numbers {
  const double *values;
  size_t count;
} zs_numbers;

/* Paths to open, in natural order: numbers in names count as numbers. */
typedef struct zs_files {
  const char *const *paths;
  size_t count; /* 0: absent */
} zs_files;

/* A parsed formula.  Variable i of the expression is a coordinate or f
 * (axis[i] = 0, 1, 2 for x, y, z; 3 for f), or a number (axis[i] = -1). */
typedef struct zs_formula {
  const zs_expression *expression; /* NULL: absent */
  const int *axis;
  const double *number;
} zs_formula;

typedef enum zs_range {
  ZS_RANGE_ANY,
  ZS_RANGE_POSITIVE,     /* > 0 */
  ZS_RANGE_NOT_NEGATIVE, /* >= 0 */
  ZS_RANGE_NOT_ZERO,
  ZS_RANGE_BETWEEN       /* minimum <= value <= maximum */
} zs_range;

typedef struct zs_attribute {
  const char *name;    /* as written: "top-radius" */
  zs_attribute_type type;
  size_t offset;       /* into the parameter struct */
  const char *initial; /* default as an author would write it; NULL: required;
                          "": absent leaves the field zero (numbers: NaN) */
  const char *unit;    /* "length", "degrees", "1", "" */
  zs_range range;
  double minimum, maximum;
  const char *const *choices; /* NULL-terminated; of a ZS_NUMBER: words that may be written
                                 instead of a number: the first ("auto") leaves NaN, a second
                                 one ("none") infinity */
  const char *doc;
} zs_attribute;

struct zs_fill;

/* ---- Nodes ------------------------------------------------------------- */

typedef struct zs_node zs_node;
typedef struct zs_kind zs_kind;

/* A box, infinite where unknown. */
typedef struct zs_box {
  double lo[3], hi[3];
} zs_box;

/* One node of the tree, after expressions, repeats and instances. */
struct zs_node {
  const zs_kind *kind;
  void *parameters;      /* the kind's parameter struct, all attributes read */
  zs_node *const *children; /* nodes and parts in document order */
  size_t child_count;
  const double *placement; /* 3 x 4 inverse of at/rotate/scale, or NULL */
  double placement_scale;  /* factor that keeps f a distance: min |scale| */
  uint64_t given;          /* bit i: attribute i of the kind was written */
  zs_place place;          /* of the start tag */
  const struct zs_element *element; /* the reader's, for zs_node_place; NULL: made by hand */
};

/* Place of an attribute of a node, for messages; the tag's when not written. */
zs_place zs_node_place(const zs_node *node, const char *attribute);

typedef enum zs_family {
  ZS_FAMILY_PRIMITIVE, ZS_FAMILY_SHAPE, ZS_FAMILY_SOLID_FROM_SHAPE, ZS_FAMILY_SET,
  ZS_FAMILY_BLEND, ZS_FAMILY_FUNCTION_MAP, ZS_FAMILY_COORDINATE_MAP, ZS_FAMILY_INTERPOLATION,
  ZS_FAMILY_DATA, ZS_FAMILY_PART, /* an element that is only allowed inside certain nodes */
  ZS_FAMILY_COUNT
} zs_family;

typedef enum zs_children {
  ZS_CHILDREN_NONE,  /* no node (parts may be) */
  ZS_CHILDREN_ONE,   /* at least one node; several are their union */
  ZS_CHILDREN_MANY,  /* at least one, each counts */
  ZS_CHILDREN_TWO    /* at least two, each counts */
} zs_children;

/* A variant of a kind's formula, chosen by a choice attribute. */
typedef struct zs_variant {
  const char *attribute, *choice; /* NULL: always */
  const char *formula;
} zs_variant;

struct zs_kind {
  const char *name;     /* element name */
  zs_family family;
  const char *summary;  /* one line, no full stop */
  const char *doc;      /* a paragraph more, or NULL */
  const char *source;   /* the paper or book it comes from, or NULL */
  const char *trait;    /* "exact distance", "distance bound", ... or NULL */

  const zs_attribute *attributes;
  size_t attribute_count;
  size_t parameters_size;
  zs_children children;
  const zs_kind *const *parts; /* NULL-terminated; NULL: none */
  bool text;            /* the element's text is the attribute named "formula" */

  /* The definition in the expression language.  Attributes are variables by
   * name, '-' written '_', vectors as size.x .y .z; angles as written, in
   * degrees.  A leaf: f of x, y, z.  A function map: f of the child's f.  A
   * set operation or blend: f of a and b, folded left over the children.
   * A coordinate map gives three formulas for the point its child is evaluated
   * at, and may give a `value` for f of the child's f. */
  const char *formula;
  const char *map[3];
  const zs_variant *variants; /* ends with a NULL formula; instead of formula */

  /* Checks that the table cannot say; reports and returns false.  Optional. */
  bool (*check)(const zs_node *node, zs_diag *diag);
  /* Joins two operands of a set operation or blend, in place of its formula;
   * folded left over the children.  Optional. */
  zs_value (*combine)(zs_compiler *compiler, const zs_node *node, zs_value a, zs_value b);
  /* Emits f.  NULL: from what stands above.  Errors are reported to
   * zs_compiler_diag; any value may then be returned. */
  zs_value (*emit)(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at);
  /* The same f by operations made for the kind, in place of `emit` and the
   * formulas.  Optional; left out where a compilation is for scalar operations
   * only, which tests compare with.  `combine` is another such shortcut. */
  zs_value (*fused)(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at);
  /* The boundary of a plane shape with straight edges, or edges that stand for curves: added to
   * an empty fill, in the node's coordinates, resolved.  It stays empty where the attributes
   * make other edges.  False after reporting.  Optional. */
  bool (*outline)(const zs_node *node, struct zs_fill *fill, zs_diag *diag);
  /* A box that holds the solid, in the node's coordinates, from those of its
   * child nodes (one, of their union, for CHILDREN_ONE).  Asked for when bounds
   * of the program find none.  Optional: then there is none to be had. */
  zs_box (*box)(const zs_node *node, const zs_box *children, size_t count);
};

/* All kinds, parts not included, NULL-terminated, in the manual's order. */
extern const zs_kind *const zs_kinds[];
/* Linear in the length of the name; NULL if there is none. */
const zs_kind *zs_kind_find(const char *name);

/* ---- For the emit functions -------------------------------------------- */

/* Compile a node at coordinates (applying its placement).  Shared nodes at the
 * same coordinates compile once. */
zs_value zs_node_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at);
/* The union of a node's child nodes (parts skipped): CHILDREN_ONE. */
zs_value zs_children_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at);
/* The same union as a field of its own, in the node's coordinates, for zs_field_unref: compiled
 * apart, with the control and the cache of `compiler`.  NULL after reporting to `diag`. */
zs_field *zs_children_field(zs_compiler *compiler, const zs_node *node, zs_diag *diag);
/* Lower one of the kind's own formulas with the node's attributes, the
 * coordinates `at` as x y z, and the values f or a, b where it names them. */
zs_value zs_formula_emit(zs_compiler *compiler, const zs_node *node, const char *formula,
                         const zs_coordinates *at, zs_value a, zs_value b);
/* Lower an author's formula. */
zs_value zs_author_formula_emit(zs_compiler *compiler, const zs_formula *formula,
                                const zs_coordinates *at, zs_value f);
/* Generic emit of a kind from `combine` or its formulas (what `emit` == NULL
 * does). */
zs_value zs_kind_emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at);

#define ZS_COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

/* Attribute rows.  FIELD is `struct kind, member`. */
#define ZS_LENGTH(struct_, member, name_, initial_, range_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "length", .range = range_, .doc = doc_}
#define ZS_PLAIN(struct_, member, name_, initial_, range_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "1", .range = range_, .doc = doc_}
#define ZS_ANGLE(struct_, member, name_, initial_, doc_) \
  {.name = name_, .type = ZS_NUMBER, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "degrees", .range = ZS_RANGE_ANY, .doc = doc_}
#define ZS_POINT(struct_, member, name_, initial_, doc_) \
  {.name = name_, .type = ZS_VECTOR3, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "length", .range = ZS_RANGE_ANY, .doc = doc_}
#define ZS_SELECT(struct_, member, name_, initial_, choices_, doc_) \
  {.name = name_, .type = ZS_CHOICE, .offset = offsetof(struct_, member), .initial = initial_, \
   .unit = "", .choices = choices_, .doc = doc_}

#endif
