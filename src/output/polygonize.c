/* The polygonizer: a closed, oriented, manifold mesh of f = 0 in a grid.
 *
 * Method `contour`: cells of a lattice, a derived table of their triangles,
 * certified roots on their edges, and further vertices on sharp edges.  Method
 * `features`: the dual mesh, with a vertex within each cell.  The order of
 * vertices and triangles depends on the lattice alone, so that any number of
 * threads gives the same mesh. */
#include "output/polygonize.h"

#include "base/diagnostic.h"
#include "base/threads.h"
#include "output/grid.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

static const double FINEST_TOLERANCE = 1e-7, COARSEST_TOLERANCE = 0.01;

void zs_mesh_options_init(zs_mesh_options *options)
{
  *options = (zs_mesh_options){
    .method = ZS_MESH_CONTOUR, .normals = true, .cap = true, .creases = true, .tolerance = 1e-6};
}

/* ---- Stages over bricks ----------------------------------------------------------- */

static bool report_progress(const zs_polygonize_job *job, const char *stage, double fraction)
{
  const zs_control *control = job->control;
  return !control || !control->progress || control->progress(control->context, stage, fraction);
}

bool zs_polygonize_each(zs_polygonize_job *job, const char *stage, double from, double to,
                        zs_polygonize_visit *visit)
{
  const size_t count = job->active_count, step = count / 64 + 1;
  size_t next_report = step;
  atomic_bool cancelled = !report_progress(job, stage, from);
#pragma omp parallel for schedule(dynamic, 4) num_threads(job->threads)
  for (size_t i = 0; i < count; i++) {
    if (atomic_load_explicit(&cancelled, memory_order_relaxed))
      continue;
    const unsigned thread = zs_thread_number();
    if (thread == 0 && i >= next_report) {
      next_report = i + step;
      if (!report_progress(job, stage, from + (to - from) * (double)i / (double)count))
        atomic_store_explicit(&cancelled, true, memory_order_relaxed);
    }
    if (!job->workers[thread].out_of_memory)
      visit(job, &job->workers[thread], job->active[i]);
  }
  if (cancelled)
    return zs_fail(job->diag, ZS_CANCELLED, NULL, "cancelled");
  for (unsigned t = 0; t < job->threads; t++)
    if (job->workers[t].out_of_memory)
      return zs_fail_memory(job->diag);
  return true;
}

/* ---- Setting up ----------------------------------------------------------------- */

static bool check_options(const zs_mesh_options *options, zs_diag *diag)
{
  if (options->method != ZS_MESH_CONTOUR && options->method != ZS_MESH_FEATURES)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "%d is not a mesh method", (int)options->method);
  if (!(options->tolerance >= FINEST_TOLERANCE && options->tolerance <= COARSEST_TOLERANCE))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "the tolerance is %g; expected %g to %g of the grid's longest side",
                   options->tolerance, FINEST_TOLERANCE, COARSEST_TOLERANCE);
  if (!(options->collapse >= 0 && options->collapse < INFINITY))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "cells collapse up to %g; expected a distance, or 0 to keep all",
                   options->collapse);
  return true;
}

/* Coordinates that single precision can just tell apart near the grid. */
static double coordinate_step(const zs_polygonize_job *job)
{
  double reach = 0;
  for (int k = 0; k < 3; k++) {
    double hi = job->lo[k] + job->cell[k] * (job->corners[k] - 3);
    reach = fmax(reach, fmax(fabs(job->lo[k]), fabs(hi)));
  }
  return reach * FLT_EPSILON;
}

/* How far the lattice of `features` lies aside of the grid, in cells.  Faces of a solid that lie
 * in planes of the grid, as those of boxes like to, would leave it to rounding which corners are
 * inside, and with them whether a cell has a sharp edge at all. */
static double aside(const zs_polygonize_job *job, int axis)
{
  static const double cells[3] = {0x1p-15, 0x1.6p-15, 0x1.4p-16};
  return job->features ? cells[axis] * job->cell[axis] : 0;
}

/* The lattice of a grid.  One layer of cells is cut into two: caps need two to
 * be manifold. */
