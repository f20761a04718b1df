#include "cli/commands.h"
#include "cli/session.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void report_mesh(cli_session *session, const char *output, const zs_mesh *mesh,
                        const zs_mesh_report *check)
{
  cli_json json;
  cli_session_report(session, &json, output);
  cli_json_integer(&json, "vertices", (int64_t)zs_mesh_vertex_count(mesh));
  cli_json_integer(&json, "triangles", (int64_t)zs_mesh_triangle_count(mesh));
  cli_json_integer(&json, "components", (int64_t)check->components);
  cli_json_boolean(&json, "closed", check->closed);
  cli_json_boolean(&json, "manifold", check->manifold);
  cli_json_boolean(&json, "oriented", check->oriented);
  cli_json_integer(&json, "euler_characteristic", check->euler_characteristic);
  cli_json_number(&json, "volume", check->volume);
  cli_json_number(&json, "area", check->area);
  cli_session_report_end(&json);
}

static void tell_mesh(const cli_session *session, const char *output, const zs_mesh *mesh,
                      const zs_mesh_report *check)
{
  const char *units = zs_scene_units(session->scene);
  fprintf(stderr, "%s: %zu triangles, %s, %s, %zu component%s, volume %.6g%s%s%s, %.2f s\n", output,
          zs_mesh_triangle_count(mesh), check->closed ? "closed" : "open",
          check->manifold ? "manifold" : "not manifold", check->components,
          check->components == 1 ? "" : "s", check->volume, *units ? " " : "", units,
          *units ? "^3" : "", cli_clock() - session->begun);
}

/* Keep what touches a point of any fit: constraints lie on the surface, and a mesh
 * is as near to it as its cells are large. */
static bool keep_at_constraints(cli_session *session, zs_mesh *mesh, const zs_grid *grid)
{
  const double reach = hypot(hypot(grid->cell[0], grid->cell[1]), grid->cell[2]);
  double *points = NULL;
  size_t count = 0;
  zs_fit_info fit;
  bool good = true;
  for (size_t i = 0; good && zs_field_fit(session->field, i, &fit); i++) {
    double *more = realloc(points, 3 * (count + fit.point_count + 1) * sizeof *points);
    good = more || cli_error("out of memory");
    points = more ? more : points;
    if (good && fit.point_count)
      memcpy(points + 3 * count, fit.points, 3 * fit.point_count * sizeof *points);
    count += fit.point_count;
  }
  if (good && count == 0)
    good = cli_error("--seed constraints: no variational fit has points that lie in space");
  good = good && zs_mesh_keep_components(mesh, points, count, reach, &session->diag);
  free(points);
  return good;
}

static bool keep_seeded(cli_session *session, zs_mesh *mesh, const zs_grid *grid)
{
  const cli_options *options = session->options;
  if (options->seed_constraints && !keep_at_constraints(session, mesh, grid))
    return false;
  return !options->seed_count || zs_mesh_keep_components(mesh, options->seeds, options->seed_count,
                                                         INFINITY, &session->diag);
}

/* Cells collapse while they are meshed, which is quick, and what they leave is simplified:
 * each may be off by half of what was asked for. */
static double half_error(const cli_options *options)
{
  return options->has_simplify ? options->simplify / 2 : 0;
}

/* Simplify, check and write; the seconds go where they belong. */
static bool finish_mesh(cli_session *session, zs_mesh *mesh, const char *output)
{
  const cli_options *options = session->options;
  double begun = cli_clock();
  if (options->has_simplify) {
    cli_progress_begin(&session->progress, 0);
    const double error =
      options->method == ZS_MESH_FEATURES ? half_error(options) : options->simplify;
    if (!zs_mesh_simplify(mesh, error, &session->control, &session->diag))
      return false;
  }
  zs_mesh_report check;
  if (!zs_mesh_check(mesh, &check, &session->diag) || cli_signal())
    return false;
  double assembled = cli_clock();
  session->seconds.assemble += assembled - begun;
  if (!zs_mesh_write(mesh, output, &session->diag))
    return false;
  session->seconds.write = cli_clock() - assembled;
  cli_progress_clear(&session->progress);
  if (options->report_json)
    report_mesh(session, output, mesh, &check);
  if (cli_session_talks(session))
    tell_mesh(session, output, mesh, &check);
  return true;
}

static bool frame(cli_session *session, const char *output)
{
  zs_grid grid;
  if (!cli_session_grid(session, &grid))
    return false;
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.method = (zs_mesh_method)session->options->method;
  options.collapse = half_error(session->options);
  cli_progress_begin(&session->progress,
                     (double)grid.count[0] * grid.count[1] * grid.count[2]);
  zs_mesh *mesh = zs_polygonize(session->field, &grid, &options, &session->control, &session->job,
                                &session->diag);
  if (!mesh)
    return false;
  session->seconds.evaluate = session->job.seconds_evaluate;
  session->seconds.assemble = session->job.seconds_assemble;
  bool good = keep_seeded(session, mesh, &grid) && finish_mesh(session, mesh, output);
  zs_mesh_free(mesh);
  return good;
}

int cli_mesh(const cli_options *options)
{
  return cli_session_run(options, frame);
}
