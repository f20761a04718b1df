#!/usr/bin/env python3
"""Score how well <stack> rebuilds slices that it was not given, and how shapes become each other.

Usage: quality.py ZEROSET FOLDER [--only NAME ...] [--every K ...] [--method NAME]
       quality.py ZEROSET FOLDER --large NAME

The FOLDER may hold
  volumes/NAME.nrrd    label volumes (uint8): of every k-th slice the solid is made, and the others
                       are compared with what it has there;
  shapes2d/NAME.png    grey pictures, of which pairs become each other;
  peer-scores.md       tables of what other methods score, printed beside ours; the pairs too.

Volumes, over the missing slices between the first and the last given one that is not empty:
  dice   twice the common pixels by the sum of both
  hd95   95th percentile of the distances from either surface to the other, in pixels of a slice
  wrong  pixels of given slices that are on the wrong side
  jump   degrees between normals just below and just above given slices: median, and mean less
         the same half-way between them, which is what curvature alone does
Pairs, over 33 frames:
  area, perimeter   per cent that they go back on their way from one shape to the other
  topology          changes of the numbers of parts and holes;  empty: frames without the shape

With --large no quality but time is measured: of the middle 16, 32 and 64 of 64 slices of 512 x 512
pixels, which the volume NAME becomes, the program makes an STL file.
  seconds   by the clock, and the processors' together
  growth    the latter by that of the row above, which has half as many gaps
  peak      the most memory in use, in MB
"""
import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
    from scipy import ndimage
except ImportError as missing:
    print(f"skipped: {missing}; it needs python3-numpy and python3-scipy")
    sys.exit(0)

FRAMES = 33


# ---- Files -----------------------------------------------------------------------------------

TYPES = {"uint8": "u1", "unsigned char": "u1", "uchar": "u1", "float": "<f4"}


def read_nrrd(path):
    """Numbers by z, y, x, and the spacing along x, y, z; None for types but bytes and floats."""
    import gzip
    with open(path, "rb") as stream:
        header, data = stream.read().split(b"\n\n", 1)
    lines = header.decode("latin1").splitlines()
    fields = dict(line.split(": ", 1) for line in lines if ": " in line)
    if fields["type"] not in TYPES:
        return None
    if fields["encoding"] in ("gzip", "gz"):
        data = gzip.decompress(data)
    size = [int(n) for n in fields["sizes"].split()]
    if "space directions" in fields:
        axes = re.findall(r"\(([^)]*)\)", fields["space directions"])
        spacing = [np.linalg.norm([float(v) for v in axis.split(",")]) for axis in axes]
    else:
        spacing = [float(s) for s in fields.get("spacings", "1 1 1").split()]
    count = size[0] * size[1] * size[2]
    return np.frombuffer(data, TYPES[fields["type"]], count).reshape(size[::-1]), spacing


def write_labels(path, labels, spacing):
    """A volume whose first sample is at the origin."""
    sizes = " ".join(str(n) for n in labels.shape[::-1])
    spacings = " ".join(repr(float(s)) for s in spacing)
    with open(path, "wb") as stream:
        stream.write(f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\n"
                     f"spacings: {spacings}\nencoding: raw\n\n".encode())
        stream.write(np.ascontiguousarray(labels, "u1").tobytes())


class Program:
    """Runs zeroset in a folder of its own."""

    def __init__(self, path):
        self.path = os.path.abspath(path)
        self.folder = tempfile.mkdtemp(prefix="quality-")

    def close(self):
        shutil.rmtree(self.folder)

    def values(self, body, size, spacing):
        """f at samples i * spacing of a scene, by z, y, x."""
        lo = [-spacing[k] / 2 for k in range(3)]
        hi = [(size[k] - 0.5) * spacing[k] for k in range(3)]
        with open(os.path.join(self.folder, "scene.xml"), "w") as stream:
            stream.write(f"<scene>{body}</scene>")
        subprocess.run(
            [self.path, "voxel", "scene.xml", "-o", "field.nrrd", "--quantity", "value", "--quiet",
             "--cell", " ".join(repr(float(s)) for s in spacing),
             "--bounds", " ".join(repr(float(b)) for b in lo + hi)],
            cwd=self.folder, check=True)
        field, _ = read_nrrd(os.path.join(self.folder, "field.nrrd"))
        if field.shape != tuple(size[::-1]):
            sys.exit(f"quality.py: {field.shape} samples, not {tuple(size[::-1])}")
        return field


# ---- Peers -----------------------------------------------------------------------------------

