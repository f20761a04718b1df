zs_sources += \
  src/language/documents.c \
  src/language/documents.h \
  src/language/grammar.c \
  src/language/grammar.h \
  src/language/manual.c \
  src/language/relaxng.c \
  src/language/text.c \
  src/language/text.h \
  src/language/xsd.c
