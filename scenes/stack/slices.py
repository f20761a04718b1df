#!/usr/bin/env python3
"""Writes the slices of stack.xml: a trunk that parts into roots, 64 x 64 grey pixels each, soft
along the outlines, as PNG files.  Usage: slices.py FOLDER"""
import math
import struct
import sys
import zlib

SIDE, SLICES, ROOTS = 64, 7, 5


def depth(x, y, height):
    """How deep a point lies in the solid, about, for a height from 0 (roots) to 1 (trunk)."""
    spread = 24 * (1 - height) ** 1.5
    best = 9 * height ** 0.5 - math.hypot(x, y) if height > 0.3 else -SIDE
    for k in range(ROOTS):
        angle = 2 * math.pi * k / ROOTS + 1.2 * height
        width = 4.5 + math.sin(3 * k)
        best = max(best, width - math.hypot(x - spread * math.cos(angle),
                                            y - spread * math.sin(angle)))
    return best


def png(rows):
    def chunk(kind, data):
        check = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + check

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    body = b"".join(b"\0" + bytes(row) for row in rows)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(body, 9)) +
            chunk(b"IEND", b""))


for index in range(SLICES):
    height = index / (SLICES - 1)
    rows = [[round(255 * min(max(0.5 + depth(i + 0.5 - SIDE / 2, SIDE / 2 - 0.5 - j, height), 0), 1))
             for i in range(SIDE)] for j in range(SIDE)]
    with open(f"{sys.argv[1]}/root{index}.png", "wb") as file:
        file.write(png(rows))
