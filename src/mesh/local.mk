# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/mesh/check.c \
  src/mesh/mesh.c \
  src/mesh/mesh.h
