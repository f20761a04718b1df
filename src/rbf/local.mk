# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/rbf/constraints.c \
  src/rbf/constraints.h \
  src/rbf/dense.c \
  src/rbf/dense.h \
  src/rbf/fit.c \
  src/rbf/fit.h \
  src/rbf/kernel.c \
  src/rbf/kernel.h \
  src/rbf/series.c \
  src/rbf/series.h \
  src/rbf/sum.c \
  src/rbf/sum.h \
  src/rbf/tree.c \
  src/rbf/tree.h \
  src/rbf/vector.h

zs_kernel_sources += src/rbf/series.kernel.c src/rbf/sum.kernel.c
