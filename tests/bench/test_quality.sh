# The scores of stacks: measures against closed forms, tables, and what is left out.
. "$top_srcdir/tests/program/cases.sh"
python=${BENCH_PYTHON:-/usr/bin/python3}
begin "$python"
cd "$scratch" || exit 99

quality=$top_srcdir/tests/bench/quality.py
export PYTHONDONTWRITEBYTECODE=1

skipped_without_data() {
  "$python" "$quality" "$ZEROSET" "$scratch/nowhere" >table
  grep -q '^skipped: ' table || complain "what is missing is not said"
}

# Areas, lengths, backtracks and numbers of parts of discs and rings.
measures_are_right() {
  PYTHONPATH=$top_srcdir/tests/bench "$python" - <<'END'
import math
import numpy as np
import quality
y, x = np.mgrid[0:60, 0:60]
disc = lambda r, cx=30.2, cy=29.7: r - np.hypot(x - cx, y - cy)
ring = np.minimum(disc(20), -disc(8))
area, length = quality.outline_measures(ring)
assert abs(area / (math.pi * (400 - 64)) - 1) < 0.01, area
assert abs(length / (2 * math.pi * 28) - 1) < 0.01, length
assert quality.parts_and_holes(ring) == (1, 1)
assert quality.parts_and_holes(np.maximum(disc(5, 10, 10), disc(5, 45, 45))) == (2, 0)
assert quality.outline_measures(disc(-1)) == (0, 0)
checks = np.where((x + y) % 2, 1.0, -1.0) # each pixel crosses at saddles
assert quality.outline_measures(checks)[0] > 0
assert quality.backtrack([4, 6, 5, 10]) == 10 and quality.backtrack([10, 8, 1]) == 0
frames = [disc(5 + 0.5 * t) for t in range(20)]
assert quality.score_pair(frames) == (0, 0, 0, 0), quality.score_pair(frames)
assert quality.score_pair(frames + [disc(-1), disc(3)])[2:] == (2, 1)
z, y, x = np.mgrid[0:41, 0:41, 0:41]
ball = 15 - np.sqrt((x - 20) ** 2 + (y - 20) ** 2 + (z - 20.0) ** 2)
kept = range(0, 41, 4)
assert quality.score_volume(ball > 0, ball > 0, (1, 1, 1), kept) == (1, 0, 0)
grown = ball + np.where(z % 4, 2, 0) # a shell of 2 too much between the slices
dice, hd95, wrong = quality.score_volume(ball > 0, grown > 0, (1, 1, 1), kept)
assert 0.75 < dice < 0.95 and 1.4 < hd95 < 4 and wrong == 0, (dice, hd95, wrong)
median, excess = quality.score_jumps(ball, kept, (1, 1, 1))
assert median < 6 and abs(excess) < 2, (median, excess)
creased = ball - z % 8 * (8 - z % 8) / 4 # as discs that shrink away from their slices
assert quality.score_jumps(creased, range(0, 41, 8), (1, 1, 1))[1] > 20
END
}

# A ball and a pair of discs, beside a table of peers.
tables_are_printed() {
  mkdir -p data/volumes data/shapes2d
  "$python" - <<'END'
import numpy as np
z, y, x = np.mgrid[0:25, 0:26, 0:27]
ball = (x - 13.2) ** 2 + (y - 12.7) ** 2 + (1.5 * (z - 12.1)) ** 2 <= 100
with open("data/volumes/ball.nrrd", "wb") as stream:
    stream.write(b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 27 26 25\nspacings: 2 2 3\n"
                 b"encoding: raw\n\n" + ball.astype("u1").tobytes())
from PIL import Image
y, x = np.mgrid[0:32, 0:32]
for name, cx, r in ("left", 8, 5), ("right", 23, 7):
    f = np.clip(0.5 + r - np.hypot(x - cx, y - 16), 0, 1)
    Image.fromarray((255 * f).astype("u1")).save(f"data/shapes2d/{name}.png")
END
  cat >data/peer-scores.md <<'END'
## dice (missing slices)

| object | k | one | two |
|---|---|---|---|
| ball | 4 | 0.5 | **0.75** |
| **mean** | 4 | 0.5 | 0.75 |

## 2D morphs per pair: area

| pair | one |
|---|---|
| left>right | 3/4 |
END
  "$python" "$quality" "$ZEROSET" data --every 4 >table
  grep -q '^| ball | 4 | 0\.9[6-9].* | 0.75 | .* | - | 0 | ' table || complain "$(cat table)"
  grep -q '^| mean of 1 | 4 | 0\.9[6-9].* | 0.75 | ' table || complain "$(cat table)"
  grep -q '^| left>right | .* / 0 | .* / 0 | .* | 3/4 |$' table || complain "$(cat table)"
}

run_case "no folder is a message" skipped_without_data
"$python" -c 'import numpy, scipy, PIL' 2>/dev/null || finish
run_case "measures agree with closed forms" measures_are_right
run_case "tables have ours and the peers' scores" tables_are_printed
finish
