/* Building a field: the interface that node kinds emit code through. */
#ifndef ZS_COMPILER_H
#define ZS_COMPILER_H

#include "base/diagnostic.h"
#include "base/expression.h"
#include "field/primitive.h"

typedef struct zs_compiler zs_compiler;

/* A value of the program under construction.  After an error (memory) values
 * are meaningless but safe to pass on; zs_compiler_finish reports it. */
typedef uint32_t zs_value;

/* Where a node is evaluated: `matrix` (3 x 4, row-major) applied to three base
 * values, or to the scene's coordinates when `root`.  Affine maps compose into
 * the matrix and cost nothing. */
typedef struct zs_coordinates {
  bool root;
  zs_value base[3]; /* when not root */
  double matrix[12];
} zs_coordinates;

/* Scene coordinates, unmoved. */
zs_coordinates zs_coordinates_root(void);
/* Coordinates that are three arbitrary values. */
zs_coordinates zs_coordinates_from(zs_value x, zs_value y, zs_value z);
/* `inverse` (3 x 4) applied after the coordinates: x' = inverse (x). */
zs_coordinates zs_coordinates_affine(const zs_coordinates *coordinates, const double inverse[12]);

/* The three coordinates as values. */
zs_value zs_emit_coordinate(zs_compiler *compiler, const zs_coordinates *coordinates, int axis);

zs_value zs_emit_constant(zs_compiler *compiler, double number);
/* A scalar function; constants fold, equal instructions are shared. */
zs_value zs_emit(zs_compiler *compiler, zs_function function, zs_value a, zs_value b, zs_value c);
/* Any operation.  `data` is copied when the operation says its size; otherwise
 * it must live as long as the field (zs_compiler_arena, zs_compiler_keep). */
zs_value zs_emit_operation(zs_compiler *compiler, const zs_operation *operation, const void *data,
                           zs_value a, zs_value b, zs_value c);

/* A primitive at the coordinates; `parameter` as the shape says. */
zs_value zs_emit_primitive(zs_compiler *compiler, zs_primitive_shape shape,
                           const double parameter[4], const zs_coordinates *coordinates);

/* Lower a parsed formula, variables[i] being the value of its variable i. */
zs_value zs_emit_expression(zs_compiler *compiler, const zs_expression *expression,
                            const zs_value *variables);

/* True and the number when a value is constant. */
bool zs_value_constant(const zs_compiler *compiler, zs_value value, double *number);

/* Memory that lives as long as the field. */
zs_arena *zs_compiler_arena(zs_compiler *compiler);
/* Call `release(data)` when the field is freed; false when memory is out, in
 * which case it has been called already, and zs_compiler_finish will report. */
bool zs_compiler_keep(zs_compiler *compiler, void *data, void (*release)(void *data));

zs_diag *zs_compiler_diag(zs_compiler *compiler);
const zs_control *zs_compiler_control(zs_compiler *compiler);
/* Record a fit for zs_field_fit; strings are borrowed for the field's life. */
void zs_compiler_add_fit(zs_compiler *compiler, const zs_fit_info *info);
/* The same for zs_field_correspondence. */
void zs_compiler_add_correspondence(zs_compiler *compiler, const zs_correspondence *correspondence);

/* One pointer for the caller's use, initially NULL: the nodes room keeps its
 * memo of compiled nodes there, in the compiler's arena. */
void **zs_compiler_client(zs_compiler *compiler);

/* The scene's cache of fits (scene/tree.h), or NULL when there is none. */
struct zs_cache;
struct zs_cache *zs_compiler_cache(zs_compiler *compiler);

/* `control` and `cache` may be NULL. */
zs_compiler *zs_compiler_new(const zs_control *control, struct zs_cache *cache, zs_diag *diag);
/* The finished field of `nodes` nodes, or NULL after an error; frees the
 * compiler either way. */
zs_field *zs_compiler_finish(zs_compiler *compiler, zs_value result, size_t nodes);
void zs_compiler_free(zs_compiler *compiler);

enum { ZS_ALL_AXES = 7 };

/* Where f >= 0 along some axes (one bit each) however far it reaches along the others, whose
 * ends become infinite: the origin when it is so nowhere.  False when bounds alone find no
 * ends, or memory is out. */
bool zs_field_extent(zs_field *field, unsigned axes, double lo[3], double hi[3]);

/* What zs_field_box answers, or where it looks when bounds alone find nothing.
 * Only before the field is shared. */
void zs_field_set_box(zs_field *field, const double lo[3], const double hi[3]);
void zs_field_set_hint(zs_field *field, const double lo[3], const double hi[3]);

#endif
