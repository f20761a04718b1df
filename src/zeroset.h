/* Zeroset: an XML-scripted implicit modelling kernel.
 *
 * The one public header, C17 and C++.  A scene describes a solid as a tree of
 * implicit nodes, f >= 0 inside.  Three types carry three lifetimes:
 *
 *   zs_scene   the specification: mutable, used by one thread at a time
 *   zs_field   the compiled model: immutable, reference counted, shared by all
 *   zs_eval    the working data of one thread: evaluating allocates only what
 *              shorter programs need, and takes no lock
 *
 * Conventions.  Lengths are in scene units, axes are right-handed with z up.
 * Boxes are (lo, hi) corners.  Everything that ends in _new or _load is freed
 * by the matching _free or _unref, both of which accept NULL; all other
 * pointers are borrowed, and NULL only where it says so.  A fallible call that
 * takes a sink `diag`, which may be NULL, returns NULL or false after reporting
 * at least one error to it.  The library never prints, exits or aborts, and
 * keeps no global state. */
#ifndef ZEROSET_H
#define ZEROSET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined __GNUC__
#define ZS_API __attribute__((visibility("default")))
#else
#define ZS_API
#endif

/* Version of the library in use, "major.minor.patch". */
ZS_API const char *zs_version(void);

/* Name of the instruction set in use: "baseline", "avx2" or "avx512".  The
 * environment variable ZEROSET_ISA may ask for a lesser one than the machine
 * offers. */
ZS_API const char *zs_isa(void);

/* ---- Diagnostics ------------------------------------------------------ */

typedef enum zs_status {
  ZS_OK = 0,
  ZS_ERROR_ARGUMENT = 1, /* a caller's mistake: option out of range, unknown name */
  ZS_ERROR_MEMORY = 2,   /* out of memory, or over the memory limit */
  ZS_ERROR_IO = 3,       /* a file could not be read or written */
  ZS_ERROR_SYNTAX = 4,   /* not well-formed XML, or a malformed number or expression */
  ZS_ERROR_SCHEMA = 5,   /* an element or attribute that the language does not allow */
  ZS_ERROR_GEOMETRY = 6, /* well-formed, but describes nothing that can exist */
  ZS_ERROR_UNABLE = 7,   /* could not be computed: singular fit, unbounded solid, ... */
  ZS_CANCELLED = 8       /* the progress callback asked to stop */
} zs_status;

typedef enum zs_severity { ZS_NOTE = 0, ZS_WARNING = 1, ZS_ERROR = 2 } zs_severity;

/* One diagnostic.  Strings live for the duration of the callback. */
typedef struct zs_diagnostic {
  zs_severity severity;
  zs_status code;
  const char *file;        /* NULL where there is no place */
  unsigned line, column;   /* 1-based, in characters; 0 unknown */
  const char *element;     /* element name, or NULL */
  const char *attribute;   /* attribute name, or NULL */
  const char *message;     /* lower case, no position, no full stop */
  const char *hint;        /* "did you mean 'radius'?", or NULL */
  const char *source_line; /* the text of the line, without its end, or NULL */
} zs_diagnostic;

/* A diagnostics sink, filled in by the caller.  The library counts what it
 * reports and keeps the status of the first error. */
typedef struct zs_diag {
  void (*report)(void *context, const zs_diagnostic *diagnostic); /* may be NULL */
  void *context;
  unsigned errors, warnings;
  zs_status status;
} zs_diag;

/* How jobs run; zs_control_init gives the defaults.  NULL stands for these
 * wherever a call takes a control. */
