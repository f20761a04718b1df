/* A picture of each scene in scenes/, as zeroset render makes it. */
#include "bench.h"
#include "scenes.h"

#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double BUDGET = 1.5; /* seconds for the runs of one number */

typedef struct shot {
  zs_field *field;
  zs_control control;
  double lo[3], hi[3];
  zs_render_options options;
} shot;

static bench_span job_render(void *context)
{
  shot *s = context;
  zs_image image = {0};
  bench_span begun = bench_now();
  bool done = zs_render(s->field, s->lo, s->hi, &s->options, &image, &s->control, NULL,
                        bench_diag());
  bench_span taken = bench_since(begun, done);
  zs_image_clear(&image);
  return taken;
}

static bool shot_begin(const bench *b, shot *s, const char *path, double *ready)
{
  bench_span begun = bench_now();
  zs_scene *scene = zs_scene_load(path, NULL, bench_diag());
  s->field = scene ? zs_scene_compile(scene, NULL, NULL, bench_diag()) : NULL;
  *ready = bench_since(begun, true).processor;
  zs_render_options_init(&s->options);
  s->options.width = bench_size(b, 640);
  s->options.height = bench_size(b, 480);
  bool good = s->field && zs_field_box(s->field, s->lo, s->hi, bench_diag()) &&
              (zs_scene_view(scene, 0, &s->options.view) ||
               zs_view_named(&s->options.view, "iso", bench_diag()));
  zs_scene_free(scene);
  return good;
}

/* The work of a fitted field is that of its data. */
static bool has_data(const zs_field *field)
{
  zs_field_info info;
  zs_field_describe(field, &info);
  return info.fits > 0;
}

static bool run_scene(bench *b, const char *name, const char *path, double *slowest)
{
  shot s = {.control = bench_control(1)};
  double ready;
  bool good = shot_begin(b, &s, path, &ready);
  if (good) {
    shot s2 = s;
    bench_time times[2];
    s2.control = bench_control(2);
    bench_measure_both(b, job_render, &s, job_render, &s2, BUDGET, times);
    good = !times[0].failed && !times[1].failed;
    const double seconds = times[0].processor;
    char text[16];
    printf("%-15s %8.1f %10.1f %8s %s\n", name, 1e3 * ready, 1e3 * seconds,
           bench_ratio(text, times[0].wall / times[1].wall, good ? "" : "!"),
           seconds > 0.5 ? "over 0.5 s" : "");
    if (!has_data(s.field))
      *slowest = fmax(*slowest, seconds);
  }
  zs_field_unref(s.field);
  return good;
}

/* The name of a file without its folder and ending. */
static void stem(char name[64], const char *path)
{
  const char *slash = strrchr(path, '/');
  snprintf(name, 64, "%s", slash ? slash + 1 : path);
  name[strcspn(name, ".")] = '\0';
}

void bench_pictures(bench *b)
{
  char path[4096], name[64];
  glob_t found;
  bool headed = false;
  double slowest = 0;
  if (glob(scene_path(path, "*.xml"), 0, NULL, &found)) {
    fprintf(stderr, "bench: no scenes: %s\n", path);
    b->wrong = true;
    return;
  }
  for (size_t i = 0; i < found.gl_pathc; i++) {
    stem(name, found.gl_pathv[i]);
    if (!bench_wants(b, "render %s", name))
      continue;
    if (!headed)
      printf("\n%-15s %8s %10s %8s\n", "render", "ready ms", "ms", "2 thr");
    headed = true;
    if (!run_scene(b, name, found.gl_pathv[i], &slowest)) {
      printf("%-15s wrong!\n", name);
      b->wrong = true;
    }
  }
  globfree(&found);
  if (bench_wants(b, "render") && !b->smoke)
    bench_remember(b, slowest, "picture slowest");
}