static void set_lattice(zs_polygonize_job *job, const zs_grid *grid, double tolerance)
{
  double longest = 0;
  for (int k = 0; k < 3; k++) {
    bool thin = grid->count[k] == 1;
    job->cell[k] = thin ? grid->cell[k] / 2 : grid->cell[k];
    job->lo[k] = grid->lo[k] + aside(job, k);
    job->corners[k] = (thin ? 2 : grid->count[k]) + 3;
    job->bricks[k] = (job->corners[k] + ZS_BRICK - 1) / ZS_BRICK;
    longest = fmax(longest, grid->cell[k] * grid->count[k]);
  }
  /* Half of the tolerance is for the roots, half for keeping vertices apart. */
  job->tolerance = tolerance * longest / 2;
  job->apart = fmax(job->tolerance, 4 * coordinate_step(job));
}

/* Count memory that is about to be used; false after reporting when it is over
 * the limit. */
static bool use_bytes(zs_polygonize_job *job, double bytes)
{
  const uint64_t limit = job->control ? job->control->memory_limit : 0;
  const double mebibyte = 1024 * 1024;
  if (bytes + (double)job->used_bytes > (limit ? (double)limit : 0x1p62))
    return zs_fail(job->diag, ZS_ERROR_MEMORY, NULL,
                   "the mesh needs more memory than allowed: %.0f MiB of %.0f MiB",
                   ((double)job->used_bytes + bytes) / mebibyte,
                   (limit ? (double)limit : 0x1p62) / mebibyte);
  job->used_bytes += (uint64_t)bytes;
  return true;
}

static bool allocate(zs_polygonize_job *job)
{
  double total = (double)job->bricks[0] * job->bricks[1] * job->bricks[2];
  if (!use_bytes(job, total * sizeof *job->table))
    return false;
  size_t count = (size_t)total;
  job->table = malloc(count * sizeof *job->table);
  job->workers = calloc(job->threads, sizeof *job->workers);
  job->programs = calloc(job->threads, sizeof *job->programs);
  if (!job->table || !job->workers || !job->programs)
    return zs_fail(job->diag, ZS_ERROR_MEMORY, NULL,
                   "out of memory for a lattice of %u x %u x %u; try a lower resolution",
                   job->corners[0], job->corners[1], job->corners[2]);
  for (size_t i = 0; i < count; i++)
    job->table[i] = &job->outside;
  memset(job->inside.signs, 0xff, sizeof job->inside.signs);
  for (unsigned t = 0; t < job->threads; t++)
    if (!(job->workers[t].eval = zs_eval_new(job->field, job->diag)))
      return false;
  return true;
}

/* ---- Numbering ------------------------------------------------------------------- */

static bool fail_empty(const zs_polygonize_job *job)
{
  bool solid = false;
  for (size_t i = 0; i < job->active_count; i++)
    for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
      solid = solid || job->active[i]->signs[row];
  if (solid)
    return zs_fail(job->diag, ZS_ERROR_UNABLE, NULL,
                   "the solid fills the whole box: without caps it has no surface there");
  return zs_fail(job->diag, ZS_ERROR_UNABLE, NULL,
                 "there is nothing of the solid at any sample in the box; it may be empty, "
                 "elsewhere, or thinner than a cell");
}

/* Whether normals are needed, whatever becomes of them. */
static bool needs_normals(const zs_polygonize_job *job)
{
  return job->normals || job->creases || job->features;
}

/* Count vertices and triangles by brick, and number them. */
static bool number(zs_polygonize_job *job)
{
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    zs_polygonize_count(job, job->active[i]);
  for (size_t i = 0; i < job->active_count; i++) {
    zs_brick *brick = job->active[i];
    brick->first_vertex = job->vertex_count;
    brick->first_triangle = job->triangle_count;
    job->vertex_count += brick->vertex_count;
    job->triangle_count += brick->triangle_count;
    job->loop_count += brick->loop_count;
  }
  if (!job->triangle_count)
    return fail_empty(job);
  double bytes = (double)job->vertex_count * (needs_normals(job) ? 24 : 12) +
                 (double)job->triangle_count * 12;
  if (job->features) /* there are about as many loops as crossing edges */
    bytes += (double)job->vertex_count * (24 + sizeof(zs_patch) + (job->collapse > 0 ? 29 : 0));
  return use_bytes(job, bytes);
}

