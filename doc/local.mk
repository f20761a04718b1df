# nodes.md, the manual page and the completion are generated: make regen.
dist_doc_DATA += \
  doc/architecture.md \
  doc/language.md \
  doc/nodes.md \
  doc/performance.md \
  doc/tutorial-stack.md
dist_man_MANS = doc/zeroset.1
bashcompletiondir = $(datadir)/bash-completion/completions
dist_bashcompletion_DATA = doc/zeroset.bash

# Pictures of the scenes, for doc/gallery.md.
gallery_pictures = \
  doc/gallery/bearing.png \
  doc/gallery/becoming.png \
  doc/gallery/bracket-slice.png \
  doc/gallery/bracket.png \
  doc/gallery/bunny.png \
  doc/gallery/candlestick.png \
  doc/gallery/column.png \
  doc/gallery/contours.png \
  doc/gallery/creature.png \
  doc/gallery/cup-slice.png \
  doc/gallery/cup.png \
  doc/gallery/doll.png \
  doc/gallery/drag.png \
  doc/gallery/figurine-cut.png \
  doc/gallery/figurine.png \
  doc/gallery/flange.png \
  doc/gallery/hull-boat.png \
  doc/gallery/hull.png \
  doc/gallery/influence.png \
  doc/gallery/influence-star.png \
  doc/gallery/lantern.png \
  doc/gallery/letters-pairs.png \
  doc/gallery/letters.png \
  doc/gallery/loft.png \
  doc/gallery/morph.png \
  doc/gallery/morph-surface.png \
  doc/gallery/muscle.png \
  doc/gallery/plate.png \
  doc/gallery/scan.png \
  doc/gallery/spanner-slice.png \
  doc/gallery/spanner.png \
  doc/gallery/stack.png \
  doc/gallery/stack-straight.png \
  doc/gallery/stack-ways.png \
  doc/gallery/sums.png \
  doc/gallery/surface.png \
  doc/gallery/warp.png \
  doc/gallery/warp-plain.png
EXTRA_DIST += doc/gallery.md $(gallery_pictures)

gallery: zeroset
	for name in bearing bracket bunny candlestick column contours creature cup drag figurine \
	    flange hull influence lantern letters loft morph muscle plate scan spanner stack \
	    surface warp; do \
	  ./zeroset render $(srcdir)/scenes/$$name.xml --size 480x360 \
	    -o $(srcdir)/doc/gallery/$$name.png || exit 1; \
	done
	./zeroset render $(srcdir)/scenes/becoming.xml --object row --view shelf --bounds "-8 -9 -1 52 9 11" \
	  --size 960x320 -o $(srcdir)/doc/gallery/becoming.png
	./zeroset render $(srcdir)/scenes/sums.xml --object row --view table --size 960x400 \
	  -o $(srcdir)/doc/gallery/sums.png
	./zeroset slice $(srcdir)/scenes/bracket.xml --z 4 --size 480x360 \
	  -o $(srcdir)/doc/gallery/bracket-slice.png
	./zeroset slice $(srcdir)/scenes/cup.xml --axis y --at 0 --size 480x360 \
	  -o $(srcdir)/doc/gallery/cup-slice.png
	./zeroset render $(srcdir)/scenes/doll.xml --object row --view four --size 480x360 \
	  -o $(srcdir)/doc/gallery/doll.png
	./zeroset render $(srcdir)/scenes/figurine.xml --object cut --size 480x360 \
	  -o $(srcdir)/doc/gallery/figurine-cut.png
	./zeroset render $(srcdir)/scenes/hull.xml --object boat --size 480x360 \
	  -o $(srcdir)/doc/gallery/hull-boat.png
	./zeroset render $(srcdir)/scenes/influence.xml --set t=0.1 --size 480x360 \
	  -o $(srcdir)/doc/gallery/influence-star.png
	./zeroset slice $(srcdir)/scenes/letters.xml --z 64 --correspondence --size 480x360 \
	  -o $(srcdir)/doc/gallery/letters-pairs.png
	./zeroset render $(srcdir)/scenes/morph.xml --object surface --view side --size 480x360 \
	  -o $(srcdir)/doc/gallery/morph-surface.png
	./zeroset render $(srcdir)/scenes/stack.xml --object straight --view side --size 480x360 \
	  -o $(srcdir)/doc/gallery/stack-straight.png
	./zeroset slice $(srcdir)/scenes/stack.xml --z 18 --correspondence --size 480x360 \
	  -o $(srcdir)/doc/gallery/stack-ways.png
	./zeroset slice $(srcdir)/scenes/spanner.xml --z 0 --size 480x360 \
	  -o $(srcdir)/doc/gallery/spanner-slice.png
	./zeroset render $(srcdir)/scenes/warp.xml --object plain --size 480x360 \
	  -o $(srcdir)/doc/gallery/warp-plain.png
.PHONY: gallery
