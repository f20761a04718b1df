zs_sources += \
  src/samples/arc_tree.c \
  src/samples/arc_tree.h \
  src/samples/arcs.c \
  src/samples/arcs.h \
  src/samples/fill.c \
  src/samples/fill.h \
  src/samples/minkowski.c \
  src/samples/minkowski.h \
  src/samples/minkowski_samples.c \
  src/samples/picture.c \
  src/samples/picture.h \
  src/samples/polygon.c \
  src/samples/polygon.h \
  src/samples/raster.c \
  src/samples/raster.h \
  src/samples/skeleton.c \
  src/samples/skeleton.h \
  src/samples/skeleton_pieces.h \
  src/samples/skeleton_tree.c \
  src/samples/skeleton_tree.h \
  src/samples/transform.c \
  src/samples/transform.h \
  src/samples/triangles.c \
  src/samples/triangles.h \
  src/samples/voxels.c \
  src/samples/voxels.h \
  src/samples/warp.c \
  src/samples/warp.h \
  src/samples/warp_point.h

zs_kernel_sources += \
  src/samples/minkowski.kernel.c \
  src/samples/polygon.kernel.c \
  src/samples/raster.kernel.c \
  src/samples/skeleton.kernel.c \
  src/samples/triangles.kernel.c \
  src/samples/voxels.kernel.c \
  src/samples/warp.kernel.c
