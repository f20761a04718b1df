zs_sources += \
  src/scene/document.c \
  src/scene/document.h \
  src/scene/tree.h
