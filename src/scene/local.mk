zs_sources += \
  src/scene/cache.c \
  src/scene/compile.c \
  src/scene/document.c \
  src/scene/document.h \
  src/scene/expand.c \
  src/scene/gate.c \
  src/scene/gate.h \
  src/scene/load.c \
  src/scene/path.c \
  src/scene/scene.h \
  src/scene/store.c \
  src/scene/tree.h \
  src/scene/value.c
