/* Reading and compiling scenes from files, against xmllint on the same files. */
#include "bench.h"
#include "scenes.h"

#include "../files/scratch.h"

#include <math.h>
#include <stdio.h>

static const double BUDGET = 1.5; /* seconds for the runs of one number */

static const struct {
  const char *name, *unit;
  scene_writer *write;
  unsigned parts[BENCH_SIZES];
} scenes[] = {
  {"load", "nodes", scene_spheres, {1000, 10000, 100000}},
  {"load formula", "rings", scene_rings, {110, 220, 440}},
};

typedef struct loading {
  const char *path, *xmllint;
  double read, compile; /* the latest run's seconds */
  size_t instructions;
} loading;

static bench_span job_load(void *context)
{
  loading *l = context;
  bench_span begun = bench_now();
  zs_scene *scene = zs_scene_load(l->path, NULL, bench_diag());
  bench_span read = bench_since(begun, scene != NULL);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, bench_diag()) : NULL;
  bench_span both = bench_since(begun, field != NULL);
  l->read = read.processor;
  l->compile = both.processor - read.processor;
  if (field) {
    zs_field_info info;
    zs_field_describe(field, &info);
    l->instructions = info.instructions;
  }
  zs_field_unref(field);
  zs_scene_free(scene);
  return both;
}

static bench_span job_xmllint(void *context)
{
  const loading *l = context;
  bench_child child;
  char *arguments[] = {(char *)l->xmllint, "--noout", "--nonet", (char *)l->path, NULL};
  return bench_run_child(arguments, &child) ? child.span : (bench_span){.failed = true};
}

static bool write_scene(scene_writer *write, unsigned parts, const char *path)
{
  text t = {0};
  FILE *file = fopen(path, "wb");
  bool good = file && write(&t, parts) && fwrite(t.bytes, 1, t.length, file) == t.length;
  good = file && !fclose(file) && good;
  text_clear(&t);
  return good;
}

/* One line; `previous` is the time of the one above. */
static bool row(bench *b, size_t index, unsigned parts, const char *path, double *previous)
{
  loading l = {.path = path, .xmllint = bench_environment("XMLLINT", "xmllint")};
  if (!write_scene(scenes[index].write, parts, path))
    return false;
  bench_time ours = bench_measure(b, job_load, &l, BUDGET);
  if (ours.failed)
    return false;
  char text[2][16];
  printf("%-15s %6u %-5s %10zu %8.2f %8.2f %8.2f %8s", scenes[index].name, parts,
         scenes[index].unit, l.instructions, 1e3 * l.read, 1e3 * l.compile, 1e3 * ours.processor,
         bench_ratio(text[0], *previous > 0 ? ours.processor / *previous : NAN, ""));
  bench_time xmllint = bench_measure(b, job_xmllint, &l, BUDGET);
  if (!xmllint.failed) {
    printf(" %8.2f %8s", 1e3 * xmllint.processor,
           bench_ratio(text[1], ours.processor / xmllint.processor, ""));
    bench_remember(b, 2 * xmllint.processor + 0.2, "%s %u allowance", scenes[index].name, parts);
  }
  printf("\n");
  bench_remember(b, ours.processor, "%s %u", scenes[index].name, parts);
  *previous = ours.processor;
  return true;
}

static bool run_scene(bench *b, size_t index, scratch *folder)
{
  double previous = 0;
  for (unsigned k = 0; k < BENCH_SIZES; k++)
    if (!row(b, index, bench_parts(b, scenes[index].parts[k]), scratch_path(folder, "scene.xml"),
             &previous))
      return false;
  return true;
}

void bench_loading(bench *b)
{
  scratch folder;
  if (!bench_wants(b, "load formula"))
    return;
  if (!scratch_make(&folder)) {
    fprintf(stderr, "bench: no folder for files can be made here\n");
    b->wrong = true;
    return;
  }
  printf("\n%-15s %6s %-5s %10s %8s %8s %8s %8s %8s %8s\n", "loading", "", "", "operations",
         "read ms", "compile", "both", "growth", "xmllint", "both by");
  for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
    if (!run_scene(b, i, &folder)) {
      printf("%-15s wrong!\n", scenes[i].name);
      b->wrong = true;
    }
  }
  scratch_remove(&folder);
}
