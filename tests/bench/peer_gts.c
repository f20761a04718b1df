/* How long GTS takes to extract the surface of grids in memory: a peer of
 * peers.py, with the same arguments and output, built where GTS is installed.
 *
 * Usage: peer_gts FILE NX NY NZ [FILE NX NY NZ ...] */
#include <gts.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_SAMPLES = 128 * 128 * 128 }; /* GTS needs a kilobyte for a triangle */

typedef struct volume {
  guint count[3];
  float *samples;
} volume;

/* GTS asks for layers in order of z, as f[x][y]. */
static void layer(gdouble **f, GtsCartesianGrid grid, guint k, gpointer data)
{
  const volume *v = data;
  const float *samples = v->samples + (size_t)k * v->count[0] * v->count[1];
  for (guint x = 0; x < grid.nx; x++)
    for (guint y = 0; y < grid.ny; y++)
      f[x][y] = samples[(size_t)y * grid.nx + x];
}

static double seconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double extract(const volume *v, guint *triangles)
{
  GtsCartesianGrid grid = {.nx = v->count[0], .ny = v->count[1], .nz = v->count[2],
                           .dx = 1, .dy = 1, .dz = 1};
  double begun = seconds();
  GtsSurface *surface = gts_surface_new(gts_surface_class(), gts_face_class(), gts_edge_class(),
                                        gts_vertex_class());
  gts_isosurface_cartesian(surface, grid, layer, (gpointer)v, 0);
  double taken = seconds() - begun;
  *triangles = gts_surface_face_number(surface);
  gts_object_destroy(GTS_OBJECT(surface));
  return taken;
}

static int ascending(const void *a, const void *b)
{
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static bool run(const char *path, char **counts)
{
  volume v;
  for (int k = 0; k < 3; k++)
    v.count[k] = (guint)strtoul(counts[k], NULL, 10);
  size_t n = (size_t)v.count[0] * v.count[1] * v.count[2];
  if (n > MOST_SAMPLES)
    return true;
  v.samples = malloc(n * sizeof(float));
  FILE *file = fopen(path, "rb");
  bool good = v.samples && file && fread(v.samples, sizeof(float), n, file) == n;
  if (good) {
    enum { REPEATS = 3 };
    double times[REPEATS], spent = 0;
    guint triangles = 0;
    int runs = 0;
    while (runs < REPEATS && spent < 1) {
      times[runs] = extract(&v, &triangles);
      spent += times[runs++];
    }
    qsort(times, (size_t)runs, sizeof *times, ascending);
    printf("gts %u %.9f %u\n", v.count[0], times[runs / 2], triangles);
  }
  if (file)
    fclose(file);
  free(v.samples);
  return good;
}

int main(int argc, char **argv)
{
  for (int i = 1; i + 3 < argc; i += 4)
    if (!run(argv[i], argv + i + 1))
      return 1;
  return 0;
}
