# This room adds to the lists that Makefile.am describes.
EXTRA_DIST += \
  scenes/bracket.xml \
  scenes/bunny.obj \
  scenes/bunny.xml \
  scenes/column.xml \
  scenes/cup.xml \
  scenes/flange.xml \
  scenes/library/mouldings.xml \
  scenes/loft.xml \
  scenes/surface.xml
