/* Meshes as parts of <variational>: their vertices, with normals. */
#include "nodes/variational_surface.h"

#include "mesh/mesh.h"
#include "nodes/variational.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct mesh_part {
  const char *src;
  double deviation; /* NaN: automatic; infinite: vertices alone */
};

static const char *const words[] = {"auto", "none", NULL};

static const zs_attribute attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct mesh_part, src), .unit = "",
   .doc = "an STL, PLY, OBJ, OFF or OM file; vertex normals are taken from it, or made from its "
          "triangles, which should be counter-clockwise seen from outside"},
  {.name = "deviation", .type = ZS_NUMBER, .offset = offsetof(struct mesh_part, deviation),
   .initial = "auto", .unit = "length", .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "how far the surface may leave the triangles: edges over which it would bulge more are "
          "halved, and their middles are samples too, with normals where no other sample has one "
          "nearby; auto is a 2500th of twice the largest distance from the mesh's middle, but for "
          "creases; none: a smooth surface through the vertices, whatever lies between them"},
};

const zs_kind zs_variational_mesh = {
  .name = "mesh",
  .family = ZS_FAMILY_PART,
  .summary = "the vertices of a mesh, with their normals",
  .doc = "A vertex has the mean normal of the triangles around it, by their areas, unless one of "
         "them faces the other way: then the normal that all of them face most, and where the mesh "
         "is so folded that there is none, the vertex is but a point of the surface.",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct mesh_part),
  .children = ZS_CHILDREN_NONE,
};

/* A normal that all triangles around a vertex agree with so much (cosines) is as good as any;
 * with less than the other, it is none. */
static const double GOOD = 0.3, LEAST = 0.1;
/* Steps towards the normal that they agree with most. */
enum { STEPS = 64 };

/* ---- Normals -------------------------------------------------------------------- */

/* The least cosine between a normal and those of some triangles, and whose it is. */
static double agreement(const double *faces, const uint32_t *list, size_t count,
                        const double normal[3], const double **worst)
{
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) {
    const double *face = faces + 3 * (size_t)list[i];
    const double cosine = zs_dot3(face, face) > 0 ? zs_dot3(face, normal) : INFINITY;
    if (cosine < least) {
      least = cosine;
      *worst = face;
    }
  }
  return least;
}

/* Turn a normal until no triangle faces away from it, if there is such a one (Aubry and Loehner,
 * "On the 'most normal' normal", 2008), by ever smaller steps towards what agrees least: the
 * middle of the smallest cap of the sphere that holds them all (Badoiu and Clarkson, 2003). */
static void turn(const double *faces, const uint32_t *list, size_t count, double normal[3])
{
  const double *worst = NULL;
  double n[3], best = agreement(faces, list, count, normal, &worst);
  if (best >= GOOD)
    return;
  memcpy(n, normal, sizeof n);
  for (int step = 1; step <= STEPS; step++) {
    for (int k = 0; k < 3; k++)
      n[k] += (worst[k] - n[k]) / (step + 1);
    zs_normalise3(n);
    const double now = agreement(faces, list, count, n, &worst);
    if (now > best) {
      best = now;
      memcpy(normal, n, sizeof n);
    }
  }
  if (best < LEAST)
    memset(normal, 0, 3 * sizeof *normal);
}

/* Give the vertices normals; false when memory is out. */
static bool make_normals(const zs_surface *s)
{
  const size_t corners = 3 * s->triangle_count, vertices = s->list->count - s->first;
  double *faces = malloc((corners + 1) * sizeof *faces);
  uint32_t *begin = calloc(vertices + 2, sizeof *begin);
  uint32_t *list = malloc((corners + 1) * sizeof *list);
  const bool memory = faces && begin && list;
  if (memory) {
    for (size_t t = 0; t < s->triangle_count; t++) {
      zs_surface_area_vector(s, t, faces + 3 * t);
      for (int j = 0; j < 3; j++) {
        begin[s->triangles[3 * t + (size_t)j] + 2]++;
        zs_rbf_sample *sample = zs_surface_vertex(s, s->triangles[3 * t + (size_t)j]);
        for (size_t k = 0; k < 3; k++)
          sample->normal[k] += faces[3 * t + k];
      }
      zs_normalise3(faces + 3 * t);
    }
    for (size_t v = 2; v < vertices + 2; v++)
      begin[v] += begin[v - 1];
    for (size_t c = 0; c < corners; c++)
      list[begin[s->triangles[c] + 1]++] = (uint32_t)(c / 3);
    for (size_t v = 0; v < vertices; v++)
      if (zs_normalise3(zs_surface_vertex(s, v)->normal))
        turn(faces, list + begin[v], begin[v + 1] - begin[v], zs_surface_vertex(s, v)->normal);
  }
  free(faces);
  free(begin);
  free(list);
  return memory;
}

