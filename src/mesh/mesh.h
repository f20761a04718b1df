/* Indexed triangle meshes: what the polygonizer makes and files hold. */
#ifndef ZS_MESH_H
#define ZS_MESH_H

#include "zeroset.h"

#ifdef __cplusplus
extern "C" {
#endif

struct zs_mesh {
  float *positions;    /* 3 per vertex */
  float *normals;      /* 3 per vertex, or NULL */
  uint32_t *triangles; /* 3 vertices each, counter-clockwise seen from outside */
  size_t vertex_count, triangle_count;
};

/* A mesh with room for its elements, not yet filled in; NULL after reporting
 * when memory is out or there are more vertices than indices can tell apart. */
zs_mesh *zs_mesh_new(size_t vertex_count, size_t triangle_count, bool normals, zs_diag *diag);

/* Change the numbers of elements; what is new is not filled in.  False after
 * reporting; the mesh is then good for zs_mesh_free alone. */
bool zs_mesh_resize(zs_mesh *mesh, size_t vertex_count, size_t triangle_count, zs_diag *diag);

/* Read .stl .ply .obj .off or .om by the name's ending.  Nothing is mended or
 * left out: polygons become fans of triangles, coinciding corners of an STL
 * file one vertex.  A file may hold vertices alone.  Normals are as in the
 * file (scaled to unit length), NULL when it does not give one to every vertex.
 * Malformed and truncated files and coordinates that are no finite single
 * precision numbers are errors that name the file and, in text, the line. */
zs_mesh *zs_mesh_read(const char *path, zs_diag *diag);

/* What zs_mesh_close has mended. */
typedef struct zs_mesh_holes {
  size_t count;    /* holes, and ... */
  size_t sides;    /* ... the sides of triangles along their rims */
  bool inside_out; /* the triangles were clockwise, seen from outside */
} zs_mesh_holes;

/* A surface that is closed: every side of a triangle is run along as often one way as the
 * other.  Vertices at the same place become one, triangles with a repeated corner go, every
 * hole is filled with a fan of triangles about the middle of its rim, and a surface that is
 * inside out as a whole is turned.  A closed mesh stays as it is.  NULL after reporting. */
zs_mesh *zs_mesh_close(const zs_mesh *mesh, zs_mesh_holes *holes, zs_diag *diag);

/* Whether OpenMesh's half-edges can hold the mesh: oriented, manifold (with or
 * without boundary), no triangle with a repeated corner, and numbers that fit
 * its signed ones.  Reports what is wrong; `purpose` says what for ("simplify
 * it"). */
bool zs_mesh_require_manifold(const zs_mesh *mesh, const char *purpose, zs_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
