zs_sources += \
  src/samples/polygon.c \
  src/samples/polygon.h \
  src/samples/voxels.c \
  src/samples/voxels.h

zs_kernel_sources += \
  src/samples/polygon.kernel.c \
  src/samples/voxels.kernel.c
