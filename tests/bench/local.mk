# This room adds to the lists that Makefile.am describes.
check_PROGRAMS += tests/bench/bench
tests_bench_bench_SOURCES = \
  tests/bench/against_c.c \
  tests/bench/bench.c \
  tests/bench/bench.h \
  tests/bench/fits.c \
  tests/bench/handwritten.h \
  tests/bench/jobs.c \
  tests/bench/jobs.h \
  tests/bench/loading.c \
  tests/bench/measure.c \
  tests/bench/memory.c \
  tests/bench/peers.c \
  tests/bench/pictures.c \
  tests/bench/scalar.c \
  tests/bench/scenes.c \
  tests/bench/scenes.h \
  tests/bench/sums.c \
  tests/bench/sums.h \
  tests/bench/vm.c \
  tests/bench/workloads.c \
  tests/files/scratch.h \
  tests/random.h
tests_bench_bench_LDADD = tests/bench/libhandwritten.a $(LDADD)

# What the kernel is compared with is built for this machine alone.
check_LIBRARIES = tests/bench/libhandwritten.a
tests_bench_libhandwritten_a_SOURCES = \
  tests/bench/handwritten.h \
  tests/bench/handwritten_column.c \
  tests/bench/handwritten_gyroid.c \
  tests/bench/handwritten_spheres.c \
  tests/bench/scenes.h
tests_bench_libhandwritten_a_CFLAGS = $(AM_CFLAGS) $(ZS_NATIVE_CFLAGS)

# The peer that needs its own program is built where its library is.
EXTRA_PROGRAMS =
if HAVE_GTS
EXTRA_PROGRAMS += tests/bench/peer_gts
tests_bench_peer_gts_SOURCES = tests/bench/peer_gts.c
tests_bench_peer_gts_CFLAGS = $(AM_CFLAGS) $(GTS_CFLAGS)
tests_bench_peer_gts_LDADD = $(GTS_LIBS)
bench_gts = tests/bench/peer_gts
endif
CLEANFILES += $(EXTRA_PROGRAMS)

EXTRA_DIST += tests/bench/peers.py tests/bench/peer_scipy.py tests/bench/quality.py
zs_test_scripts += tests/bench/test_bench.sh tests/bench/test_quality.sh

# BENCH names some of the rows: make bench BENCH="spheres gear"
bench: tests/bench/bench zeroset $(bench_gts)
	$(AM_TESTS_ENVIRONMENT) BENCH_GTS='$(bench_gts)'; export BENCH_GTS; \
	ZEROSET_BENCH_DATA="$${ZEROSET_BENCH_DATA:-$(srcdir)/tests/bench}"; export ZEROSET_BENCH_DATA; \
	tests/bench/bench $(BENCH)

# How well slices are rebuilt, by data that is not part of the project; QUALITY are options of
# quality.py: make bench-quality ZEROSET_QUALITY_DATA=folder QUALITY="--only femur --every 8"
bench-quality: zeroset
	"$${BENCH_PYTHON:-/usr/bin/python3}" $(srcdir)/tests/bench/quality.py ./zeroset \
	  "$(ZEROSET_QUALITY_DATA)" $(QUALITY)
.PHONY: bench bench-quality
