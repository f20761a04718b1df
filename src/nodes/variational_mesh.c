/* Meshes as parts of <variational>: samples of their vertices, and of their edges and faces
 * where those alone would not hold the surface to them. */
#include "nodes/variational.h"

#include "mesh/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct mesh_part {
  const char *src;
  double deviation; /* NaN: vertices alone */
};

static const char *const words[] = {"none", NULL};

static const zs_attribute attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct mesh_part, src), .unit = "",
   .doc = "an STL, PLY, OBJ, OFF or OM file; vertex normals are taken from it, or made from its "
          "triangles, which should be counter-clockwise seen from outside"},
  {.name = "deviation", .type = ZS_NUMBER, .offset = offsetof(struct mesh_part, deviation),
   .initial = "none", .unit = "length", .range = ZS_RANGE_POSITIVE, .choices = words,
   .doc = "how far the surface may leave the triangles: edges over which it would bulge more are "
          "halved, and their middles are samples too; none: a smooth surface through the vertices"},
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
/* Samples nearer to each other than so many deviations say nothing new. */
static const double CLOSE = 3;
/* Steps towards the normal that they agree with most, and rounds of halving edges. */
enum { STEPS = 64, ROUNDS = 16 };

/* A mesh whose vertices are the samples from `first` on. */
typedef struct surface {
  zs_rbf_samples *list;
  size_t first, triangle_count;
  uint32_t *triangles;
} surface;

