zeroset_SOURCES += \
  src/cli/blas.h \
  src/cli/check.c \
  src/cli/commands.h \
  src/cli/documents.c \
  src/cli/eval.c \
  src/cli/fit.c \
  src/cli/help.c \
  src/cli/info.c \
  src/cli/main.c \
  src/cli/mesh.c \
  src/cli/options.c \
  src/cli/options.h \
  src/cli/picture.c \
  src/cli/picture.h \
  src/cli/progress.c \
  src/cli/progress.h \
  src/cli/render.c \
  src/cli/report.c \
  src/cli/report.h \
  src/cli/session.c \
  src/cli/session.h \
  src/cli/slice.c \
  src/cli/text.c \
  src/cli/text.h \
  src/cli/voxel.c