def read_tables(path):
    """Tables of a Markdown file by the headings above them: rows of cells, the first one names."""
    tables, title = {}, ""
    if not os.path.exists(path):
        return tables
    with open(path) as stream:
        for line in stream:
            if line.startswith("## "):
                title = line[3:].strip()
            elif line.startswith("|") and not line.startswith("|---"):
                cells = [cell.strip().strip("*") for cell in line.strip().strip("|").split("|")]
                tables.setdefault(title, []).append(cells)
    return tables


def peer_table(tables, beginning):
    for title, rows in tables.items():
        if title.startswith(beginning):
            return rows
    return [[]]


# ---- Volumes ---------------------------------------------------------------------------------

def surface(solid):
    return solid & ~ndimage.binary_erosion(solid, border_value=1)


def score_volume(truth, built, spacing, kept):
    """Dice, HD95 in pixels, and pixels of kept slices on the wrong side."""
    filled = [z for z in kept if truth[z].any()]
    range_ = np.zeros(len(truth), bool)
    range_[filled[0] + 1:filled[-1]] = True
    missing = range_.copy()
    missing[list(kept)] = False
    a, b = truth[missing], built[missing]
    dice = 2 * (a & b).sum() / max(1, a.sum() + b.sum())
    where = np.argwhere(truth | built)
    box = tuple(slice(lo, hi) for lo, hi in zip(where.min(0), where.max(0) + 1))
    sa, sb = surface(truth)[box], surface(built)[box]
    inner = range_[box[0]][:, None, None]
    sampling = spacing[::-1]
    both = np.concatenate([ndimage.distance_transform_edt(~sa, sampling)[sb & inner],
                           ndimage.distance_transform_edt(~sb, sampling)[sa & inner]])
    hd95 = np.percentile(both, 95) / spacing[0] if len(both) else np.nan
    return dice, hd95, int((truth[list(kept)] ^ built[list(kept)]).sum())


def jumps(field, z, spacing):
    """Degrees between the normals below and above a slice, at the pixels along its outline."""
    f = field[z]
    inside = f > 0
    edge = np.zeros(f.shape, bool)
    edge[:-1] |= inside[:-1] != inside[1:]
    edge[:, :-1] |= inside[:, :-1] != inside[:, 1:]
    edge[[0, -1]] = edge[:, [0, -1]] = False
    gy, gx = np.gradient(f)
    across = np.hypot(gx / spacing[0], gy / spacing[1])[edge]
    below = ((f - field[z - 1]) / spacing[2])[edge]
    above = ((field[z + 1] - f) / spacing[2])[edge]
    good = across > 1e-9
    return np.degrees(np.abs(np.arctan2(above, across) - np.arctan2(below, across)))[good]


def score_jumps(field, kept, spacing):
    """The median at given slices, and the mean there less the mean half-way between them."""
    filled = [z for z in kept if (field[z] > 0).any()]
    half = (kept[1] - kept[0]) // 2
    given = [jumps(field, z, spacing) for z in filled[1:-1]]
    between = [jumps(field, z + half, spacing) for z in filled[:-1] if z + half + 1 < len(field)]
    if not given or not between:
        return np.nan, np.nan
    given, between = np.concatenate(given), np.concatenate(between)
    return np.median(given), given.mean() - between.mean()


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return None


def best_peer(rows, name, every, choose):
    """The best number of a row of peers, as text; "-" when there is none."""
    for row in rows[1:]:
        if row[:2] == [name, str(every)]:
            numbers = [number(cell.strip("*")) for cell in row[2:]]
            numbers = [n for n in numbers if n is not None]
            return f"{choose(numbers):g}" if numbers else "-"
    return "-"


def run_volumes(program, folder, tables, options):
    dice_rows, hd95_rows = peer_table(tables, "dice"), peer_table(tables, "hd95")
    names = sorted(name[:-5] for name in os.listdir(folder) if name.endswith(".nrrd"))
    scores = {every: [] for every in options.every}
    print("| object | k | dice | best peer's | hd95 | best peer's | wrong | jump | excess "
          "| seconds |\n" + "|---" * 10 + "|")
    for every in options.every:
        for name in names:
            read = read_nrrd(os.path.join(folder, name + ".nrrd"))
            if (options.only and name not in options.only) or not read or read[0].dtype != np.uint8:
                continue
            truth, spacing = read[0] > 0, read[1]
            kept = range(0, len(truth), every)
            if sum(truth[z].any() for z in kept) < 2:
                continue
            write_labels(os.path.join(program.folder, "labels.nrrd"), truth, spacing)
            begun = time.time()
            field = program.values(f'<stack src="labels.nrrd" every="{every}" '
                                   f'method="{options.method}"/>', truth.shape[::-1], spacing)
            seconds = time.time() - begun
            dice, hd95, wrong = score_volume(truth, field >= 0, spacing, kept)
            median, excess = score_jumps(field, kept, spacing)
            peers = [best_peer(dice_rows, name, every, max), best_peer(hd95_rows, name, every, min)]
            print(f"| {name} | {every} | {dice:.4f} | {peers[0]} | {hd95:.2f} | {peers[1]} | "
                  f"{wrong} | {median:.1f} | {excess:.1f} | {seconds:.1f} |", flush=True)
            if peers[0] != "-" or len(dice_rows) < 2:
                scores[every].append((dice, hd95, wrong, median, excess, seconds))
    for every, rows in scores.items():
        if rows:
            mean = np.mean(rows, axis=0)
            peers = [best_peer(dice_rows, "mean", every, max),
                     best_peer(hd95_rows, "mean", every, min)]
            print(f"| mean of {len(rows)} | {every} | {mean[0]:.4f} | {peers[0]} | {mean[1]:.2f} | "
                  f"{peers[1]} | {mean[2]:g} | {np.median(rows, axis=0)[3]:.1f} | "
                  f"{np.median(rows, axis=0)[4]:.1f} | {mean[5]:.1f} |")
    print("\nMeans are over the objects that the peers have; of jump and excess, medians.\n")


