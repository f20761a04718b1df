/* The elements of the scene language that are no nodes, as entries like those
 * of the node kinds: the reader, the schemas and the manual work from them. */
#ifndef ZS_DOCUMENT_ELEMENTS_H
#define ZS_DOCUMENT_ELEMENTS_H

#include "nodes/kind.h"

/* Parameter structs, filled like those of nodes. */
struct zs_document_scene {
  const char *units, *main, *fits;
};
struct zs_document_param {
  const char *name, *doc;
  double value, minimum, maximum;
};
struct zs_document_domain {
  double minimum[3], maximum[3];
};
struct zs_document_object {
  const char *id, *title;
};
struct zs_document_use {
  const char *object;
};
struct zs_document_define {
  const char *name;
};
struct zs_document_argument {
  const char *name;
  double value;
};
struct zs_document_instance {
  const char *of;
};
struct zs_document_repeat {
  const char *variable;
  double from, to, step;
};
struct zs_document_include {
  const char *href;
};
struct zs_document_view {
  const char *id;
  double eye[3], target[3], up[3], direction[3], field_of_view;
};

/* `use`, `instance` and `repeat` stand where nodes stand; the first two are
 * placed like nodes, and `instance` takes its arguments as further attributes.
 * `argument` belongs in `define`; the others belong in `scene`, the root. */
extern const zs_kind zs_document_scene, zs_document_param, zs_document_domain, zs_document_object,
  zs_document_use, zs_document_define, zs_document_argument, zs_document_instance,
  zs_document_repeat, zs_document_include, zs_document_view;

/* All of them, NULL-terminated, in the manual's order. */
extern const zs_kind *const zs_document_kinds[];

/* The element of that name, or NULL. */
const zs_kind *zs_document_kind_find(const char *name);

/* True for use, instance and repeat. */
bool zs_document_kind_is_node(const zs_kind *kind);

/* The attributes that place a node: at, rotate, scale. */
struct zs_placement {
  double at[3], rotate[3], scale[3];
};
enum { ZS_PLACEMENT_ATTRIBUTES = 3 };
extern const zs_attribute zs_placement_attributes[ZS_PLACEMENT_ATTRIBUTES];

#endif
