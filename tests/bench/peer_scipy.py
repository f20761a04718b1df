#!/usr/bin/env python3
"""Time how long SciPy takes to fit radial functions to points.

Usage: peer_scipy.py FILE COUNT KERNEL

The FILE holds COUNT points of three doubles, then COUNT values.  One line is printed: "scipy" and
the median of up to five times in seconds of the clock.
"""
import statistics
import sys
import time

REPEATS = 5
BUDGET = 3.0  # seconds


def main(path, count, kernel):
    import numpy
    from scipy.interpolate import RBFInterpolator

    numbers = numpy.fromfile(path)
    points, values = numbers[: 3 * count].reshape(count, 3), numbers[3 * count :]
    times = []
    while len(times) < REPEATS and sum(times) < BUDGET:
        begun = time.perf_counter()
        RBFInterpolator(points, values, kernel=kernel)
        times.append(time.perf_counter() - begun)
    print("scipy", statistics.median(times))


main(sys.argv[1], int(sys.argv[2]), sys.argv[3])
