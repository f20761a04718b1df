# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/files/gray.c \
  src/files/gray.h \
  src/files/image.c \
  src/files/image.h \
  src/files/number.c \
  src/files/number.h \
  src/files/points.c \
  src/files/points.h \
  src/files/rings.c \
  src/files/rings.h \
  src/files/text_file.c \
  src/files/text_file.h \
  src/files/volume.c \
  src/files/volume.h