typedef struct zs_control {
  unsigned threads;      /* 0: one per processor; more than 1024 are not used */
  /* Bytes; 0: no limit.  Each of these is compared with it by itself, and refused when it is
   * larger (ZS_ERROR_MEMORY):
   *   - the bricks of a mesh's grid, with their programs, while they are sampled: those of one
   *     thread, times the threads; then its vertices and triangles, without those that creases
   *     add, and what ZS_MESH_FEATURES keeps by vertex
   *   - one layer of a volume's samples; as many as fit are held at once
   *   - the arrays by pixel of a picture or slice
   *   - what a fit is solved with, as predicted from the number of its constraints
   *   - the samples of <sample> and <minkowski-morph>, the inverse of <lattice-warp>
   * Scenes, fields, evaluators, what is read from files, <stack> and zs_mesh_simplify do not
   * count. */
  uint64_t memory_limit;
  bool brute;            /* evaluate every sample with the whole program */
  bool scalar;           /* compile nodes to scalar operations alone, from their formulas, whose
                            programs get shorter by choices alone: slow; to check, and to measure,
                            what is made of nodes otherwise */
  /* Called now and then from the calling thread; `fraction` is in 0..1.
   * Returning false cancels the job.  May be NULL. */
  bool (*progress)(void *context, const char *stage, double fraction);
  void *context;
} zs_control;

ZS_API void zs_control_init(zs_control *control);

/* ---- Scenes ----------------------------------------------------------- */

typedef struct zs_scene zs_scene;
typedef struct zs_field zs_field;
typedef struct zs_eval zs_eval;

/* Limits that no honest scene meets; zs_scene_options_init gives the defaults. */
typedef struct zs_scene_options {
  const char *const *allow_paths; /* folders that files may be read from, beside the scene's own */
  size_t allow_path_count;
  uint32_t maximum_depth;         /* nesting of elements, 256 */
  uint32_t maximum_nodes;         /* nodes after expansion, 10 000 000 */
  uint64_t maximum_file_size;     /* bytes of one scene file, 1 GiB */
} zs_scene_options;

ZS_API void zs_scene_options_init(zs_scene_options *options);

/* Load a scene from a file, or parse `length` bytes named `name` in messages
 * (relative files are then looked up in the folder of `name`).  All errors of a
 * document are looked for, unless it is not well-formed.  The first 50, in the
 * order of the text, are passed on, and then a note says how many more there
 * are: here, and where scenes are compiled and checked.  `options` may be NULL. */
ZS_API zs_scene *zs_scene_load(const char *path, const zs_scene_options *options, zs_diag *diag);
ZS_API zs_scene *zs_scene_parse(const char *text, size_t length, const char *name,
                                const zs_scene_options *options, zs_diag *diag);
ZS_API void zs_scene_free(zs_scene *scene);

/* The scene's units as written ("mm"), or "". */
ZS_API const char *zs_scene_units(const zs_scene *scene);

typedef struct zs_parameter {
  const char *name, *doc; /* doc may be "" */
  double value, minimum, maximum; /* -INFINITY, INFINITY where not given */
} zs_parameter;

ZS_API size_t zs_scene_parameter_count(const zs_scene *scene);
ZS_API bool zs_scene_parameter(const zs_scene *scene, size_t index, zs_parameter *parameter);

/* Set a parameter for the compilations that follow.  Unknown names and values
 * outside the parameter's range are errors. */
ZS_API bool zs_scene_set(zs_scene *scene, const char *name, double value, zs_diag *diag);

/* Ids of the objects in document order. */
ZS_API size_t zs_scene_object_count(const zs_scene *scene);
ZS_API const char *zs_scene_object(const zs_scene *scene, size_t index);

/* A camera.  `direction` is used when `has_eye` is false: look along it at the
 * whole solid.  It must not be zero, nor `eye` and `target` the same. */
typedef struct zs_view {
  const char *id; /* "" when the view has none */
  bool has_eye;
  double eye[3], target[3], up[3], direction[3];
  double field_of_view; /* degrees, vertical, from 0 to below 180; 0: parallel rays */
} zs_view;

ZS_API size_t zs_scene_view_count(const zs_scene *scene);
ZS_API bool zs_scene_view(const zs_scene *scene, size_t index, zs_view *view);

/* Compile an object (NULL: the main one) with the parameters as they are now.
 * Fits are made here and remembered by the scene, so that compiling again with
 * other parameters repeats only what changed. */
ZS_API zs_field *zs_scene_compile(zs_scene *scene, const char *object, const zs_control *control,
                                  zs_diag *diag);

/* Look for the errors that only compiling shows, such as fits without a
 * solution, in all objects.  What they share is compiled once. */
ZS_API bool zs_scene_check(zs_scene *scene, const zs_control *control, zs_diag *diag);

