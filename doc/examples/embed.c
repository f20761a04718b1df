/* Embeds Zeroset: loads a scene, compiles it, and weighs the solid by sampling f on a grid.
 *
 *   cc embed.c $(pkg-config --cflags --libs zeroset) -o embed && ./embed scene.xml */
#include <zeroset.h>

#include <stdio.h>

enum { CELLS = 96, ROW = 256 };

static void print(void *context, const zs_diagnostic *d)
{
  fprintf(context, "%s:%u:%u: %s\n", d->file ? d->file : "embed", d->line, d->column, d->message);
}

int main(int argc, char **argv)
{
  zs_diag diag = {.report = print, .context = stderr};
  zs_scene *scene = argc == 2 ? zs_scene_load(argv[1], NULL, &diag) : NULL;
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  zs_eval *eval = field ? zs_eval_new(field, &diag) : NULL; /* one per thread */
  double lo[3], hi[3];
  zs_grid grid;
  bool ready = eval && zs_field_box(field, lo, hi, &diag) &&
               zs_grid_fit(&grid, lo, hi, CELLS, &diag);
  uint64_t inside = 0;
  for (uint32_t k = 0; ready && k < grid.count[2]; k++) {
    for (uint32_t j = 0; j < grid.count[1]; j++) {
      float x[ROW], y[ROW], z[ROW], f[ROW]; /* relative to the grid's corner */
      for (uint32_t i = 0; i < grid.count[0]; i++) {
        x[i] = (float)((i + 0.5) * grid.cell[0]);
        y[i] = (float)((j + 0.5) * grid.cell[1]);
        z[i] = (float)((k + 0.5) * grid.cell[2]);
      }
      zs_eval_values(eval, grid.lo, grid.count[0], x, y, z, f);
      for (uint32_t i = 0; i < grid.count[0]; i++)
        inside += f[i] >= 0;
    }
  }
  if (ready)
    printf("volume %.6g\n", (double)inside * grid.cell[0] * grid.cell[1] * grid.cell[2]);
  zs_eval_free(eval);
  zs_field_unref(field);
  zs_scene_free(scene);
  return ready ? 0 : 1;
}
