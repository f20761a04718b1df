# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/files/gray.c \
  src/files/gray.h \
  src/files/image.c \
  src/files/image.h \
  src/files/nifti.h \
  src/files/number.c \
  src/files/number.h \
  src/files/outline.c \
  src/files/outline.h \
  src/files/path_data.c \
  src/files/points.c \
  src/files/points.h \
  src/files/rings.c \
  src/files/rings.h \
  src/files/svg.c \
  src/files/svg.h \
  src/files/svg_values.c \
  src/files/svg_values.h \
  src/files/text_file.c \
  src/files/text_file.h \
  src/files/tiff.c \
  src/files/tiff.h \
  src/files/volume.c \
  src/files/volume.h \
  src/files/volume_data.c \
  src/files/volume_input.h \
  src/files/volume_meta.c \
  src/files/volume_nifti.c \
  src/files/volume_nrrd.c \
  src/files/volume_read.c \
  src/files/volume_read.h \
  src/files/volume_vti.c
