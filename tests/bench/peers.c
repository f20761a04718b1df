/* Meshes against peers that extract them from a grid of samples: theirs is the
 * extraction alone, ours evaluates too. */
#include "jobs.h"
#include "scenes.h"

#include "../files/scratch.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double BUDGET = 2; /* seconds for the runs of one number */

static const struct {
  const char *name;
  scene_writer *write;
  unsigned n;
} scenes[] = {
  {"spheres-1000", scene_spheres, 1000},
  {"menger-4", scene_menger, 4},
  {"gyroid-sphere", scene_gyroid, 0},
};

static const unsigned sizes[BENCH_SIZES] = {64, 128, 256};
static const char *const peers[] = {"vtk", "skimage", "gts"};
enum { PEERS = sizeof peers / sizeof *peers };

/* What a peer said of a grid; 0 seconds when it is not there. */
typedef struct answer {
  double seconds;
  unsigned long triangles;
} answer;
typedef answer answers[BENCH_SIZES][PEERS];

static unsigned index_of_size(const work grids[BENCH_SIZES], unsigned size)
{
  unsigned i = 0;
  while (i < BENCH_SIZES && grids[i].grid.count[0] != size)
    i++;
  return i;
}

/* Run a peer's program and take up the lines it prints. */
static void ask(const char *command, const work grids[BENCH_SIZES], answers all)
{
  FILE *pipe = popen(command, "r");
  char line[256], name[16];
  unsigned size;
  answer a;
  while (pipe && fgets(line, sizeof line, pipe)) {
    if (sscanf(line, "%15s %u %lf %lu", name, &size, &a.seconds, &a.triangles) != 4)
      continue;
    unsigned i = index_of_size(grids, size);
    for (unsigned p = 0; p < PEERS && i < BENCH_SIZES; p++)
      if (!strcmp(name, peers[p]))
        all[i][p] = a;
  }
  if (pipe)
    pclose(pipe);
}

/* Sample the grids into files and name them in a peer's arguments. */
static bool write_grids(work grids[BENCH_SIZES], scratch *folder, char arguments[2048])
{
  arguments[0] = '\0';
  for (unsigned i = 0; i < BENCH_SIZES; i++) {
    char name[32];
    snprintf(name, sizeof name, "%u.raw", i);
    const char *path = scratch_path(folder, name);
    const zs_grid *grid = &grids[i].grid;
    if (!zs_voxelize_file(grids[i].field, grid, ZS_QUANTITY_VALUE, ZS_SAMPLE_F32, path, NULL, NULL,
                          NULL, bench_diag()))
      return false;
    size_t used = strlen(arguments);
    snprintf(arguments + used, 2048 - used, " %s %u %u %u", path, grid->count[0], grid->count[1],
             grid->count[2]);
  }
  return true;
}

static void ask_all(const work grids[BENCH_SIZES], const char *arguments, answers all)
{
  char command[8192];
  snprintf(command, sizeof command, "'%s' '%s/tests/bench/peers.py' %s 2>/dev/null",
           bench_environment("BENCH_PYTHON", "/usr/bin/python3"),
           bench_environment("top_srcdir", "."), arguments);
  ask(command, grids, all);
  const char *gts = getenv("BENCH_GTS");
  if (gts && *gts) {
    snprintf(command, sizeof command, "'%s' %s", gts, arguments);
    ask(command, grids, all);
  }
}

/* One line: our time with and without vertices on sharp edges, which peers cut off, and
 * for every peer its own and the latter by it. */
static bool row(bench *b, const char *name, work *w, const answer theirs[PEERS])
{
  const bench_time sharp = bench_measure(b, job_mesh, w, BUDGET);
  const bench_time ours = bench_measure(b, job_cut_mesh, w, BUDGET);
  if (sharp.failed || ours.failed)
    return false;
  const unsigned size = w->grid.count[0];
  printf("%-15s %5u %9.2f %9.2f %9llu", name, size, 1e3 * sharp.processor, 1e3 * ours.processor,
         (unsigned long long)w->answer);
  for (unsigned p = 0; p < PEERS; p++) {
    char text[16];
    if (theirs[p].seconds > 0) {
      printf(" %9.2f %9s", 1e3 * theirs[p].seconds,
             bench_ratio(text, ours.processor / theirs[p].seconds, ""));
      bench_remember(b, theirs[p].seconds, "peers %s %s %u", name, peers[p], size);
    } else {
      printf(" %9s %9s", "", "");
    }
  }
  if (theirs[0].triangles)
    printf(" %9lu", theirs[0].triangles);
  printf("\n");
  bench_remember(b, ours.processor, "peers %s mesh %u", name, size);
  bench_remember(b, sharp.processor, "peers %s sharp %u", name, size);
  return true;
}

static bool run_scene(bench *b, size_t index, scratch *folder)
{
  work grids[BENCH_SIZES];
  answers all = {0};
  char arguments[2048];
  zs_field *field = scene_compile(scenes[index].write, bench_parts(b, scenes[index].n));
  bool good = field != NULL;
  for (unsigned i = 0; i < BENCH_SIZES; i++)
    good = good && work_begin(&grids[i], field, bench_size(b, sizes[i]), 1);
  good = good && write_grids(grids, folder, arguments);
  if (good)
    ask_all(grids, arguments, all);
  for (unsigned i = 0; i < BENCH_SIZES; i++)
    good = good && row(b, scenes[index].name, &grids[i], all[i]);
  zs_field_unref(field);
  return good;
}

void bench_peers(bench *b)
{
  scratch folder = {.folder = ""};
  for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
    if (!bench_wants(b, "peers %s", scenes[i].name))
      continue;
    if (!*folder.folder) {
      printf("\n%-15s %5s %9s %9s %9s %9s %9s %9s %9s %9s %9s %9s\n", "peers", "size", "sharp ms",
             "ms", "triangles", "VTK ms", "ours/VTK", "skimage", "ours/it", "GTS ms", "ours/it",
             "VTK tri.");
      if (!scratch_make(&folder)) {
        fprintf(stderr, "bench: no files can be written here\n");
        b->wrong = true;
        return;
      }
    }
    if (!run_scene(b, i, &folder)) {
      printf("%-15s wrong!\n", scenes[i].name);
      b->wrong = true;
    }
  }
  if (*folder.folder)
    scratch_remove(&folder);
}
