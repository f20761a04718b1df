zs_sources += \
  src/base/arena.c \
  src/base/arena.h \
  src/base/array.c \
  src/base/array.h \
  src/base/diagnostic.c \
  src/base/diagnostic.h \
  src/base/expression.c \
  src/base/expression.h \
  src/base/key.c \
  src/base/key.h \
  src/base/memory.c \
  src/base/memory.h \
  src/base/names.c \
  src/base/names.h \
  src/base/output.c \
  src/base/output.h \
  src/base/threads.h \
  src/base/vector3.h \
  src/base/version.c \
  src/base/xml.c \
  src/base/xml.h
