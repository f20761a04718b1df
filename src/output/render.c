/* The preview renderer: rays against the field's bounds, light, and smooth
 * edges where the picture has any. */
#include "base/diagnostic.h"
#include "base/memory.h"
#include "base/threads.h"
#include "files/image.h"
#include "output/camera.h"
#include "output/grid.h"
#include "output/job.h"
#include "output/shade.h"
#include "output/trace.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Places for rays along the sides of a pixel that has an edge in it. */
enum { EDGE_RAYS = 4 };

/* Part of the progress that the first rays are, before the edges. */
static const double FIRST_PART = 0.7;

/* Neighbours further apart than this, in pixels of depth off the surface's own
 * plane or as cosine of their normals, have an edge between them. */
static const float DEPTH_STEP = 1.5f, CREASE = 0.9f;

/* What one thread works with. */
typedef struct worker {
  zs_eval *eval;
  zs_tracer tracer;
  zs_tile *tile;
} worker;

typedef struct renderer {
  zs_camera camera;
  zs_studio studio;
  zs_render_mode mode;
  zs_hit *hits;     /* by pixel */
  float *depth;     /* by pixel: of its hit, INFINITY without one */
  float *open;      /* by pixel: part of the sky that it sees */
  uint8_t *edges;   /* by pixel: 1 where more rays are wanted */
  zs_image *image;
  worker *workers;
  unsigned threads;
  const zs_control *control;
} renderer;

void zs_render_options_init(zs_render_options *options)
{
  *options = (zs_render_options){.width = 800, .height = 600};
  zs_view_named(&options->view, "iso", NULL);
}

static size_t pixel_count(const renderer *r)
{
  return (size_t)r->camera.width * r->camera.height;
}

/* ---- Tiles in parallel ----------------------------------------------------------------- */

static bool report_progress(const renderer *r, double fraction)
{
  const zs_control *control = r->control;
  return !control || !control->progress ||
         control->progress(control->context, "render", fraction);
}

/* Whether a square of pixels has edges in it. */
static bool has_edges(const renderer *r, uint32_t x, uint32_t y, uint32_t side)
{
  const uint32_t width = r->camera.width, height = r->camera.height;
  const uint32_t across = width - x < side ? width - x : side;
  for (uint32_t row = y; row < y + side && row < height; row++)
    if (memchr(r->edges + (size_t)row * width + x, 1, across))
      return true;
  return false;
}

/* Trace one tile and give it to `finish`; pixels at (x, y). */
static void trace_tile(renderer *r, worker *w, uint32_t x, uint32_t y, uint32_t rays_per_pixel,
                       void (*finish)(renderer *r, const zs_tile *tile))
{
  const bool edges = rays_per_pixel > 1;
  if (edges && !has_edges(r, x, y, ZS_TILE / rays_per_pixel))
    return;
  zs_tile_begin(w->tile, &r->camera, x * rays_per_pixel, y * rays_per_pixel, rays_per_pixel,
                edges ? r->edges : NULL);
  zs_tracer_run(&w->tracer, w->tile);
  finish(r, w->tile);
}

/* Trace all tiles with some rays per pixel (those of edges, when more than 1)
 * and give each to `finish`.  False when cancelled. */
static bool trace_tiles(renderer *r, uint32_t rays_per_pixel,
                        void (*finish)(renderer *r, const zs_tile *tile), double from, double to)
{
  const uint32_t side = ZS_TILE / rays_per_pixel; /* in pixels */
  const uint32_t across = (r->camera.width - 1) / side + 1;
  const uint32_t count = across * ((r->camera.height - 1) / side + 1);
  atomic_uint finished = 0;
  atomic_bool cancelled = false;
#pragma omp parallel for schedule(dynamic, 1) num_threads(r->threads)
  for (uint32_t i = 0; i < count; i++) {
    if (atomic_load_explicit(&cancelled, memory_order_relaxed))
      continue;
    const unsigned thread = zs_thread_number();
    trace_tile(r, &r->workers[thread], i % across * side, i / across * side, rays_per_pixel,
               finish);
    unsigned done = atomic_fetch_add_explicit(&finished, 1, memory_order_relaxed) + 1;
    if (thread == 0 && !report_progress(r, from + (to - from) * done / count))
      atomic_store_explicit(&cancelled, true, memory_order_relaxed);
  }
  return !cancelled;
}