# ---- Large stacks ----------------------------------------------------------------------------

LARGE = 64, 512, 512


def enlarge(labels):
    """The solid at other samples of the same box, its surface between samples by linear values."""
    axes = [(np.arange(n) + 0.5) * m / n - 0.5 for n, m in zip(LARGE, labels.shape)]
    solid = labels.astype("f4")
    large = np.empty(LARGE, bool)
    for k, z in enumerate(axes[0]):
        grid = np.meshgrid([z], axes[1], axes[2], indexing="ij")
        large[k] = ndimage.map_coordinates(solid, grid, order=1, mode="nearest")[0] >= 0.5
    return large


def run_large(program, folder, name):
    labels, spacing = read_nrrd(os.path.join(folder, name + ".nrrd"))
    spacing = [spacing[k] * labels.shape[2 - k] / LARGE[2 - k] for k in range(3)]
    large, before = enlarge(labels > 0), None
    print("| slices | seconds | processors | growth | peak MB |\n" + "|---" * 5 + "|")
    with open(os.path.join(program.folder, "scene.xml"), "w") as stream:
        stream.write('<scene><stack src="labels.nrrd"/></scene>')
    for count in (16, 32, 64):
        first = (LARGE[0] - count) // 2
        write_labels(os.path.join(program.folder, "labels.nrrd"), large[first:first + count], spacing)
        begun, used = time.time(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([program.path, "mesh", "scene.xml", "-o", "solid.stl", "--quiet"],
                       cwd=program.folder, check=True)
        seconds, now = time.time() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
        processors = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
        growth = f"{processors / before:.2f}" if before else ""
        print(f"| {count} | {seconds:.1f} | {processors:.1f} | {growth} | "
              f"{now.ru_maxrss / 1024:.0f} |", flush=True)
        before = processors


# ---- Pairs -----------------------------------------------------------------------------------

def outline_measures(f):
    """Area and length of f = 0 by marching squares, straight within each cell."""
    f = np.pad(f, 1, constant_values=min(f.min(), -0.5))
    f = np.where(f == 0, 1e-9, f)
    corners = [f[:-1, :-1], f[:-1, 1:], f[1:, 1:], f[1:, :-1]]
    places = [(0, 0), (0, 1), (1, 1), (1, 0)]
    inside = [c > 0 for c in corners]
    middle = sum(corners) / 4 > 0
    area = length = 0.0
    # Around each cell an edge is crossed into or out of the solid; each way in is joined with the
    # next way out, or the one before where the middle says that the two parts are apart.
    points, ways = [], []
    for k in range(4):
        a, b = corners[k], corners[(k + 1) % 4]
        t = a / np.where(inside[k] != inside[(k + 1) % 4], a - b, np.inf)
        y = places[k][0] + t * (places[(k + 1) % 4][0] - places[k][0])
        x = places[k][1] + t * (places[(k + 1) % 4][1] - places[k][1])
        points.append((x, y))
        ways.append(inside[k].astype(int) - inside[(k + 1) % 4])
    saddle = (inside[0] == inside[2]) & (inside[1] == inside[3]) & (inside[0] != inside[1])
    for k in range(4):
        for step in (1, 2, 3):
            out, back = ways[k] > 0, ways[(k + step) % 4] < 0
            joined = out & back & np.where(saddle, (step == 1) == middle, True)
            if step == 2:
                joined &= ~saddle
            (xa, ya), (xb, yb) = points[k], points[(k + step) % 4]
            length += np.hypot(xb - xa, yb - ya)[joined].sum()
            rows, columns = np.nonzero(joined)
            ax, ay = xa[joined] + columns, ya[joined] + rows
            bx, by = xb[joined] + columns, yb[joined] + rows
            area += (ax * by - ay * bx).sum() / 2
    return abs(area), length


def backtrack(series):
    """Per cent of the larger end that a series goes back on its way."""
    series = np.asarray(series)
    way = np.sign(series[-1] - series[0]) or 1
    return 100 * np.maximum(-np.diff(series) * way, 0).sum() / max(series[0], series[-1], 1e-9)


def parts_and_holes(f):
    parts = ndimage.label(f > 0, np.ones((3, 3)))[1]
    return parts, ndimage.label(np.pad(f <= 0, 1, constant_values=True))[1] - 1


def score_pair(frames):
    measures = [outline_measures(f) for f in frames]
    topology = [parts_and_holes(f) for f in frames]
    return (backtrack([m[0] for m in measures]), backtrack([m[1] for m in measures]),
            sum(a != b for a, b in zip(topology, topology[1:])), sum(m[0] < 4 for m in measures))


def pair_bodies(a, b):
    """Scenes of a pair, by the column they stand in."""
    levels = [f'<level at="{at}"><image src="{name}" y="down" origin="-0.5 -0.5 0"/></level>'
              for at, name in ((0, a), (FRAMES - 1, b))]
    return {
        "stack": f'<stack src="pair*.png" spacing="{FRAMES - 1}" y="down" origin="-0.5 -0.5 0" '
                 f'caps="open"/>',
        "interpolate auto": f'<interpolate caps="open">{levels[0]}<between correspondence="auto"/>'
                            f'{levels[1]}</interpolate>',
        "interpolate linear": f'<interpolate caps="open">{"".join(levels)}</interpolate>'}


def run_pairs(program, folder, tables, options):
    try:
        from PIL import Image
    except ImportError as missing:
        print(f"pairs are skipped: {missing}; they need python3-pil")
        return
    rows = peer_table(tables, "2D morphs per pair")
    pairs = [row[0].split(">") for row in rows[1:] if ">" in row[0]]
    if not pairs:  # no table: neighbours by name
        names = sorted(name[:-4] for name in os.listdir(folder) if name.endswith(".png"))
        pairs = list(zip(names[::2], names[1::2]))
    columns = list(pair_bodies("", ""))
    print("area / perimeter / topology / empty")
    print("| pair | " + " | ".join(columns + [f"peer {name}" for name in rows[0][1:]]) + " |")
    print("|---" * (1 + len(columns) + len(rows[0][1:])) + "|")
    scores = {column: [] for column in columns}
    for a, b in pairs:
        name = f"{a}>{b}"
        if options.only and name not in options.only:
            continue
        pictures = []
        for i, shape in enumerate((a, b)):
            path = os.path.join(folder, shape + ".png")
            shutil.copy(path, os.path.join(program.folder, f"pair{i}.png"))
            pictures.append(Image.open(path).size)
        cells = []
        for column, body in pair_bodies("pair0.png", "pair1.png").items():
            if pictures[0] != pictures[1]:
                cells.append("-")
                continue
            frames = program.values(f'<domain min="-9 -9 -9" max="999 999 99"/>{body}',
                                    (*pictures[0], FRAMES), (1, 1, 1))
            score = score_pair(frames)
            scores[column].append(score)
            cells.append("{:.1f} / {:.1f} / {} / {}".format(*score))
        others = next((row[1:] for row in rows[1:] if row[0] == name), [])
        print(f"| {name} | " + " | ".join(cells + others) + " |", flush=True)
    cells = ["{:.1f} / {:.1f} / {:g} / {:g}".format(*np.median(s, axis=0)) if s else "-"
             for s in scores.values()]
    print("| median | " + " | ".join(cells) + " |" + " |" * len(rows[0][1:]))
    print("\nPeers: area / perimeter / sharp turns midway (at the ends) / topology / empty\n")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--every", nargs="*", type=int, default=[4, 8, 16])
    parser.add_argument("--method", default="auto")
    parser.add_argument("--large")
    options = parser.parse_args()
    if not options.folder or not os.path.isdir(options.folder):
        print("skipped: ZEROSET_QUALITY_DATA names no folder of volumes and shapes")
        return
    tables = read_tables(os.path.join(options.folder, "peer-scores.md"))
    program = Program(options.program)
    try:
        if options.large:
            run_large(program, os.path.join(options.folder, "volumes"), options.large)
            return
        for name, run in (("volumes", run_volumes), ("shapes2d", run_pairs)):
            folder = os.path.join(options.folder, name)
            if os.path.isdir(folder):
                run(program, folder, tables, options)
    finally:
        program.close()


if __name__ == "__main__":
    main()
