EXTRA_PROGRAMS = tests/bench/bench
tests_bench_bench_SOURCES = tests/bench/bench.c tests/random.h

# BENCH names some of the workloads: make bench BENCH="spheres gear"
bench: tests/bench/bench
	ZEROSET_BENCH_DATA="$${ZEROSET_BENCH_DATA:-$(srcdir)/tests/bench}" tests/bench/bench $(BENCH)
.PHONY: bench
