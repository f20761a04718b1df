# This room adds to the lists that Makefile.am describes.
EXTRA_DIST += \
  scenes/bracket.xml \
  scenes/bunny.obj \
  scenes/bunny.xml \
  scenes/column.xml \
  scenes/contours.xml \
  scenes/cup.xml \
  scenes/figurine.xml \
  scenes/flange.xml \
  scenes/influence.xml \
  scenes/letters.xml \
  scenes/library/mouldings.xml \
  scenes/loft.xml \
  scenes/morph.xml \
  scenes/morph/hook-down.xyz \
  scenes/morph/hook-up.xyz \
  scenes/morph/jug.txt \
  scenes/morph/knot.xyz \
  scenes/morph/ring.txt \
  scenes/morph/shapes.py \
  scenes/morph/star.xyz \
  scenes/morph/torus.xyz \
  scenes/plate.xml \
  scenes/plate/ornament.svg \
  scenes/scan.xml \
  scenes/scan/figurine.nii.gz \
  scenes/stack.xml \
  scenes/stack/root0.png \
  scenes/stack/root1.png \
  scenes/stack/root2.png \
  scenes/stack/root3.png \
  scenes/stack/root4.png \
  scenes/stack/root5.png \
  scenes/stack/root6.png \
  scenes/stack/slices.py \
  scenes/surface.xml \
  scenes/warp.xml
