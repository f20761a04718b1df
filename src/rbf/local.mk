# This room adds to the lists that Makefile.am describes.
zs_sources += \
  src/rbf/cells.c \
  src/rbf/cells.h \
  src/rbf/centre.h \
  src/rbf/chebyshev.c \
  src/rbf/chebyshev.h \
  src/rbf/clusters.c \
  src/rbf/clusters.h \
  src/rbf/constraints.c \
  src/rbf/constraints.h \
  src/rbf/contour.c \
  src/rbf/contour.h \
  src/rbf/dense.c \
  src/rbf/dense.h \
  src/rbf/direct.c \
  src/rbf/distinct.c \
  src/rbf/distinct.h \
  src/rbf/fast.c \
  src/rbf/fast.h \
  src/rbf/fgmres.c \
  src/rbf/fgmres.h \
  src/rbf/fit.c \
  src/rbf/fit.h \
  src/rbf/flow.c \
  src/rbf/flow.h \
  src/rbf/flow_new.c \
  src/rbf/greedy.c \
  src/rbf/greedy.h \
  src/rbf/iterative.c \
  src/rbf/kernel.c \
  src/rbf/kernel.h \
  src/rbf/local.c \
  src/rbf/local.h \
  src/rbf/nodes.c \
  src/rbf/nodes.h \
  src/rbf/normals.c \
  src/rbf/normals.h \
  src/rbf/pairs.h \
  src/rbf/phi.h \
  src/rbf/poll.c \
  src/rbf/poll.h \
  src/rbf/product.c \
  src/rbf/product.h \
  src/rbf/schwarz.c \
  src/rbf/schwarz.h \
  src/rbf/solve.h \
  src/rbf/sum.c \
  src/rbf/sum.h \
  src/rbf/swarms.c \
  src/rbf/swarms.h \
  src/rbf/system.c \
  src/rbf/system.h \
  src/rbf/target.c \
  src/rbf/target.h \
  src/rbf/tree.c \
  src/rbf/tree.h \
  src/rbf/vector.h \
  src/rbf/width.c \
  src/rbf/width.h

zs_kernel_sources += \
  src/rbf/cells.kernel.c \
  src/rbf/flow.kernel.c \
  src/rbf/local.kernel.c \
  src/rbf/nodes.kernel.c \
  src/rbf/product.kernel.c \
  src/rbf/sum.kernel.c
