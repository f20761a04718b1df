# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/mesh/check.c \
  src/mesh/close.c \
  src/mesh/input.h \
  src/mesh/keep.c \
  src/mesh/mesh.c \
  src/mesh/mesh.h \
  src/mesh/openmesh.cc \
  src/mesh/openmesh.h \
  src/mesh/read.c \
  src/mesh/read_obj.c \
  src/mesh/read_off.c \
  src/mesh/read_om.c \
  src/mesh/read_ply.c \
  src/mesh/read_stl.c \
  src/mesh/simplify.c \
  src/mesh/write.c
