# Every scene in scenes/: the schemas accept it, and its mesh is closed, manifold and in one piece
# at coarse and fine resolutions, by the program's own report.
. "$top_srcdir/tests/program/cases.sh"
begin

check_mesh() {
  "$ZEROSET" mesh "$1" -o "$scratch/mesh.ply" --resolution "$2" --method "$3" --report json \
    >"$scratch/json"
  cat "$scratch/json"
  expect_field closed true "$scratch/json"
  expect_field manifold true "$scratch/json"
  expect_field components 1 "$scratch/json"
  [ -s "$scratch/mesh.ply" ] || complain "the mesh is empty"
}

# The first view is of the main object: rays meet it.
check_picture() {
  "$ZEROSET" render "$1" -o "$scratch/picture.png" --size 64x48 --report json >"$scratch/json"
  cat "$scratch/json"
  ! grep -q '"evaluations": 0,' "$scratch/json" || complain "the picture is empty"
}

check_scene() {
  "$ZEROSET" check "$1" >"$scratch/output" 2>&1
  [ ! -s "$scratch/output" ] || complain "$(cat "$scratch/output")"
}

check_schema() {
  "$XMLLINT" --noout --nonet "$1" "$top_srcdir/schema/$2" "$3"
}

count=0
for scene in "$top_srcdir"/scenes/*.xml; do
  name=$(basename "$scene" .xml)
  count=$((count + 1))
  run_case "$name has no warnings" check_scene "$scene"
  resolutions="16 64 128"
  # A run with fits begins with making them, which takes longer than all else here.
  if grep -q '<variational' "$scene"; then
    resolutions="16 128"
  else
    run_case "$name is seen by its first view" check_picture "$scene"
  fi
  for resolution in $resolutions; do
    run_case "$name is one closed manifold at $resolution" check_mesh "$scene" "$resolution" contour
  done
  run_case "$name is one closed manifold by features" check_mesh "$scene" 64 features
done
run_case "there are scenes" test "$count" -ge 6

if [ -n "${XMLLINT:-}" ]; then
  for scene in "$top_srcdir"/scenes/*.xml "$top_srcdir"/scenes/library/*.xml; do
    name=$(basename "$scene" .xml)
    run_case "$name is valid by RELAX NG" check_schema --relaxng zeroset.rng "$scene"
    run_case "$name is valid by XSD" check_schema --schema zeroset.xsd "$scene"
  done
fi
finish
