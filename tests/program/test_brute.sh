# Pruning is an optimisation: with --brute, which evaluates the whole program at every sample, the
# files are the same.
. "$top_srcdir/tests/program/cases.sh"
begin cmp

same() {
  local name=$1
  shift
  "$@" -o "$scratch/pruned.$name"
  "$@" --brute -o "$scratch/brute.$name"
  cmp "$scratch/pruned.$name" "$scratch/brute.$name"
}

for scene in "$top_srcdir"/scenes/*.xml; do
  name=$(basename "$scene" .xml)
  run_case "$name: occupancy" same inside.raw "$ZEROSET" voxel "$scene" --resolution 48 \
    --quantity inside --type u8
  # A run of the bunny begins with a fit, which takes longer than all else here.
  [ "$name" != bunny ] || continue
  run_case "$name: slice" same cut.png "$ZEROSET" slice "$scene" --axis y --at 0 --size 192x192 \
    --quantity inside
done
finish
