/* The scenes of the benchmark, as text. */
#ifndef ZS_BENCH_SCENES_H
#define ZS_BENCH_SCENES_H

#include "zeroset.h"

typedef struct text {
  char *bytes;
  size_t length, capacity;
} text;

void text_append(text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
void text_clear(text *t);

/* Spheres at random places in -1 .. 1, under a smooth union. */
typedef struct sphere {
  float x, y, z, radius;
} sphere;
typedef struct spheres {
  sphere *items; /* for free() */
  unsigned count;
  double blend; /* the radius of the smooth union */
} spheres;

/* The same total volume at every count. */
spheres spheres_of_volume(unsigned count);
/* The same total surface as a thousand of the same volume. */
spheres spheres_of_surface(unsigned count);

/* Writers of scenes; n says how many parts, where there is a choice. */
typedef bool scene_writer(text *t, unsigned n);
scene_writer scene_spheres, scene_spheres_same_surface, scene_menger, scene_gyroid, scene_column,
  scene_gear, scene_bunny, scene_rings, scene_prospero, scene_soft, scene_convolution;

/* Whether the optional input of scene_prospero is there. */
bool scene_prospero_exists(void);

/* A scene compiled; NULL when it cannot be. */
zs_field *scene_compile(scene_writer *write, unsigned n);
/* The same from the formulas of its nodes, by scalar operations alone. */
zs_field *scene_compile_scalar(scene_writer *write, unsigned n);

/* A file below the project's scenes/. */
const char *scene_path(char path[4096], const char *name);

#endif
