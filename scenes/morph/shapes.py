#!/usr/bin/env python3
"""Writes the shapes of morph.xml, warp.xml and influence.xml: points of closed surfaces with normals
out of the solid, and the rings of an O.  Usage: shapes.py FOLDER"""
import math
import sys


def cross(a, b):
    return [a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)]


def normalised(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def star(around, along):
    """A puffed star of five points."""
    def point(a, b):
        r = 1 + 0.36 * math.cos(5 * a)
        return [r * math.cos(a) * math.cos(b), r * math.sin(a) * math.cos(b), 0.42 * math.sin(b)]
    for j in range(along):
        b = math.pi * ((j + 0.5) / along - 0.5)
        count = max(5, round(around * math.cos(b)))
        for i in range(count):
            yield point, 2 * math.pi * (i + 0.5 * (j % 2)) / count, b


def torus(around, along):
    """A ring in the plane z = 0."""
    def point(a, b):
        r = 1 + 0.36 * math.cos(b)
        return [r * math.cos(a), r * math.sin(a), 0.36 * math.sin(b)]
    for i in range(around):
        for j in range(along):
            yield point, 2 * math.pi * (i + 0.5 * (j % 2)) / around, 2 * math.pi * j / along


def knot(around, along):
    """A tube about a trefoil."""
    def centre(a):
        r = 0.92 + 0.38 * math.cos(3 * a)
        return [r * math.cos(2 * a), r * math.sin(2 * a), 0.38 * math.sin(3 * a)]

    def point(a, b):
        h = 1e-5
        c = centre(a)
        tangent = normalised([p - q for p, q in zip(centre(a + h), centre(a - h))])
        side = normalised(cross(tangent, [0, 0, 1]))
        up = cross(side, tangent)
        return [c[k] + 0.2 * (math.cos(b) * side[k] + math.sin(b) * up[k]) for k in range(3)]
    for i in range(around):
        for j in range(along):
            yield point, 2 * math.pi * (i + 0.5 * (j % 2)) / around, 2 * math.pi * j / along


def hook(around, along, side):
    """A bent rod with round ends; `side` 1 or -1 is which way it is bent."""
    def centre(a):
        return [1.2 * math.sin(1.25 * a), side * (1.2 * math.cos(1.25 * a) - 0.75), 0.2 * side * a]

    def point(a, b):
        a = max(-1.0, min(1.0, a))
        h = 1e-5
        c = centre(a)
        tangent = normalised([p - q for p, q in zip(centre(a + h), centre(a - h))])
        across = normalised(cross(tangent, [0, 0, 1]))
        up = cross(across, tangent)
        return [c[k] + 0.26 * (math.cos(b) * across[k] + math.sin(b) * up[k]) for k in range(3)]

    def end(sign):
        h = 1e-5
        tip = centre(sign)
        out = normalised([sign * (p - q) for p, q in zip(centre(sign + h), centre(sign - h))])
        across = normalised(cross(out, [0, 0, 1]))
        up = cross(across, out)

        def ball(a, b):
            r = math.cos(a)
            return [tip[k] + 0.26 * (math.sin(a) * out[k] +
                                     r * (math.cos(b) * across[k] + math.sin(b) * up[k]))
                    for k in range(3)]
        return ball
    for i in range(along):
        for j in range(around):
            yield point, 1.9 * (i + 0.5) / along - 0.95, 2 * math.pi * (j + 0.5 * (i % 2)) / around
    for sign in (-1, 1):
        for a, count in ((0.3, around), (0.85, around * 2 // 3), (1.35, 4)):
            for j in range(count):
                yield end(sign), a, 2 * math.pi * (j + 0.5) / count


def write_rings(path, radii, count):
    with open(path, "w") as file:
        file.write("# x y, rings of an O, made by shapes.py\n")
        for radius in radii:
            for i in range(count):
                a = 2 * math.pi * i / count
                file.write(f"{radius * math.cos(a):.6f} {radius * math.sin(a):.6f}\n")
            file.write("\n")


def write(path, samples):
    h = 1e-4
    with open(path, "w") as file:
        file.write("# x y z nx ny nz, made by shapes.py\n")
        for point, a, b in samples:
            da = [p - q for p, q in zip(point(a + h, b), point(a - h, b))]
            db = [p - q for p, q in zip(point(a, b + h), point(a, b - h))]
            normal = normalised(cross(da, db))
            file.write(" ".join(f"{x:.4f}" for x in point(a, b) + normal) + "\n")


if __name__ == "__main__":
    folder = sys.argv[1]
    write(f"{folder}/star.xyz", star(44, 9))
    write(f"{folder}/torus.xyz", torus(28, 10))
    write(f"{folder}/knot.xyz", knot(60, 7))
    write(f"{folder}/hook-up.xyz", hook(9, 12, 1))
    write(f"{folder}/hook-down.xyz", hook(9, 12, -1))
    write_rings(f"{folder}/ring.txt", (5, 3), 64)