static zs_rbf_sample *vertex(const surface *s, size_t index)
{
  return &s->list->samples[s->first + index];
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool normalise(double v[3])
{
  const double length = sqrt(dot(v, v));
  for (int k = 0; k < 3; k++)
    v[k] = length > 0 ? v[k] / length : 0;
  return length > 0;
}

/* Twice the area vector of a triangle. */
static void area_vector(const surface *s, size_t t, double area[3])
{
  const uint32_t *corner = s->triangles + 3 * t;
  const double *a = vertex(s, corner[0])->position, *b = vertex(s, corner[1])->position,
               *c = vertex(s, corner[2])->position;
  double u[3], v[3];
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
  }
  for (int k = 0; k < 3; k++)
    area[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
}

/* ---- Normals -------------------------------------------------------------------- */

/* The least cosine between a normal and those of some triangles, and whose it is. */
static double agreement(const double *faces, const uint32_t *list, size_t count,
                        const double normal[3], const double **worst)
{
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) {
    const double *face = faces + 3 * (size_t)list[i];
    const double cosine = dot(face, face) > 0 ? dot(face, normal) : INFINITY;
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
    normalise(n);
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
static bool make_normals(const surface *s)
{
  const size_t corners = 3 * s->triangle_count, vertices = s->list->count - s->first;
  double *faces = malloc((corners + 1) * sizeof *faces);
  uint32_t *begin = calloc(vertices + 2, sizeof *begin);
  uint32_t *list = malloc((corners + 1) * sizeof *list);
  const bool memory = faces && begin && list;
  if (memory) {
    for (size_t t = 0; t < s->triangle_count; t++) {
      area_vector(s, t, faces + 3 * t);
      for (int j = 0; j < 3; j++) {
        begin[s->triangles[3 * t + (size_t)j] + 2]++;
        for (int k = 0; k < 3; k++)
          vertex(s, s->triangles[3 * t + (size_t)j])->normal[k] += faces[3 * t + (size_t)k];
      }
      normalise(faces + 3 * t);
    }
    for (size_t v = 2; v < vertices + 2; v++)
      begin[v] += begin[v - 1];
    for (size_t c = 0; c < corners; c++)
      list[begin[s->triangles[c] + 1]++] = (uint32_t)(c / 3);
    for (size_t v = 0; v < vertices; v++)
      if (normalise(vertex(s, v)->normal))
        turn(faces, list + begin[v], begin[v + 1] - begin[v], vertex(s, v)->normal);
  }
  free(faces);
  free(begin);
  free(list);
  return memory;
}

/* ---- Between vertices ------------------------------------------------------------- */

/* An edge of a triangle, from corner to corner. */
typedef struct edge {
  uint32_t a, b, triangle; /* a < b */
  uint8_t corner;          /* the first one */
} edge;

static int by_ends(const void *x, const void *y)
{
  const edge *p = x, *q = y;
  if (p->a != q->a)
    return p->a < q->a ? -1 : 1;
  if (p->b != q->b)
    return p->b < q->b ? -1 : 1;
  return p->triangle < q->triangle ? -1 : p->triangle > q->triangle;
}

/* How far a smooth curve with these normals leaves the edge: a cubic, in the middle. */
static double bulge(const zs_rbf_sample *a, const zs_rbf_sample *b)
{
  double along[3], difference[3];
  for (int k = 0; k < 3; k++) {
    along[k] = b->position[k] - a->position[k];
    difference[k] = a->normal[k] - b->normal[k];
  }
  return fabs(dot(along, difference)) / 8;
}

/* The edges of all triangles, those with the same ends together; NULL when memory is out. */
static edge *list_edges(const surface *s)
{
  const size_t count = 3 * s->triangle_count;
  edge *edges = malloc((count + 1) * sizeof *edges);
  for (size_t i = 0; edges && i < count; i++) {
    const uint32_t a = s->triangles[i], b = s->triangles[i - i % 3 + (i + 1) % 3];
    edges[i] = (edge){a < b ? a : b, a < b ? b : a, (uint32_t)(i / 3), (uint8_t)(i % 3)};
  }
  if (edges)
    qsort(edges, count, sizeof *edges, by_ends);
  return edges;
}

/* A sample in the middle of an edge, with the mean normal of its triangles. */
static bool add_middle(const surface *s, const edge *edges, size_t count, zs_diag *diag)
{
  zs_rbf_sample middle = {.value = 0};
  for (int k = 0; k < 3; k++)
    middle.position[k] = 0.5 * (vertex(s, edges[0].a)->position[k] +
                                vertex(s, edges[0].b)->position[k]);
  for (size_t i = 0; i < count; i++) {
    double area[3];
    area_vector(s, edges[i].triangle, area);
    normalise(area);
    for (int k = 0; k < 3; k++)
      middle.normal[k] += area[k];
  }
  normalise(middle.normal);
  return zs_rbf_samples_add(s->list, &middle, diag);
}

/* Divide a triangle at the middles of its edges (0: not divided); returns how many there are. */
static size_t divide(const uint32_t corner[3], const uint32_t middle[3], uint32_t *to)
{
  size_t divided = 0;
  unsigned first = 0;
  for (unsigned j = 0; j < 3; j++)
    divided += middle[j] != 0;
  /* Begin after an edge that is whole, or with the only one that is divided. */
  while (divided % 3 && (divided == 1 ? !middle[first] : middle[(first + 2) % 3] != 0))
    first++;
  const uint32_t a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
  const uint32_t ab = middle[first], bc = middle[(first + 1) % 3], ca = middle[(first + 2) % 3];
  const uint32_t parts[4][12] = {{a, b, c},
                                 {a, ab, c, ab, b, c},
                                 {ab, b, bc, a, ab, bc, a, bc, c},
                                 {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca}};
  memcpy(to, parts[divided], 3 * (divided + 1) * sizeof *to);
  return divided + 1;
}

/* Halve the edges that bulge, once; `changed` tells whether there were any.  False after
 * reporting. */
static bool halve(surface *s, double deviation, bool *changed, zs_diag *diag)
{
  const size_t count = 3 * s->triangle_count;
  edge *edges = list_edges(s);
  uint32_t *middles = calloc(count + 1, sizeof *middles);
  uint32_t *triangles = malloc((4 * count + 1) * sizeof *triangles);
  bool done = edges && middles && triangles;
  if (!done)
    zs_fail_memory(diag);
  *changed = false;
  for (size_t i = 0, end; done && i < count; i = end) {
    for (end = i + 1; end < count && edges[end].a == edges[i].a && edges[end].b == edges[i].b;)
      end++;
    if (bulge(vertex(s, edges[i].a), vertex(s, edges[i].b)) <= deviation)
      continue;
    const uint32_t index = (uint32_t)(s->list->count - s->first);
    done = add_middle(s, &edges[i], end - i, diag);
    *changed = true;
    for (size_t j = i; j < end; j++)
      middles[3 * (size_t)edges[j].triangle + edges[j].corner] = index;
  }
  size_t made = 0;
  for (size_t t = 0; done && t < s->triangle_count; t++)
    made += divide(s->triangles + 3 * t, middles + 3 * t, triangles + 3 * made);
  free(edges);
  free(middles);
  if (!done) {
    free(triangles);
    return false;
  }
  free(s->triangles);
  s->triangles = triangles;
  s->triangle_count = made;
  return true;
}

/* Samples by the cells of a grid: lists of those whose cells have the same hash. */
typedef struct grid {
  double cell;
  size_t size;              /* of `head`, a power of two */
  uint32_t *head, *next;    /* index + 1 of a sample; 0: none */
} grid;

static size_t hash(const grid *g, const double position[3], const int offset[3])
{
  static const uint64_t factor[3] = {UINT64_C(0x9e3779b97f4a7c15), UINT64_C(0xbf58476d1ce4e5b9),
                                     UINT64_C(0x94d049bb133111eb)};
  uint64_t h = 0;
  for (int k = 0; k < 3; k++) {
    const double at = floor(position[k] / g->cell) + offset[k];
    h = (h ^ (uint64_t)(int64_t)fmax(fmin(at, 1e18), -1e18)) * factor[k];
    h ^= h >> 29;
  }
  return (size_t)h & (g->size - 1);
}

/* Whether a kept sample is nearer than a cell is wide. */
static bool is_crowded(const grid *g, const zs_rbf_sample *samples, const zs_rbf_sample *sample)
{
  for (int n = 0; n < 27; n++) {
    const int offset[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    for (uint32_t i = g->head[hash(g, sample->position, offset)]; i; i = g->next[i - 1]) {
      double square = 0;
      for (int k = 0; k < 3; k++)
        square += pow(samples[i - 1].position[k] - sample->position[k], 2);
      if (square < g->cell * g->cell)
        return true;
    }
  }
  return false;
}

/* Leave out samples beyond the vertices that are nearer to another one than they may be off by:
 * narrow triangles make many.  False when memory is out. */
static bool thin(const surface *s, size_t vertices, double deviation)
{
  static const int here[3] = {0, 0, 0};
  zs_rbf_sample *samples = s->list->samples + s->first;
  const size_t count = s->list->count - s->first;
  grid g = {.cell = CLOSE * deviation, .size = 1024};
  while (g.size < count)
    g.size *= 2;
  g.head = calloc(g.size, sizeof *g.head);
  g.next = calloc(count + 1, sizeof *g.next);
  const bool memory = g.head && g.next;
  size_t kept = 0;
  for (size_t i = 0; memory && i < count; i++) {
    if (i >= vertices && is_crowded(&g, samples, &samples[i]))
      continue;
    const size_t at = hash(&g, samples[i].position, here);
    samples[kept] = samples[i];
    g.next[kept] = g.head[at];
    g.head[at] = (uint32_t)++kept;
  }
  if (memory)
    s->list->count = s->first + kept;
  free(g.head);
  free(g.next);
  return memory;
}

/* Halve edges until none bulges, or there are more samples than can be fitted. */
static bool hold_to_faces(surface *s, double deviation, zs_diag *diag)
{
  const size_t vertices = s->list->count - s->first;
  bool done = true, changed = true;
  for (int round = 0; done && changed && round < ROUNDS && s->list->count < ZS_RBF_MAXIMUM_COUNT;
       round++)
    done = halve(s, deviation, &changed, diag);
  return done && (thin(s, vertices, deviation) || zs_fail_memory(diag));
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
    any = dot(list->samples[i].normal, list->samples[i].normal) > 0;
  return any;
}

bool zs_variational_add_mesh(zs_rbf_samples *list, const zs_node *part, zs_diag *diag)
{
  const struct mesh_part *p = part->parameters;
  surface s = {.list = list, .first = list->count};
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
  if (done && !isnan(p->deviation))
    done = hold_to_faces(&s, p->deviation, diag);
  free(s.triangles);
  zs_mesh_free(mesh);
  return done;
}
