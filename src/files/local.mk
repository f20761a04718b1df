# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/files/image.c \
  src/files/image.h \
  src/files/number.c \
  src/files/number.h \
  src/files/points.c \
  src/files/points.h \
  src/files/volume.c \
  src/files/volume.h
