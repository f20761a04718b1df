# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/output/camera.c \
  src/output/camera.h \
  src/output/color.h \
  src/output/contour_table.c \
  src/output/contour_table.h \
  src/output/drawing.c \
  src/output/drawing.h \
  src/output/grid.c \
  src/output/grid.h \
  src/output/job.c \
  src/output/job.h \
  src/output/polygonize.c \
  src/output/polygonize.h \
  src/output/polygonize_cells.c \
  src/output/polygonize_creases.c \
  src/output/polygonize_creases.h \
  src/output/polygonize_creases_settle.c \
  src/output/polygonize_distinct.c \
  src/output/polygonize_features.c \
  src/output/polygonize_features_claims.c \
  src/output/polygonize_features_collapse.c \
  src/output/polygonize_features_quads.c \
  src/output/polygonize_features_turn.c \
  src/output/polygonize_features_vertices.c \
  src/output/polygonize_roots.c \
  src/output/polygonize_roots.h \
  src/output/polygonize_rows.c \
  src/output/polygonize_rows.h \
  src/output/polygonize_sample.c \
  src/output/polygonize_vertices.c \
  src/output/outline.c \
  src/output/outline.h \
  src/output/quadric.c \
  src/output/quadric.h \
  src/output/render.c \
  src/output/shade.c \
  src/output/shade.h \
  src/output/slice.c \
  src/output/slice.h \
  src/output/slice_correspondence.c \
  src/output/slice_outline.c \
  src/output/slice_plane.c \
  src/output/slice_svg.c \
  src/output/trace.c \
  src/output/trace.h \
  src/output/trace_leaf.c \
  src/output/trace_leaf.h \
  src/output/voxelize.c

zs_kernel_sources += \
  src/output/polygonize_creases.kernel.c \
  src/output/polygonize_roots.kernel.c \
  src/output/polygonize_rows.kernel.c \
  src/output/shade.kernel.c
