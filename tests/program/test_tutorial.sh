# doc/tutorial-stack.md: its scenes are saved and its commands run as it says.
. "$top_srcdir/tests/program/cases.sh"
begin

tutorial="$top_srcdir/doc/tutorial-stack.md"

# Blocks in order: files NN-xml and NN-sh.  A scene is saved when it is named, before or after.
take_blocks() {
  awk -v folder="$scratch" '
    /^```/ {
      if (within) { close(file); within = 0 }
      else { file = sprintf("%s/%02d-%s", folder, ++count, substr($0, 4)); within = 1
             printf "" > file }
      next
    }
    within { print > file }' "$tutorial"
}

names=$(grep -o '`roots/[a-z]*\.xml`' "$tutorial" | tr -d '`')

save_scenes() {
  mkdir -p "$1/roots"
  local blocks=("$scratch"/*-xml) i=0
  for name in $names; do
    cp "${blocks[$i]}" "$1/$name" || return 1
    i=$((i + 1))
  done
  [ "$i" -eq "${#blocks[@]}" ] || complain "${#blocks[@]} scenes and $i names"
}

# In a folder with the slices; `zeroset` is the one under test.
run_block() {
  { echo 'zeroset() { "$ZEROSET" "$@"; }'; cat "$1"; } >"$scratch/script"
  (cd "$work" && bash -e "$scratch/script") >"$scratch/output" 2>&1 ||
    complain "$(cat "$scratch/output")"
}

take_blocks
work="$scratch/work"
mkdir -p "$work/scenes/stack"
cp "$top_srcdir"/scenes/stack/root?.png "$work/scenes/stack/"
run_case "every scene has a name" save_scenes "$scratch/saved"
first=yes
for block in "$scratch"/*-sh; do
  run_case "the commands of $(basename "$block") run" run_block "$block"
  [ "$first" = no ] || cp "$scratch"/saved/roots/*.xml "$work/roots/"
  first=no
done

exists() {
  for file in "$@"; do
    [ -s "$work/roots/$file" ] || complain "$file was not made"
  done
}
run_case "everything is made" exists roots.png roots.stl smooth.png straight.png half.png \
  pairs0.ply pairs2.ply frame00.png frame06.png
finish
