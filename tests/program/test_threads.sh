# The number of threads changes the time a job takes and nothing else.
. "$top_srcdir/tests/program/cases.sh"
begin cmp

# same NAME COMMAND...: the command with 1 and 3 threads writes the same $scratch/NAME.
same() {
  local name=$1 threads
  shift
  for threads in 1 3; do
    "$@" --threads "$threads" -o "$scratch/$threads.$name"
  done
  cmp "$scratch/1.$name" "$scratch/3.$name"
}

for scene in "$top_srcdir"/scenes/*.xml; do
  name=$(basename "$scene" .xml)
  run_case "$name: mesh" same mesh.ply "$ZEROSET" mesh "$scene" --resolution 48
  # A run with fits begins with making them, which takes longer than all else here.
  ! grep -q '<variational' "$scene" || continue
  run_case "$name: values" same value.raw "$ZEROSET" voxel "$scene" --resolution 40
  run_case "$name: occupancy" same inside.raw "$ZEROSET" voxel "$scene" --resolution 40 \
    --quantity inside --type u8
  run_case "$name: picture" same view.png "$ZEROSET" render "$scene" --size 160x120
  run_case "$name: slice" same cut.png "$ZEROSET" slice "$scene" --axis x --at 0 --size 160x160
done
finish
