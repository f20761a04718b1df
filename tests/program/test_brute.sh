# Pruning is an optimisation: with --brute, which evaluates the whole program at every sample, the
# files are the same.  Variational fields are found within their accuracy: a sample that lies on the
# surface to a millionth may be on the other side of it.
. "$top_srcdir/tests/program/cases.sh"
begin cmp

same() {
  local name=$1
  shift
  "$@" -o "$scratch/pruned.$name"
  "$@" --brute -o "$scratch/brute.$name"
  cmp "$scratch/pruned.$name" "$scratch/brute.$name"
}

nearly_same() {
  local most=3
  same "$@" || [ "$(cmp -l "$scratch/pruned.$1" "$scratch/brute.$1" | wc -l)" -le $most ]
}

for scene in "$top_srcdir"/scenes/*.xml; do
  name=$(basename "$scene" .xml)
  fitted=no
  ! grep -q '<variational' "$scene" || fitted=yes
  alike=same
  [ $fitted = no ] || alike=nearly_same
  run_case "$name: occupancy" $alike inside.raw "$ZEROSET" voxel "$scene" --resolution 48 \
    --quantity inside --type u8
  # A run with fits begins with making them, which takes longer than all else here.
  [ $fitted = no ] || continue
  run_case "$name: slice" same cut.png "$ZEROSET" slice "$scene" --axis y --at 0 --size 192x192 \
    --quantity inside
done
finish
