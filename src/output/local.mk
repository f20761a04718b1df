# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/output/color.h \
  src/output/grid.c \
  src/output/grid.h \
  src/output/job.c \
  src/output/job.h \
  src/output/slice.c \
  src/output/voxelize.c
