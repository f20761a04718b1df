/* The inside of a scene, for the files of this room. */
#ifndef ZS_SCENE_H
#define ZS_SCENE_H

#include "base/names.h"
#include "base/xml.h"
#include "scene/document.h"
#include "scene/gate.h"
#include "scene/tree.h"

/* One scene file.  Files are linked in the order in which they were read. */
typedef struct zs_file {
  zs_source source; /* first, so that an element's source leads to its file */
  zs_lines lines;                 /* of the source */
  const char *folder;             /* with a slash at its end, or "" */
  uint64_t device, inode;         /* which file it is; 0 for text in memory */
  const zs_element *root;
  const struct zs_file *includer; /* while it is being read: the chain to the top */
  bool open;                      /* being read */
  struct zs_file *next;
} zs_file;

typedef struct zs_scene_parameter_state {
  const zs_element *element;
  struct zs_document_param at; /* value, range and texts as they are now */
  bool known;                  /* false after an error in its value */
  bool set;                    /* by zs_scene_set, to: */
  double chosen;
} zs_scene_parameter_state;

typedef struct zs_scene_object_state {
  const char *id;
  const zs_element *element;
} zs_scene_object_state;

typedef struct zs_definition {
  const char *name;
  const zs_element *element;
  const zs_element **arguments;
  const char **argument_names;
  size_t argument_count;
} zs_definition;

typedef struct zs_scene_view_state {
  const zs_element *element;
  zs_view view;
} zs_scene_view_state;

/* A kind's parameters with every default filled in. */
typedef struct zs_defaults {
  const zs_kind *kind;
  const void *parameters;
} zs_defaults;

/* A growing array. */
#define ZS_LIST(type) \
  struct { \
    type *items; \
    size_t count, capacity; \
  }

struct zs_scene {
  zs_arena arena; /* documents, and what is parsed from them */
  zs_scene_options options;
  const char **roots; /* folders that files may be in, resolved */
  size_t root_count;
  zs_file *files; /* the first is the scene's own */
  struct zs_document_scene attributes;
  zs_names parameter_names, object_names, definition_names, view_names;
  ZS_LIST(zs_scene_parameter_state) parameters;
  ZS_LIST(zs_scene_object_state) objects;
  ZS_LIST(zs_definition) definitions;
  ZS_LIST(zs_scene_view_state) views;
  ZS_LIST(zs_defaults) defaults;
  const zs_element *domain;
  size_t visible_parameters; /* those that expressions may name at the moment */
  zs_warned warned;
  zs_cache *cache;
};

/* Room for one more item of a list in the scene's arena: a pointer to it, or
 * NULL after reporting that memory is out. */
void *zs_list_add(void *items, size_t *count, size_t *capacity, size_t size, zs_arena *arena,
                  zs_diag *diag);
#define ZS_LIST_ADD(list, scene, diag) \
  zs_list_add(&(list).items, &(list).count, &(list).capacity, sizeof *(list).items, \
              &(scene)->arena, diag)

/* ---- value.c ------------------------------------------------------------- */

/* A name that expressions know beside the parameters, and those around it. */
typedef struct zs_scope {
  const char *name;
  double value;
  bool known; /* false: stands for any number, in the body of a definition */
  const struct zs_scope *outer;
} zs_scope;

/* Where attributes are read: the names known, and the memory for results. */
typedef struct zs_reading {
  zs_scene *scene;
  zs_arena *arena;
  zs_diag *diag;
  const zs_scope *scope;
  bool unknown; /* set when a value depends on an unknown number */
} zs_reading;

/* What attributes an element may have: those of its kind, and those that place
 * a node when `placed`.  Attributes that are neither are left to the caller
 * when `open`. */
typedef struct zs_attribute_rule {
  const zs_kind *kind;
  bool placed, open;
} zs_attribute_rule;

/* Read an element's attributes into a new parameter struct, and into
 * `placement` (filled with its defaults first).  Bit i of `given` tells that
 * attribute i was written, bits of `placed` the same of the placement.  All
 * errors are reported; NULL only when memory is out. */
void *zs_attributes_read(zs_reading *reading, const zs_element *element, zs_attribute_rule rule,
                         uint64_t *given, struct zs_placement *placement, unsigned *placed);

/* The index of the attribute of that name in the kind, or SIZE_MAX. */
size_t zs_kind_attribute(const zs_kind *kind, const char *name);

/* Read one attribute as one number. */
bool zs_number_read(zs_reading *reading, const zs_element *element, zs_xml_attribute *attribute,
                    double *value);

/* Whether a text can be a name in expressions; reports if not. */
bool zs_identifier_check(const zs_element *element, const zs_xml_attribute *attribute,
                         zs_diag *diag);

/* Report that there is no WHAT 'WORD', with the nearest of the names there are.
 * Without a place it is the caller's mistake.  Returns false. */
bool zs_fail_reference(const zs_place *place, const char *what, const char *word,
                       const zs_names *names, zs_diag *diag);

/* ---- path.c -------------------------------------------------------------- */

/* Set the folders that files may be in: that of `name` and the options'. */
bool zs_paths_init(zs_scene *scene, const char *name, zs_diag *diag);

/* The folder of a file name, with a slash at its end, or "". */
const char *zs_path_folder(const char *name, zs_arena *arena);

/* The path that `reference`, written in a file in `folder`, leads to, or NULL
 * after reporting at `place`.  Only files below the allowed folders exist. */
const char *zs_path_resolve(const zs_scene *scene, const char *folder, const char *reference,
                            zs_arena *arena, const zs_place *place, zs_diag *diag);

/* The files that a name leads to which may be a pattern: `*` stands for any characters of the
 * last part of a name, `?` for one.  In natural order; false after reporting, also when
 * there are none. */
bool zs_paths_find(const zs_scene *scene, const char *folder, const char *reference,
                   zs_arena *arena, zs_files *files, const zs_place *place, zs_diag *diag);

/* ---- expand.c ------------------------------------------------------------ */

/* Expand everything there is, to find its errors. */
void zs_scene_validate(zs_scene *scene, zs_diag *diag);

/* ---- load.c -------------------------------------------------------------- */

/* Evaluate the parameters, and what depends on them. */
void zs_scene_update(zs_scene *scene, zs_diag *diag);

/* The domain as it is now; false when there is none, or after an error. */
bool zs_scene_domain(zs_scene *scene, double lo[3], double hi[3], zs_diag *diag);

/* The file an element stands in. */
static inline const zs_file *zs_file_of(const zs_element *element)
{
  return (const zs_file *)(const void *)element->source;
}

/* ---- cache.c ------------------------------------------------------------- */

zs_cache *zs_cache_new(void);
void zs_cache_free(zs_cache *cache);
/* Begin a compilation; what the last few did not ask for is let go. */
void zs_cache_advance(zs_cache *cache);

#endif
