zs_sources += \
  src/base/arena.c \
  src/base/arena.h \
  src/base/diagnostic.c \
  src/base/diagnostic.h \
  src/base/expression.h \
  src/base/output.h
