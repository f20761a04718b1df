#!/usr/bin/env python3
"""Writes muscle.xml: part of a muscle cell, after Parulek and Sramek (2007).  Thick myofibrils
stand side by side, and hundreds of blobs on parallel planes around them are the cross-sections of
the reticulum that wraps them; which blob goes to which is not said.  Usage: cell.py > muscle.xml"""
import math
import random

PLANES, SPACING = 7, 1.4
FIBRIL, APART = 2.0, 5.8          # radius of a myofibril, and from axis to axis
TUBE, AROUND = 0.48, 8            # radius of a tube, and how many go up around a myofibril

random.seed(4)
centres = [(0.0, 0.0)] + [(APART * math.cos(k * math.pi / 3), APART * math.sin(k * math.pi / 3))
                          for k in range(6)]


def blobs(plane):
    """Centres and radii on a plane.  Tubes go up about their myofibril, and on every other plane
    each meets one of its neighbours, first the one and then the other: they are a net."""
    for fibril, (x, y) in enumerate(centres):
        for k in range(AROUND):
            toward = (1 if k % 2 == 0 else -1) * (0, 1, 0, -1)[plane % 4]
            angle = 2 * math.pi / AROUND * (k + 0.3 * fibril + 0.34 * toward)
            angle += random.uniform(-0.05, 0.05)
            distance = FIBRIL + 0.35 + random.uniform(-0.04, 0.04)
            yield (x + distance * math.cos(angle), y + distance * math.sin(angle),
                   TUBE * random.uniform(0.85, 1.15))


count = 0
print(f"""<?xml version="1.0" encoding="UTF-8"?>
<!-- Part of a muscle cell: myofibrils, and the reticulum around them from blobs on {PLANES} planes,
     which find each other.  Written by muscle/cell.py. -->
<scene xmlns="urn:zeroset:scene:1" units="um" main="cell">
  <object id="reticulum">
    <interpolate caps="round" continuity="c1">""")
for plane in range(PLANES):
    if plane:
        print('      <between correspondence="auto"/>')
    print(f'      <level at="{plane * SPACING:g}">')
    for x, y, r in blobs(plane):
        print(f'        <circle radius="{r:.3f}" at="{x:.3f} {y:.3f} 0"/>')
        count += 1
    print("      </level>")
print(f"""    </interpolate>
  </object>

  <object id="fibrils">
    <union>""")
for x, y in centres:
    print(f'      <cylinder radius="{FIBRIL}" height="{(PLANES + 1) * SPACING:g}" '
          f'at="{x:.3f} {y:.3f} {(PLANES - 1) * SPACING / 2:g}"/>')
print(f"""      <cylinder radius="9.5" height="1.2" at="0 0 -1.8"/> <!-- where they are held together -->
    </union>
  </object>

  <object id="cell">
    <smooth-union radius="0.25"><use object="fibrils"/><use object="reticulum"/></smooth-union>
  </object>

  <view id="side" eye="-24 -34 30" target="0 0 3.4" up="0 0 1" fov="27"/>
</scene>""")
