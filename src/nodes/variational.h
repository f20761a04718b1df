/* Inside <variational>: from its parts to samples, from samples to a fit. */
#ifndef ZS_NODES_VARIATIONAL_H
#define ZS_NODES_VARIATIONAL_H

#include "nodes/common.h"
#include "rbf/constraints.h"
#include "rbf/sum.h"
#include "scene/tree.h"

#include <stdatomic.h>

/* The element's attributes. */
struct variational {
  int kernel; /* 0 is "auto", then zs_rbf_kernel + 1 */
  int degree, dimension, sides, budget;
  double sigma, normal_offset, smoothing, tolerance, separation, accuracy; /* NaN: automatic, or
                                                                              not given */
  zs_numbers slice;
};
enum { ZS_VARIATIONAL_BOTH_SIDES = 0 };                 /* `sides` */
enum { ZS_VARIATIONAL_AUTO, ZS_VARIATIONAL_PLANE, ZS_VARIATIONAL_SPACE }; /* `dimension` */

/* The dimension of the space that f is in: 2 or 3 (variational.c). */
unsigned zs_variational_space(const zs_node *node);

/* f of a fit at coordinates in the scene's units (variational.c). */
zs_value zs_variational_sum_emit(zs_compiler *compiler, const zs_rbf_sum *sum, const zs_rbf *rbf,
                                 const zs_coordinates *at);

/* ---- Parts (variational_parts.c) ----------------------------------------------- */

/* <mesh>, <points>, <point>, <contour>, <image>: what gives samples. */
extern const zs_kind zs_variational_mesh, zs_variational_points, zs_variational_point,
  zs_variational_contour, zs_variational_image;
/* <shape>: samples at other coordinates beyond space; its `at`. */
extern const zs_kind zs_variational_shape;
const zs_numbers *zs_variational_shape_at(const zs_node *shape);

/* 2 when all samples of the parts of `node`, or of its shapes, lie in the plane. */
unsigned zs_variational_dimension(const zs_node *node);

/* Append the samples of the parts of a <variational> or <shape>, unknown normals
 * marked where they are to be estimated.  False after reporting. */
bool zs_variational_gather(const zs_node *node, unsigned dimension, zs_rbf_samples *list,
                           zs_diag *diag);

/* ---- Meshes (variational_mesh.c) -------------------------------------------------- */

bool zs_variational_add_mesh(zs_rbf_samples *list, const zs_node *part, zs_diag *diag);

/* ---- Plane parts (variational_plane.c) -------------------------------------------- */

/* Whether a <contour> or an <image> lies in the plane of 2D shapes. */
bool zs_variational_is_flat(const zs_node *part);

bool zs_variational_add_contour(zs_rbf_samples *list, const zs_node *part, zs_diag *diag);

/* `empty`: set when no pixel is as bright as the level, and nothing was added. */
bool zs_variational_add_image(zs_rbf_samples *list, const zs_node *part, bool *empty,
                              zs_diag *diag);
/* Append samples over an empty picture that say that the solid ends before it. */
bool zs_variational_add_empty(zs_rbf_samples *list, const zs_node *part, zs_diag *diag);

/* ---- Pairs (variational_warp.c) ---------------------------------------------------- */

/* <pair>: a point of the first shape and the one of the second it becomes. */
extern const zs_kind zs_variational_pair;

/* The way of two shapes to half between them, or none: Turk and O'Brien,
 * appendix.  Each component of a displacement is a fit of its own. */
typedef struct zs_variational_warp {
  unsigned dimension; /* 0: there are no pairs */
  double *pairs;      /* 6 numbers each: from, to */
  size_t pair_count;
  zs_rbf *half[2][3]; /* from the first shape, and from the second */
} zs_variational_warp;

/* The warp of a node's pairs; false after reporting. */
bool zs_variational_warp_make(zs_variational_warp *warp, const zs_node *node, unsigned dimension,
                              const zs_control *control, zs_diag *diag);
void zs_variational_warp_clear(zs_variational_warp *warp);

/* Carry `count` points of one of the shapes to half way, in place. */
void zs_variational_warp_apply(const zs_variational_warp *warp, int shape, double *positions,
                               size_t count);

/* Where to evaluate the fit of shapes carried half-way, `time` (0 .. 1) of the
 * way from the first to the second. */
zs_coordinates zs_variational_warp_emit(zs_compiler *compiler, const zs_variational_warp *warp,
                                        double time, const zs_coordinates *at);

/* ---- Fits (variational_fit.c) ------------------------------------------------------- */

/* To be raised when the same samples and settings become other constraints: fits
 * that were stored before are then made anew. */
enum { ZS_VARIATIONAL_VERSION = 4 };

/* A fit as scenes remember it, found again by a key of all that it depends on. */
typedef struct zs_variational_fit {
  atomic_uint references;
  uint64_t key[2];
  zs_rbf *rbf;
  double separation;  /* length of one unit of `slice` and `at` */
  double *points;     /* 3 each: on the surface, in the node's coordinates; none of shapes */
  size_t point_count;
} zs_variational_fit;

extern const zs_cache_type zs_variational_fit_type;

/* The fit of a node, made now or remembered; NULL after reporting.  The warp is
 * that of the node. */
zs_variational_fit *zs_variational_fit_find(const zs_node *node, const zs_variational_warp *warp,
                                            struct zs_cache *cache, const zs_control *control,
                                            zs_diag *diag);
void zs_variational_fit_unref(void *fit);

/* What is evaluated in a space of 2 or 3 dimensions where the coordinates beyond it are
 * `extra`, made now or remembered, to be released by zs_variational_sum_unref; NULL after
 * reporting that memory is out, or cancelled. */
typedef struct zs_variational_sum zs_variational_sum;
zs_variational_sum *zs_variational_sum_find(const zs_variational_fit *fit, unsigned space,
                                            const double *extra, double accuracy,
                                            struct zs_cache *cache, const zs_control *control,
                                            zs_diag *diag);
void zs_variational_sum_unref(void *sum);
const zs_rbf_sum *zs_variational_sum_data(const zs_variational_sum *sum);

#endif
