zs_sources += \
  src/field/blend.c \
  src/field/blend.h \
  src/field/box.c \
  src/field/chain.c \
  src/field/chain.h \
  src/field/compiler.c \
  src/field/compiler.h \
  src/field/eval.c \
  src/field/field.c \
  src/field/field.h \
  src/field/fold.c \
  src/field/fold.h \
  src/field/interval.h \
  src/field/isa.c \
  src/field/joint.h \
  src/field/lanes.h \
  src/field/lattice.c \
  src/field/operation.h \
  src/field/primitive.c \
  src/field/primitive.h \
  src/field/program.c \
  src/field/program.h \
  src/field/row.h \
  src/field/scalar.c \
  src/field/scalar.h \
  src/field/scatter.c \
  src/field/shape.h \
  src/field/walk.c

zs_kernel_sources += \
  src/field/blend.kernel.c \
  src/field/chain.kernel.c \
  src/field/fold.kernel.c \
  src/field/primitive.kernel.c \
  src/field/scalar.kernel.c
