/* Peak memory of the program, only when asked for by the word "memory": the
 * runs take minutes, and one writes 8 GB. */
#include "bench.h"
#include "scenes.h"

#include "../files/scratch.h"

#include <stdio.h>
#include <string.h>

static void row(bench *b, const char *name, char *const arguments[])
{
  bench_child child = {0};
  bool good = bench_run_child(arguments, &child);
  double gigabytes = (double)child.peak_bytes * 1e-9;
  printf("%-15s %8s %10.1f %8.3f%s\n", "gyroid-sphere", name, child.span.wall, gigabytes,
         good ? "" : " wrong!");
  if (good)
    bench_remember(b, gigabytes, "memory %s", name);
  else
    b->wrong = true;
}

static bool write_scene(scratch *folder)
{
  text t = {0};
  FILE *file = fopen(scratch_path(folder, "scene.xml"), "w");
  bool good = file && scene_gyroid(&t, 0) && fwrite(t.bytes, 1, t.length, file) == t.length;
  good = file && !fclose(file) && good;
  text_clear(&t);
  return good;
}

void bench_memory(bench *b)
{
  scratch folder;
  if (!bench_asked(b, "memory"))
    return;
  if (!scratch_make(&folder) || !write_scene(&folder)) {
    fprintf(stderr, "bench: no files can be written here\n");
    b->wrong = true;
    return;
  }
  printf("\n%-15s %8s %10s %8s\n", "memory", "job", "seconds", "peak GB");
  char *program = (char *)bench_environment("ZEROSET", "./zeroset");
  char scene[400], ply[400], raw[400];
  strcpy(scene, scratch_path(&folder, "scene.xml"));
  strcpy(ply, scratch_path(&folder, "mesh.ply"));
  strcpy(raw, scratch_path(&folder, "volume.raw"));
  row(b, "mesh", (char *[]){program, "mesh", scene, "-o", ply, "--resolution", "1024", "-q", NULL});
  remove(ply);
  row(b, "voxels", (char *[]){program, "voxel", scene, "-o", raw, "--resolution", "2048",
                              "--quantity", "inside", "-q", NULL});
  scratch_remove(&folder);
}