/* Make the fits of all objects, with the parameters as they are, and write the
 * scene again to `path`, in the folder of the scene's own file, naming a file of
 * fits beside it, PATH with the ending .fits.  A scene that names such a file
 * solves nothing that has not changed.  Warns when there is nothing to fit. */
ZS_API bool zs_scene_fit(zs_scene *scene, const char *path, const zs_control *control,
                         zs_diag *diag);

/* ---- Fields ----------------------------------------------------------- */

/* One more owner of a field, which is returned; freed with its last one.  Only
 * unref takes NULL.  Both may be called by any thread. */
ZS_API zs_field *zs_field_ref(zs_field *field);
ZS_API void zs_field_unref(zs_field *field);

/* The box for the back ends: the scene's domain as it is, or one found around
 * f >= 0 by bounds, with a margin of 1 % of its longest side all around.
 * zs_scene_compile looks for it, and this call then costs nothing; only where it
 * found none, every call looks again, which may take thousands of bounds.  False
 * for unbounded and empty solids, and where bounds do not tell (ZS_ERROR_UNABLE);
 * lo and hi may then hold anything.  May be called by any thread. */
ZS_API bool zs_field_box(zs_field *field, double lo[3], double hi[3], zs_diag *diag);

/* One variational fit made while compiling. */
typedef struct zs_fit_info {
  const char *element, *kernel, *method;
  unsigned line, dimension;
  size_t constraints;
  double seconds, residual; /* residual: max |f(c) - h| in the values' own unit */
  uint64_t bytes;
  const double *points;     /* 3 each: the points fitted that lie on the surface, in the scene's
                               coordinates, for as long as the field; NULL: of shapes between
                               which f lies, of 2D shapes, and inside maps that are not affine */
  size_t point_count;
} zs_fit_info;

/* What becomes what between two neighbouring levels of an <interpolate>, or slices of a <stack>. */
typedef struct zs_correspondence {
  const char *element;    /* "between" or "stack" */
  unsigned line;
  bool found;             /* by itself (correspondence="auto", stacks), or given by pairs */
  double level[2];        /* where they lie on the node's own axis; volumes begin at 0 */
  size_t count;           /* pairs; of stacks, a sample of their outlines that move */
  /* In the scene's coordinates, for as long as the field; NULL inside maps that are not affine:
   * the ways of the pairs from the lower level to the upper one, 3 numbers a place and
   * `places` places each, and a point of either level's plane and the planes' normal, of
   * length 1. */
  const double *ways;
  size_t places;
  double plane[2][3], normal[3];
} zs_correspondence;

typedef struct zs_field_info {
  size_t nodes;        /* nodes of the tree, shared ones once */
  size_t instructions; /* length of the program */
  size_t registers;
  size_t choices;      /* operations that pruning can shorten */
  size_t fits;
  uint64_t bytes;
  size_t correspondences;
} zs_field_info;

ZS_API void zs_field_describe(const zs_field *field, zs_field_info *info);
ZS_API bool zs_field_fit(const zs_field *field, size_t index, zs_fit_info *info);
/* Those of levels between which shapes move, from the lowest up in every node; false beyond the
 * last. */
ZS_API bool zs_field_correspondence(const zs_field *field, size_t index,
                                    zs_correspondence *correspondence);

/* The program as text, one instruction a line, in a string for free(). */
ZS_API char *zs_field_listing(const zs_field *field);

/* ---- Evaluation ------------------------------------------------------- */

/* What a caller needs to know of f; pruning may use it. */
typedef enum zs_request {
  ZS_REQUEST_SIGN = 0,  /* whether f >= 0; the magnitude is free */
  ZS_REQUEST_VALUE = 1, /* f itself */
  ZS_REQUEST_GRADIENT = 2
} zs_request;

/* Working data for one thread.  Holds a reference to the field. */
ZS_API zs_eval *zs_eval_new(zs_field *field, zs_diag *diag);
ZS_API void zs_eval_free(zs_eval *eval);

/* Values at n points origin + (x, y, z); origin may be NULL for the scene's.
 * Coordinates are relative so that single precision loses nothing far from the
 * scene's origin.  Arrays hold n floats with no alignment asked; f may be one
 * of the inputs.  Takes no lock.  In a scene of many nodes points cost less the
 * more of them are given at once, from some thousands on: they are gone through
 * in groups of near ones, each by what matters to it, which may allocate;
 * without memory it only takes longer.  Results do not depend on it. */
