/* The registry of node kinds: a new kind adds a declaration and a line. */
#include "nodes/kind.h"

#include <string.h>

extern const zs_kind zs_kind_sphere, zs_kind_ellipsoid, zs_kind_box, zs_kind_cylinder,
  zs_kind_cone, zs_kind_torus, zs_kind_capsule, zs_kind_half_space, zs_kind_slab,
  zs_kind_superellipsoid, zs_kind_quadric, zs_kind_gyroid, zs_kind_convex, zs_kind_formula,
  zs_kind_empty, zs_kind_everything;
extern const zs_kind zs_kind_circle, zs_kind_ellipse, zs_kind_rectangle, zs_kind_regular_polygon,
  zs_kind_polygon, zs_kind_curved_polygon, zs_kind_path, zs_kind_half_plane, zs_kind_image;
extern const zs_kind zs_kind_extrude, zs_kind_revolve;
extern const zs_kind zs_kind_union, zs_kind_intersection, zs_kind_difference, zs_kind_complement,
  zs_kind_symmetric_difference;
extern const zs_kind zs_kind_blend_union, zs_kind_blend_intersection, zs_kind_blend_difference,
  zs_kind_smooth_union, zs_kind_smooth_intersection, zs_kind_smooth_difference,
  zs_kind_bounded_blend, zs_kind_ricci;
extern const zs_kind zs_kind_soft, zs_kind_convolution;
extern const zs_kind zs_kind_offset, zs_kind_shell, zs_kind_displace, zs_kind_scale_value,
  zs_kind_pinch, zs_kind_fit_points, zs_kind_normalize, zs_kind_noise;
extern const zs_kind zs_kind_translate, zs_kind_rotate, zs_kind_scale, zs_kind_mirror,
  zs_kind_matrix, zs_kind_stretch, zs_kind_shear, zs_kind_twist, zs_kind_taper, zs_kind_bend,
  zs_kind_space_map, zs_kind_repeat_grid, zs_kind_repeat_polar, zs_kind_lattice_warp,
  zs_kind_slice, zs_kind_map;
extern const zs_kind zs_kind_interpolate, zs_kind_stack, zs_kind_variational,
  zs_kind_space_time_blend, zs_kind_local_morph,
  zs_kind_distance_morph, zs_kind_minkowski_morph;
extern const zs_kind zs_kind_distance, zs_kind_volume, zs_kind_sample;

const zs_kind *const zs_kinds[] = {
  /* Primitives */
  &zs_kind_sphere,
  &zs_kind_ellipsoid,
  &zs_kind_box,
  &zs_kind_cylinder,
  &zs_kind_cone,
  &zs_kind_torus,
  &zs_kind_capsule,
  &zs_kind_half_space,
  &zs_kind_slab,
  &zs_kind_superellipsoid,
  &zs_kind_quadric,
  &zs_kind_gyroid,
  &zs_kind_convex,
  &zs_kind_soft,
  &zs_kind_convolution,
  &zs_kind_formula,
  &zs_kind_empty,
  &zs_kind_everything,
  /* Shapes */
  &zs_kind_circle,
  &zs_kind_ellipse,
  &zs_kind_rectangle,
  &zs_kind_regular_polygon,
  &zs_kind_polygon,
  &zs_kind_curved_polygon,
  &zs_kind_path,
  &zs_kind_half_plane,
  &zs_kind_image,
  /* Solids from shapes */
  &zs_kind_extrude,
  &zs_kind_revolve,
  /* Set operations */
  &zs_kind_union,
  &zs_kind_intersection,
  &zs_kind_difference,
  &zs_kind_complement,
  &zs_kind_symmetric_difference,
  /* Blends */
  &zs_kind_blend_union,
  &zs_kind_blend_intersection,
  &zs_kind_blend_difference,
  &zs_kind_smooth_union,
  &zs_kind_smooth_intersection,
  &zs_kind_smooth_difference,
  &zs_kind_bounded_blend,
  &zs_kind_ricci,
  /* Function maps */
  &zs_kind_offset,
  &zs_kind_shell,
  &zs_kind_displace,
  &zs_kind_scale_value,
  &zs_kind_pinch,
  &zs_kind_fit_points,
  &zs_kind_normalize,
  &zs_kind_noise,
  /* Coordinate maps */
  &zs_kind_translate,
  &zs_kind_rotate,
  &zs_kind_scale,
  &zs_kind_mirror,
  &zs_kind_matrix,
  &zs_kind_stretch,
  &zs_kind_shear,
  &zs_kind_twist,
  &zs_kind_taper,
  &zs_kind_bend,
  &zs_kind_space_map,
  &zs_kind_lattice_warp,
  &zs_kind_repeat_grid,
  &zs_kind_repeat_polar,
  &zs_kind_slice,
  &zs_kind_map,
  /* Interpolation and reconstruction */
  &zs_kind_interpolate,
  &zs_kind_stack,
  &zs_kind_variational,
  &zs_kind_space_time_blend,
  &zs_kind_local_morph,
  &zs_kind_distance_morph,
  &zs_kind_minkowski_morph,
  /* Data */
  &zs_kind_distance,
  &zs_kind_volume,
  &zs_kind_sample,
  NULL,
};

const zs_kind *zs_kind_find(const char *name)
{
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++)
    if ((*kind)->name[0] == name[0] && !strcmp((*kind)->name, name))
      return *kind;
  return NULL;
}