/* ---- Meshes ------------------------------------------------------------------------ */

/* Six times the volume that a mesh encloses, negative when its triangles are
 * clockwise seen from outside; about a vertex, so that meshes that are almost
 * closed count too. */
static double signed_volume(const zs_mesh *mesh, const zs_rbf_sample *samples)
{
  double volume = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double v[3][3];
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++)
        v[i][k] = samples[mesh->triangles[3 * t + (size_t)i]].position[k] - samples[0].position[k];
    for (int k = 0; k < 3; k++)
      volume += v[0][k] * (v[1][(k + 1) % 3] * v[2][(k + 2) % 3] -
                           v[1][(k + 2) % 3] * v[2][(k + 1) % 3]);
  }
  return volume;
}

/* Warn of a mesh that is inside out by a good part of its box. */
static void check_orientation(const zs_node *part, const zs_mesh *mesh,
                              const zs_rbf_sample *samples, zs_diag *diag)
{
  double box = 1;
  for (int k = 0; k < 3; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
      lo = fmin(lo, samples[i].position[k]);
      hi = fmax(hi, samples[i].position[k]);
    }
    box *= hi - lo;
  }
  if (signed_volume(mesh, samples) / 6 >= -0.05 * box)
    return;
  const zs_place place = zs_node_place(part, "src");
  zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
            "the mesh is inside out: its triangles are clockwise seen from outside, so the solid "
            "is what lies around it");
}

static bool add_vertices(zs_rbf_samples *list, const zs_mesh *mesh, zs_diag *diag)
{
  bool done = true;
  for (size_t i = 0; done && i < mesh->vertex_count; i++) {
    zs_rbf_sample sample = {.value = 0};
    for (int k = 0; k < 3; k++) {
      sample.position[k] = (double)mesh->positions[3 * i + k];
      if (mesh->normals)
        sample.normal[k] = (double)mesh->normals[3 * i + k];
    }
    done = zs_rbf_samples_add(list, &sample, diag);
  }
  return done;
}

static bool any_normal(const zs_rbf_samples *list, size_t first)
{
  bool any = list->count == first;
  for (size_t i = first; !any && i < list->count; i++)
    any = zs_dot3(list->samples[i].normal, list->samples[i].normal) > 0;
  return any;
}

bool zs_variational_add_mesh(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  const struct mesh_part *p = part->parameters;
  zs_surface s = {.list = list, .first = list->count};
  zs_mesh *mesh = zs_mesh_read(p->src, diag);
  if (!mesh)
    return false;
  bool done = add_vertices(list, mesh, diag);
  if (done) {
    s.triangle_count = mesh->triangle_count;
    s.triangles = malloc((3 * s.triangle_count + 1) * sizeof *s.triangles);
    done = s.triangles || zs_fail_memory(diag);
  }
  if (done) {
    memcpy(s.triangles, mesh->triangles, 3 * s.triangle_count * sizeof *s.triangles);
    if (!mesh->normals) {
      check_orientation(part, mesh, list->samples + s.first, diag);
      done = make_normals(&s) || zs_fail_memory(diag);
    }
  }
  if (done && !any_normal(list, s.first))
    done = zs_fail(diag, ZS_ERROR_GEOMETRY, p->src,
                   "the mesh has no normals, and no triangle with an area to make them from");
  if (done && !isinf(p->deviation))
    done = zs_surface_hold_to_faces(&s, p->deviation, diag);
  free(s.triangles);
  zs_mesh_free(mesh);
  return done;
}