/* Keep the hits of a tile with one ray per pixel. */
static void keep_hits(renderer *r, const zs_tile *tile)
{
  for (uint32_t j = 0; j < ZS_TILE && tile->y + j < r->camera.height; j++)
    for (uint32_t i = 0; i < ZS_TILE && tile->x + i < r->camera.width; i++) {
      uint32_t column, ray;
      zs_tile_place(i, j, &column, &ray);
      r->hits[(size_t)(tile->y + j) * r->camera.width + tile->x + i] = tile->hits[column][ray];
    }
}

/* ---- Shaded pictures -------------------------------------------------------------------- */

static zs_color encoded(zs_color linear)
{
  return (zs_color){zs_color_encode(fminf(linear.r, 1)), zs_color_encode(fminf(linear.g, 1)),
                    zs_color_encode(fminf(linear.b, 1))};
}

static void store_color(renderer *r, size_t pixel, zs_color color)
{
  zs_color_store(color, r->image->pixels + 3 * pixel);
}

static zs_color hit_color(const renderer *r, const zs_hit *hit, double u, double v, float open)
{
  if (hit->kind == ZS_HIT_NOTHING)
    return zs_backdrop((float)(0.5 + v / (2 * r->camera.top)));
  return zs_shade(&r->studio, &r->camera, hit, u, v, open);
}

/* How open the sky is for a hit in a pixel: as for the nearest hit in depth of
 * the pixel and those around it. */
static float open_near(const renderer *r, uint32_t x, uint32_t y, float depth)
{
  float open = 1, nearest = INFINITY;
  for (uint32_t py = y ? y - 1 : 0; py <= y + 1 && py < r->camera.height; py++)
    for (uint32_t px = x ? x - 1 : 0; px <= x + 1 && px < r->camera.width; px++) {
      const size_t at = (size_t)py * r->camera.width + px;
      const float off = fabsf(r->hits[at].depth - depth);
      if (r->hits[at].kind == ZS_HIT_NOTHING || off >= nearest)
        continue;
      nearest = off;
      open = r->open[at];
    }
  return open;
}

/* Average the rays of one pixel of a tile; (i, j) is its first ray. */
static void blend_pixel(renderer *r, const zs_tile *tile, uint32_t i, uint32_t j)
{
  const uint32_t n = tile->rays_per_pixel, x = (tile->x + i) / n, y = (tile->y + j) / n;
  const size_t pixel = (size_t)y * r->camera.width + x;
  if (x >= r->camera.width || y >= r->camera.height || !r->edges[pixel])
    return;
  unsigned count = 0;
  zs_color sum = {0, 0, 0};
  for (uint32_t b = j; b < j + n; b++)
    for (uint32_t a = i; a < i + n; a++) {
      uint32_t column, ray;
      double u, v;
      if (!zs_tile_has_ray(tile, a, b))
        continue;
      count++;
      zs_tile_place(a, b, &column, &ray);
      zs_tile_ray(tile, &r->camera, a, b, &u, &v);
      const zs_hit *hit = &tile->hits[column][ray];
      float open = hit->kind == ZS_HIT_NOTHING ? 1 : open_near(r, x, y, hit->depth);
      zs_color color = hit_color(r, hit, u, v, open);
      sum = zs_color_add(sum, (zs_color){fminf(color.r, 1), fminf(color.g, 1), fminf(color.b, 1)});
    }
  store_color(r, pixel, encoded(zs_color_scale(sum, 1 / (float)count)));
}

static void blend_edges(renderer *r, const zs_tile *tile)
{
  for (uint32_t j = 0; j < ZS_TILE; j += tile->rays_per_pixel)
    for (uint32_t i = 0; i < ZS_TILE; i += tile->rays_per_pixel)
      blend_pixel(r, tile, i, j);
}

/* Whether a picture has an edge between two neighbouring pixels. */
static bool edge_between(const renderer *r, size_t a, size_t b)
{
  const zs_hit *p = &r->hits[a], *q = &r->hits[b];
  if (p->kind != q->kind)
    return true;
  if (p->kind == ZS_HIT_NOTHING)
    return false;
  float cosine = 0;
  for (int k = 0; k < 3; k++)
    cosine += p->normal[k] * q->normal[k];
  if (cosine < CREASE)
    return true;
  /* A surface seen at a slant changes its depth by this much a pixel. */
  float toward = 0;
  for (int k = 0; k < 3; k++)
    toward += (float)r->camera.frame.axes[2][k] * p->normal[k];
  const float slant = sqrtf(fmaxf(1 - toward * toward, 0)) / fmaxf(fabsf(toward), 0.05f);
  const float pixel = (float)zs_camera_footprint(&r->camera, (double)p->depth);
  return fabsf(p->depth - q->depth) > (DEPTH_STEP + 2 * slant) * pixel;
}

