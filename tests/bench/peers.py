#!/usr/bin/env python3
"""Time how long peers take to extract the surface of grids in memory, on one thread.

Usage: peers.py FILE NX NY NZ [FILE NX NY NZ ...]

A FILE holds NX * NY * NZ floats, x fastest.  For each peer that is installed and each grid one
line is printed: the peer, NX, the median of five times in seconds of the processor, the number of triangles.
"""
import os
import statistics
import sys
import time

os.environ["VTK_SMP_MAX_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"

REPEATS = 5
BUDGET = 2.0  # seconds for the runs of one grid


def median(extract):
    """The median time of five runs, or of fewer when those take too long; and the last result."""
    times = []
    while len(times) < REPEATS and sum(times) < BUDGET:
        begun = time.process_time()
        triangles = extract()
        times.append(time.process_time() - begun)
    return statistics.median(times), triangles


def vtk_peer():
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkSMPTools
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    vtkSMPTools.Initialize(1)

    def prepare(volume):
        image = vtkImageData()
        image.SetDimensions(volume.shape[::-1])
        image.GetPointData().SetScalars(numpy_to_vtk(volume.ravel()))
        edges = vtkFlyingEdges3D()
        edges.SetInputData(image)
        edges.SetValue(0, 0.0)
        edges.ComputeNormalsOn()
        edges.ComputeGradientsOff()
        edges.ComputeScalarsOff()

        def extract():
            edges.Modified()
            edges.Update()
            return edges.GetOutput().GetNumberOfPolys()

        return extract

    return prepare


def skimage_peer():
    from skimage.measure import marching_cubes

    def prepare(volume):
        return lambda: len(marching_cubes(volume, 0.0)[1])

    return prepare


def main():
    try:
        import numpy
    except ImportError:
        return
    grids = []
    for path, *counts in zip(*[iter(sys.argv[1:])] * 4):
        nx, ny, nz = map(int, counts)
        grids.append(numpy.fromfile(path, dtype=numpy.float32).reshape(nz, ny, nx))
    for name, load in (("vtk", vtk_peer), ("skimage", skimage_peer)):
        try:
            prepare = load()
        except ImportError:
            continue
        for volume in grids:
            seconds, triangles = median(prepare(volume))
            print(name, volume.shape[2], seconds, triangles, flush=True)


main()