/* ---- Normals that the field could not give ------------------------------------------ */

static bool lacks_normal(const zs_mesh *mesh, size_t vertex)
{
  const float *n = mesh->normals + 3 * vertex;
  return n[0] == 0 && n[1] == 0 && n[2] == 0;
}

/* Area-weighted normal of a triangle. */
static void face_normal(const zs_mesh *mesh, const uint32_t *corners, double n[3])
{
  double u[3], w[3];
  for (size_t k = 0; k < 3; k++) {
    double origin = mesh->positions[3 * (size_t)corners[0] + k];
    u[k] = mesh->positions[3 * (size_t)corners[1] + k] - origin;
    w[k] = mesh->positions[3 * (size_t)corners[2] + k] - origin;
  }
  for (int k = 0; k < 3; k++)
    n[k] = u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
}

static int compare_numbers(const void *a, const void *b)
{
  uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
  return (p > q) - (p < q);
}

/* Sum the normals of the faces around the given vertices, in ascending order. */
static void sum_faces(const zs_mesh *mesh, const uint32_t *vertices, size_t count,
                      double (*sums)[3])
{
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *corners = &mesh->triangles[3 * t];
    for (int c = 0; c < 3; c++) {
      if (!lacks_normal(mesh, corners[c]))
        continue;
      const uint32_t *at =
        bsearch(&corners[c], vertices, count, sizeof *vertices, compare_numbers);
      double n[3];
      face_normal(mesh, corners, n);
      for (int k = 0; k < 3; k++)
        sums[at - vertices][k] += n[k];
    }
  }
}

/* Where the gradient vanishes or is no number, the faces around a vertex tell
 * its normal.  False when memory is out. */
static bool mend_normals(zs_mesh *mesh, unsigned threads)
{
  size_t count = 0;
#pragma omp parallel for reduction(+ : count) num_threads(threads)
  for (size_t v = 0; v < mesh->vertex_count; v++)
    count += lacks_normal(mesh, v);
  if (!count)
    return true;
  uint32_t *vertices = malloc(count * sizeof *vertices);
  double(*sums)[3] = calloc(count, sizeof *sums);
  if (vertices && sums) {
    count = 0;
    for (size_t v = 0; v < mesh->vertex_count; v++)
      if (lacks_normal(mesh, v))
        vertices[count++] = (uint32_t)v;
    sum_faces(mesh, vertices, count, sums);
    for (size_t i = 0; i < count; i++) {
      float *n = mesh->normals + 3 * (size_t)vertices[i];
      double length = hypot(hypot(sums[i][0], sums[i][1]), sums[i][2]);
      n[2] = 1; /* of a vertex whose faces have no area */
      for (int k = 0; k < 3 && length > 0; k++)
        n[k] = (float)(sums[i][k] / length);
    }
  }
  bool done = vertices && sums;
  free(vertices);
  free(sums);
  return done;
}

/* ---- The job --------------------------------------------------------------------------- */

/* Method `contour`, from the lattice on.  There is room for all creases that
 * there may be: what is not written costs nothing, where moving the vertices to
 * larger arrays would. */
static bool run_contour(zs_polygonize_job *job, double *evaluated)
{
  size_t room = job->vertex_count + (job->creases ? job->loop_count : 0);
  if (room >= UINT32_MAX) /* more than a mesh can have, but there may be fewer */
    room = job->vertex_count;
  job->mesh = zs_mesh_new(room, 0, needs_normals(job), job->diag);
  if (!job->mesh || !zs_polygonize_vertices(job) ||
      (job->creases && !zs_polygonize_creases(job)))
    return false;
  *evaluated = zs_seconds();
  return zs_mesh_resize(job->mesh, job->vertex_count, job->triangle_count, job->diag) &&
         zs_polygonize_triangles(job);
}

/* Move what lies on an outermost plane of the lattice back to the face of the grid, and what is
 * near it by less the further away it is, so that vertices stay apart. */
static void put_back(const zs_polygonize_job *job, int axis, double plane)
{
  const double away = aside(job, axis), reach = job->cell[axis] / 2;
  for (size_t i = 0; i < job->mesh->vertex_count; i++) {
    float *at = &job->mesh->positions[3 * i + (size_t)axis];
    const double from = fabs((double)*at - plane);
    if (*at == (float)plane)
      *at = (float)(plane - away);
    else if (from < reach)
      *at = (float)((double)*at - away * (1 - from / reach));
  }
}

