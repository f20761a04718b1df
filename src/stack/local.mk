zs_sources += \
  src/stack/blocks.c \
  src/stack/blocks.h \
  src/stack/carry.c \
  src/stack/join.c \
  src/stack/join.h \
  src/stack/mend.c \
  src/stack/motion.c \
  src/stack/motion.h \
  src/stack/motion_fields.c \
  src/stack/motion_fields.h \
  src/stack/motion_gate.c \
  src/stack/slices.c \
  src/stack/slices.h \
  src/stack/variational.c