ZS_API void zs_eval_values(zs_eval *eval, const double origin[3], size_t n, const float *x,
                           const float *y, const float *z, float *f);

/* The same with the gradient of f.  At a kink one of the one-sided gradients
 * is returned. */
ZS_API void zs_eval_gradients(zs_eval *eval, const double origin[3], size_t n, const float *x,
                              const float *y, const float *z, float *f, float *gx, float *gy,
                              float *gz);

/* f at one point, in double precision throughout. */
ZS_API double zs_eval_point(zs_eval *eval, const double point[3]);

/* Enclosures of f over n boxes: lo[i] .. hi[i] contains every value f takes in
 * box i.  NaN in both means unknown. */
ZS_API void zs_eval_bounds(zs_eval *eval, size_t n, const double (*box_lo)[3],
                           const double (*box_hi)[3], float *lo, float *hi);

/* Restrict the evaluator to a box: until zs_eval_release, only points and
 * boxes inside it may be asked for, and no more of f than `request` says.
 * Answers come from a shorter program; without memory for one, from the same as
 * before.  Restrictions nest, to ZS_MAXIMUM_REGIONS.  False, without a
 * diagnostic, only when there are so many: nothing is then changed, and there is
 * nothing to release. */
enum { ZS_MAXIMUM_REGIONS = 16 };
ZS_API bool zs_eval_restrict(zs_eval *eval, const double lo[3], const double hi[3],
                             zs_request request);
ZS_API void zs_eval_release(zs_eval *eval);

/* ---- Back ends -------------------------------------------------------- */

/* `control`, `report` and `inside` may be NULL in all of them.  So may the options
 * of zs_polygonize and zs_render, which are then the defaults, but not those of
 * slices.
 * `report` and `inside` tell something only when a job succeeds.  Options, grids
 * and boxes out of range are errors (ZS_ERROR_ARGUMENT): boxes have lo < hi, and
 * no coordinate beyond 1e30. */

/* A grid of boxes: `count` cells of size `cell` from corner `lo`, which do not
 * leave -1e30 .. 1e30.  Counts are from 1 to 2^20 along an axis, and at most
 * 2^48 in all.  Cells are > 0, and not too small for their coordinates to be
 * told apart in double precision. */
typedef struct zs_grid {
  double lo[3];
  double cell[3];
  uint32_t count[3];
} zs_grid;

/* The grid whose longest side has `resolution` cells, from 1 to 2^20; the cell
 * is cubic and the last cell of the other sides may stick out of hi. */
ZS_API bool zs_grid_fit(zs_grid *grid, const double lo[3], const double hi[3], uint32_t resolution,
                        zs_diag *diag);
/* The grid with cells of a given size along each axis; the last ones may stick
 * out of hi. */
ZS_API bool zs_grid_fit_cell(zs_grid *grid, const double lo[3], const double hi[3],
                             const double cell[3], zs_diag *diag);

/* What a job did.  Seconds are wall time. */
typedef struct zs_job_report {
  double seconds_evaluate, seconds_assemble;
  uint64_t evaluations; /* samples of f, gradients included, pruned ones not */
  uint64_t peak_bytes;  /* working memory, results included */
  unsigned threads;
} zs_job_report;

typedef enum zs_mesh_method {
  ZS_MESH_CONTOUR = 0,  /* vertices on the edges of the grid's cells, all on f = 0 */
  ZS_MESH_FEATURES = 1, /* vertices within the cells, on sharp edges and corners where a cell has
                           them: fewer slivers; on f = 0 but where an edge passes by a cell.
                           The cells lie up to a 20 000th of their size aside of the grid's, so that
                           faces in its planes do not coincide with theirs */
} zs_mesh_method;

typedef struct zs_mesh_options {
  zs_mesh_method method;
  bool normals;     /* unit vertex normals pointing out of the solid; true */
  bool cap;         /* close the surface where it meets the grid's faces; true */
  bool creases;     /* ZS_MESH_CONTOUR: vertices on sharp edges and corners too; true */
  double tolerance; /* vertices lie this close to f = 0, in units of the grid's
                       longest side, from 1e-7 to 0.01; 1e-6 */
  double collapse;  /* ZS_MESH_FEATURES: neighbouring vertices whose tangent planes are all this
                       close to a place between them become one, as far as the mesh stays a
                       manifold; in scene units, finite and >= 0; 0, which keeps all */
} zs_mesh_options;