/* Method `features`: the mesh is that of the vertices on crossing edges first. */
static bool run_features(zs_polygonize_job *job, double *evaluated)
{
  job->mesh = zs_mesh_new(job->vertex_count, 0, true, job->diag);
  if (!job->mesh || !zs_polygonize_vertices(job) || !zs_polygonize_patches(job) ||
      !zs_polygonize_patch_vertices(job) || !zs_polygonize_claims(job))
    return false;
  *evaluated = zs_seconds();
  if (!zs_polygonize_quads(job) || (job->collapse > 0 && !zs_polygonize_collapse(job)))
    return false;
  zs_mesh_free(job->mesh);
  job->mesh = job->dual;
  job->dual = NULL;
  for (int k = 0; k < 3; k++) {
    put_back(job, k, job->lo[k]);
    put_back(job, k, job->lo[k] + job->cell[k] * (job->corners[k] - 3));
  }
  return true;
}

static bool run(zs_polygonize_job *job, double *evaluated)
{
  zs_contour_table_make(&job->cases);
  zs_bit_table_make(&job->bit_table);
  if (!allocate(job) || !zs_polygonize_sample(job) || !number(job))
    return false;
  if (!(job->features ? run_features(job, evaluated) : run_contour(job, evaluated)))
    return false;
  if (!job->normals) {
    free(job->mesh->normals);
    job->mesh->normals = NULL;
  } else if (!mend_normals(job->mesh, job->threads)) {
    return zs_fail_memory(job->diag);
  }
  return report_progress(job, "triangles", 1) ||
         zs_fail(job->diag, ZS_CANCELLED, NULL, "cancelled");
}

static void finish(zs_polygonize_job *job, zs_job_report *report)
{
  for (unsigned t = 0; job->workers && t < job->threads; t++) {
    report->evaluations += job->workers[t].evaluations;
    job->used_bytes += job->workers[t].arena.bytes;
    zs_arena_free(&job->workers[t].arena);
    zs_arena_free(&job->workers[t].ends);
    zs_eval_free(job->workers[t].eval);
    job->used_bytes += job->workers[t].claims.room * sizeof(zs_claim);
    free(job->workers[t].claims.items);
  }
  for (unsigned t = 0; job->programs && t < job->threads; t++) {
    job->used_bytes += job->programs[t].bytes;
    zs_arena_free(&job->programs[t]);
  }
  report->peak_bytes = job->used_bytes;
  report->threads = job->threads;
  zs_mesh_free(job->dual);
  free(job->workers);
  free(job->programs);
  free(job->active);
  free(job->table);
}

zs_mesh *zs_polygonize(zs_field *field, const zs_grid *grid, const zs_mesh_options *options,
                       const zs_control *control, zs_job_report *report, zs_diag *diag)
{
  zs_mesh_options defaults;
  zs_mesh_options_init(&defaults);
  if (!options)
    options = &defaults;
  if (!check_options(options, diag) || !zs_grid_check(grid, diag))
    return NULL;
  zs_polygonize_job *job = calloc(1, sizeof *job);
  if (!job) {
    zs_fail_memory(diag);
    return NULL;
  }
  *job = (zs_polygonize_job){.field = field,
                             .control = control,
                             .diag = diag,
                             .cap = options->cap,
                             .normals = options->normals,
                             .creases = options->creases && options->method == ZS_MESH_CONTOUR,
                             .features = options->method == ZS_MESH_FEATURES,
                             .collapse = options->collapse,
                             .threads = zs_control_threads(control)};
  set_lattice(job, grid, options->tolerance);
  zs_job_report done = {0};
  double begun = zs_seconds(), evaluated = begun;
  bool complete = run(job, &evaluated);
  finish(job, &done);
  done.seconds_evaluate = evaluated - begun;
  done.seconds_assemble = zs_seconds() - evaluated;
  zs_mesh *mesh = job->mesh;
  free(job);
  if (!complete) {
    zs_mesh_free(mesh);
    return NULL;
  }
  if (report)
    *report = done;
  return mesh;
}