static void find_edges(renderer *r, uint32_t y)
{
  const uint32_t width = r->camera.width;
  for (uint32_t x = 0; x < width; x++) {
    const size_t at = (size_t)y * width + x;
    r->depth[at] = r->hits[at].kind == ZS_HIT_NOTHING ? INFINITY : r->hits[at].depth;
    r->edges[at] = (x > 0 && edge_between(r, at, at - 1)) ||
                   (x + 1 < width && edge_between(r, at, at + 1)) ||
                   (y > 0 && edge_between(r, at, at - width)) ||
                   (y + 1 < r->camera.height && edge_between(r, at, at + width));
  }
}

static void shade_row(renderer *r, uint32_t y)
{
  zs_openness(&r->camera, r->hits, r->depth, y, r->open + (size_t)y * r->camera.width);
  const double v = r->camera.top - (y + 0.5) * r->camera.pixel;
  const zs_hit nothing = {.kind = ZS_HIT_NOTHING};
  const zs_color backdrop = encoded(hit_color(r, &nothing, 0, v, 1));
  for (uint32_t x = 0; x < r->camera.width; x++) {
    const size_t at = (size_t)y * r->camera.width + x;
    const zs_hit *hit = &r->hits[at];
    const double u = r->camera.left + (x + 0.5) * r->camera.pixel;
    store_color(r, at, hit->kind == ZS_HIT_NOTHING
                         ? backdrop
                         : encoded(hit_color(r, hit, u, v, r->open[at])));
  }
}

/* ---- Pictures of data --------------------------------------------------------------------- */

/* A unit normal's components from -1..1 to 0..255; no hit is black. */
static void normals_row(renderer *r, uint32_t y)
{
  for (uint32_t x = 0; x < r->camera.width; x++) {
    const size_t at = (size_t)y * r->camera.width + x;
    for (int k = 0; k < 3 && r->hits[at].kind != ZS_HIT_NOTHING; k++)
      r->image->pixels[3 * at + (size_t)k] = zs_color_byte(0.5f + 0.5f * r->hits[at].normal[k]);
  }
}

/* The box's depth from 255 (near) to 1 (far); no hit is 0. */
static void depth_row(renderer *r, uint32_t y)
{
  const double near = r->camera.near, range = r->camera.far - near;
  for (uint32_t x = 0; x < r->camera.width; x++) {
    const size_t at = (size_t)y * r->camera.width + x;
    if (r->hits[at].kind == ZS_HIT_NOTHING)
      continue;
    double part = fmin(fmax(((double)r->hits[at].depth - near) / range, 0), 1);
    r->image->pixels[at] = (uint8_t)(255.5 - 254 * part);
  }
}

static void for_rows(renderer *r, void (*row)(renderer *r, uint32_t y))
{
#pragma omp parallel for schedule(dynamic, 16) num_threads(r->threads)
  for (uint32_t y = 0; y < r->camera.height; y++)
    row(r, y);
}

/* ---- The job -------------------------------------------------------------------------------- */

/* All of the picture.  False when cancelled. */
static bool draw(renderer *r, zs_job_report *report)
{
  const bool shaded = r->mode == ZS_RENDER_SHADED;
  double start = zs_seconds();
  if (!report_progress(r, 0) || !trace_tiles(r, 1, keep_hits, 0, shaded ? FIRST_PART : 1))
    return false;
  double traced = zs_seconds();
  report->seconds_evaluate = traced - start;
  if (!shaded) {
    for_rows(r, r->mode == ZS_RENDER_NORMALS ? normals_row : depth_row);
    report->seconds_assemble = zs_seconds() - traced;
    return true;
  }
  for_rows(r, find_edges);
  for_rows(r, shade_row);
  double shaded_at = zs_seconds();
  report->seconds_assemble = shaded_at - traced;
  if (!trace_tiles(r, EDGE_RAYS, blend_edges, FIRST_PART, 1))
    return false;
  report->seconds_evaluate += zs_seconds() - shaded_at;
  return true;
}

