/* What OpenMesh does for us.  Behind these functions is the library's only C++;
 * nothing is thrown across them and nothing is printed. */
#ifndef ZS_OPENMESH_H
#define ZS_OPENMESH_H

#include "mesh/mesh.h"

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Both are for oriented manifold meshes without repeated corners (boundaries are
 * allowed) and return false after reporting. */

/* Write OpenMesh's own format.  Errors of the stream are left to its owner. */
bool zs_openmesh_write(const zs_mesh *mesh, FILE *stream, zs_diag *diag);

/* Collapse edges in order of their quadric error (M. Garland, P. Heckbert,
 * "Surface simplification using quadric error metrics", 1997) while the squares
 * of a vertex' distances from the planes of all triangles that it stands for
 * add up to at most error^2.  Sets `kept`, `kept_count` to the vertices that are left
 * and `triangles`, `triangle_count` to the new triangles, by old vertex numbers;
 * the caller frees both arrays with free(). */
bool zs_openmesh_simplify(const zs_mesh *mesh, double error, const zs_control *control,
                          uint32_t **kept, size_t *kept_count, uint32_t **triangles,
                          size_t *triangle_count, zs_diag *diag);

#ifdef __cplusplus
}
#endif
#endif