ZS_API void zs_mesh_options_init(zs_mesh_options *options);

/* An indexed triangle mesh, counter-clockwise seen from outside. */
typedef struct zs_mesh zs_mesh;

/* Polygonize f = 0 inside the grid.  The result is closed, manifold and
 * oriented whatever f is, and the same for any number of threads.  An empty
 * mesh is an error (ZS_ERROR_UNABLE). */
ZS_API zs_mesh *zs_polygonize(zs_field *field, const zs_grid *grid, const zs_mesh_options *options,
                              const zs_control *control, zs_job_report *report, zs_diag *diag);

ZS_API void zs_mesh_free(zs_mesh *mesh);
ZS_API size_t zs_mesh_vertex_count(const zs_mesh *mesh);
ZS_API size_t zs_mesh_triangle_count(const zs_mesh *mesh);
ZS_API const float *zs_mesh_positions(const zs_mesh *mesh);   /* 3 per vertex */
ZS_API const float *zs_mesh_normals(const zs_mesh *mesh);     /* 3 per vertex, or NULL */
ZS_API const uint32_t *zs_mesh_triangles(const zs_mesh *mesh); /* 3 per triangle */

/* Topology and measures of a mesh.  Volume is 0 for an open mesh. */
typedef struct zs_mesh_report {
  bool closed, manifold, oriented;
  size_t components, boundary_edges, nonmanifold_edges, nonmanifold_vertices;
  int64_t euler_characteristic;
  double volume, area;
} zs_mesh_report;

ZS_API bool zs_mesh_check(const zs_mesh *mesh, zs_mesh_report *report, zs_diag *diag);

/* Keep the connected components that points select, 3 coordinates each: every
 * point selects the one with the vertex nearest to it, unless that is farther
 * away than `reach`, in scene units from 0 to INFINITY, which is not checked.
 * The order of what is kept stays.  Nothing selected is an error
 * (ZS_ERROR_UNABLE), and leaves the mesh as it is. */
ZS_API bool zs_mesh_keep_components(zs_mesh *mesh, const double *points, size_t count,
                                    double reach, zs_diag *diag);

/* Simplify in place by quadric edge collapses while the surface stays within
 * `error` (scene units, finite and >= 0) of itself by the quadric measure.  The
 * mesh must be oriented and manifold, with or without boundary. */
ZS_API bool zs_mesh_simplify(zs_mesh *mesh, double error, const zs_control *control, zs_diag *diag);

/* Write to .stl .ply .obj .off .om by the name's ending, through a file beside
 * it that is renamed when complete. */
ZS_API bool zs_mesh_write(const zs_mesh *mesh, const char *path, zs_diag *diag);

typedef enum zs_quantity { ZS_QUANTITY_VALUE = 0, ZS_QUANTITY_INSIDE = 1 } zs_quantity;

/* Receives the samples of `count_z` whole z-layers from layer `z`, x fastest:
 * float f for VALUE, uint8_t 0 or 1 for INSIDE.  False stops the job. */
typedef bool zs_slab_sink(void *context, uint32_t z, uint32_t count_z, const void *samples);

/* Sample f at the cell centres of a grid, slab by slab in order of z: bounded
 * memory for any size.  `inside` gets the number of samples with f >= 0.  A sink
 * that returns false ends the job with ZS_CANCELLED. */
ZS_API bool zs_voxelize(zs_field *field, const zs_grid *grid, zs_quantity quantity,
                        zs_slab_sink *sink, void *context, uint64_t *inside,
                        const zs_control *control, zs_job_report *report, zs_diag *diag);

typedef enum zs_sample_type {
  ZS_SAMPLE_U8 = 0,
  ZS_SAMPLE_I16 = 1,
  ZS_SAMPLE_F32 = 2,
  ZS_SAMPLE_F64 = 3
} zs_sample_type;

