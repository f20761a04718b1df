zs_sources += \
  src/samples/polygon.c \
  src/samples/polygon.h

zs_kernel_sources += src/samples/polygon.kernel.c