static bool prepare_workers(renderer *r, zs_field *field, zs_diag *diag)
{
  r->workers = calloc(r->threads, sizeof *r->workers);
  if (!r->workers)
    return zs_fail_memory(diag);
  for (unsigned t = 0; t < r->threads; t++) {
    worker *w = &r->workers[t];
    w->eval = zs_eval_new(field, diag);
    if (!w->eval)
      return false;
    zs_tracer_init(&w->tracer, &r->camera, w->eval, r->control && r->control->brute);
    w->tile = malloc(sizeof *w->tile);
    if (!w->tile)
      return zs_fail_memory(diag);
  }
  return true;
}

static bool prepare(renderer *r, zs_field *field, zs_image *image, zs_diag *diag)
{
  const size_t n = pixel_count(r);
  const bool shaded = r->mode == ZS_RENDER_SHADED;
  r->hits = zs_memory_new(n, sizeof *r->hits);
  r->open = shaded ? zs_memory_new(n, sizeof *r->open) : NULL;
  r->edges = shaded ? zs_memory_new(n, 1) : NULL;
  r->depth = shaded ? zs_memory_new(n, sizeof *r->depth) : NULL;
  if (!r->hits || (shaded && (!r->open || !r->edges || !r->depth)))
    return zs_fail_memory(diag);
  r->image = image;
  return prepare_workers(r, field, diag) &&
         zs_image_allocate(image, r->camera.width, r->camera.height,
                           r->mode == ZS_RENDER_DEPTH ? 1 : 3, diag);
}

static void release(renderer *r)
{
  for (unsigned t = 0; r->workers && t < r->threads; t++) {
    zs_tracer_clear(&r->workers[t].tracer);
    zs_eval_free(r->workers[t].eval);
    free(r->workers[t].tile);
  }
  free(r->workers);
  free(r->hits);
  free(r->open);
  free(r->edges);
  free(r->depth);
}

/* Working memory by pixel. */
static uint64_t pixel_bytes(zs_render_mode mode)
{
  const uint64_t shaded = sizeof(zs_hit) + 2 * sizeof(float) + 1 + 3;
  return mode == ZS_RENDER_SHADED ? shaded : sizeof(zs_hit) + 3;
}

/* Set up the camera, framing the solid when the view leaves that to us. */
static bool set_camera(renderer *r, zs_field *field, const zs_box *box,
                       const zs_render_options *options, zs_diag *diag)
{
  const zs_view *view = &options->view;
  if (view->has_eye)
    return zs_camera_set(&r->camera, view, box, NULL, options->width, options->height, diag);
  zs_outline *outline = malloc(sizeof *outline);
  if (!outline)
    return zs_fail_memory(diag);
  bool set = zs_outline_find(outline, field, box, r->control, diag) &&
             zs_camera_set(&r->camera, view, box, outline, options->width, options->height, diag);
  free(outline);
  return set;
}

static bool mode_check(zs_render_mode mode, zs_diag *diag)
{
  return mode == ZS_RENDER_SHADED || mode == ZS_RENDER_NORMALS || mode == ZS_RENDER_DEPTH ||
         zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                 "the mode is %d; expected SHADED (0), NORMALS (1) or DEPTH (2)", (int)mode);
}

bool zs_render(zs_field *field, const double lo[3], const double hi[3],
               const zs_render_options *options, zs_image *image, const zs_control *control,
               zs_job_report *report, zs_diag *diag)
{
  *image = (zs_image){0};
  zs_render_options initial;
  if (!options) {
    zs_render_options_init(&initial);
    options = &initial;
  }
  if (!mode_check(options->mode, diag))
    return false;
  renderer r = {.mode = options->mode, .control = control};
  zs_box box;
  memcpy(box.lo, lo, sizeof box.lo);
  memcpy(box.hi, hi, sizeof box.hi);
  if (!zs_box_check(lo, hi, diag) ||
      !zs_image_size_check(options->width, options->height, diag) ||
      !set_camera(&r, field, &box, options, diag))
    return false;
  r.studio = zs_studio_for(&r.camera);
  r.threads = zs_control_threads(control);
  zs_job_report job = {.threads = r.threads};
  job.peak_bytes =
    pixel_count(&r) * pixel_bytes(options->mode) + r.threads * sizeof(zs_tile);
  bool done = zs_memory_check(control, job.peak_bytes, "the picture", diag) &&
              prepare(&r, field, image, diag);
  if (done && !draw(&r, &job))
    done = zs_fail(diag, ZS_CANCELLED, NULL, "cancelled");
  for (unsigned t = 0; r.workers && t < r.threads; t++)
    job.evaluations += r.workers[t].tracer.evaluations;
  release(&r);
  if (!done)
    zs_image_clear(image);
  if (done && report)
    *report = job;
  return done;
}