/* Sample straight into a volume file: .vti .nrrd .mhd .nii .nii.gz .raw by the
 * name's ending.  VALUE is written as f32 or f64, INSIDE as any type. */
ZS_API bool zs_voxelize_file(zs_field *field, const zs_grid *grid, zs_quantity quantity,
                             zs_sample_type type, const char *path, uint64_t *inside,
                             const zs_control *control, zs_job_report *report, zs_diag *diag);

/* An image: rows top to bottom, `channels` bytes a pixel (1 grey, 3 RGB). */
typedef struct zs_image {
  uint32_t width, height, channels;
  uint8_t *pixels; /* width * height * channels, owned */
} zs_image;

ZS_API void zs_image_clear(zs_image *image);
ZS_API bool zs_image_write(const zs_image *image, const char *path, zs_diag *diag); /* .png */

typedef enum zs_render_mode {
  ZS_RENDER_SHADED = 0,
  ZS_RENDER_NORMALS = 1,
  ZS_RENDER_DEPTH = 2
} zs_render_mode;

typedef struct zs_render_options {
  uint32_t width, height; /* from 1 to 32768 each; 800 x 600 */
  zs_render_mode mode;
  zs_view view;           /* from the scene, or zs_view_named */
} zs_render_options;

ZS_API void zs_render_options_init(zs_render_options *options);
/* The built-in views "front", "back", "left", "right", "top", "bottom", "iso". */
ZS_API bool zs_view_named(zs_view *view, const char *name, zs_diag *diag);

/* Ray-cast the part of the solid inside a box.  A cut by the box is shaded as
 * a flat face.  What `image` holds before is not looked at, nor freed; after an
 * error it is empty. */
ZS_API bool zs_render(zs_field *field, const double lo[3], const double hi[3],
                      const zs_render_options *options, zs_image *image, const zs_control *control,
                      zs_job_report *report, zs_diag *diag);

typedef struct zs_slice_options {
  uint32_t width, height; /* pixels, from 1 to 32768 each; 1024 x 1024 */
  int axis;               /* 0 x, 1 y, 2 z */
  double at;              /* where along the axis, within the box or on its faces; 0 */
  zs_quantity quantity;   /* VALUE: a coloured field with contour lines; INSIDE: black and white */
  bool correspondence;    /* false; true: draw over it what becomes what (zs_correspondence): of
                             gaps that the plane lies in, across their axis, arrows and the outlines
                             on both levels; of others arrows only, seen from where the slice is.
                             An error in a picture of INSIDE */
} zs_slice_options;

ZS_API void zs_slice_options_init(zs_slice_options *options);

/* A cross-section of the box as a picture.  Pixels are square: the box is
 * centred in the picture.  Seen from the axis' positive end, so that for z the
 * picture's right is x and its top is y.  `inside` gets the number of pixels in
 * the box with f >= 0; `image` is as in zs_render. */
ZS_API bool zs_slice(zs_field *field, const double lo[3], const double hi[3],
                     const zs_slice_options *options, zs_image *image, uint64_t *inside,
                     const zs_control *control, zs_job_report *report, zs_diag *diag);

/* The same as an SVG file, in the scene's own coordinates with y (or z) up: the solid's
 * outline, filled, found between pixels too, and for VALUE contour lines of f.  The file
 * appears only when it is complete. */
ZS_API bool zs_slice_svg(zs_field *field, const double lo[3], const double hi[3],
                         const zs_slice_options *options, const char *path, uint64_t *inside,
                         const zs_control *control, zs_job_report *report, zs_diag *diag);

/* ---- The language, as data -------------------------------------------- */

typedef enum zs_document {
  ZS_DOCUMENT_RELAX_NG = 0, /* schema/zeroset.rng */
  ZS_DOCUMENT_XSD = 1,      /* schema/zeroset.xsd */
  ZS_DOCUMENT_NODES = 2,    /* doc/nodes.md, the reference manual */
  ZS_DOCUMENT_SUMMARY = 3   /* one line per node kind */
} zs_document;

/* A generated document as text for free(); NULL when memory is out. */
ZS_API char *zs_document_text(zs_document document);
/* The manual's section on one element, or NULL with an error and a suggestion. */
ZS_API char *zs_document_node(const char *name, zs_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
