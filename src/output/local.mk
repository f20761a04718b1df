# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/output/camera.c \
  src/output/camera.h \
  src/output/color.h \
  src/output/grid.c \
  src/output/grid.h \
  src/output/job.c \
  src/output/job.h \
  src/output/render.c \
  src/output/shade.c \
  src/output/shade.h \
  src/output/slice.c \
  src/output/trace.c \
  src/output/trace.h \
  src/output/voxelize.c
