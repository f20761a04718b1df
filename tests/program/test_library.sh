# The library as others meet it: exported symbols, the header, the example.
. "$top_srcdir/tests/program/cases.sh"
begin

# Functions that zeroset.h declares, one a line.
declared() {
  sed -n 's/^ZS_API .*[ *]\(zs_[a-z0-9_]*\)(.*/\1/p' "$top_srcdir/src/zeroset.h" | sort
}

exported() {
  nm -D --defined-only "$1" | awk '{ print $NF }' | sort
}

exports() {
  declared >"$scratch/declared"
  exported "$1" >"$scratch/exported"
  [ "$(wc -l <"$scratch/declared")" -ge 30 ]
  diff "$scratch/declared" "$scratch/exported"
}

# The version appears in configure.ac, the pkg-config file and the library.
versions() {
  local version
  version=$(sed -n 's/^Version: *//p' "$top_builddir/zeroset.pc")
  [ -n "$version" ]
  "$ZEROSET" --version >"$scratch/version"
  grep -qF "$version" "$scratch/version" || complain "$(cat "$scratch/version") is not $version"
}

header() {
  printf '#include "zeroset.h"\n' >"$scratch/header.$2"
  $1 -I"$top_srcdir/src" -fsyntax-only -Wall -Wextra -Wpedantic -Werror $3 "$scratch/header.$2"
}

# The example's volume is that of the mesh.
example() {
  "$top_builddir/doc/examples/embed" "$top_srcdir/scenes/$1.xml" >"$scratch/output"
  cat "$scratch/output"
  "$ZEROSET" mesh "$top_srcdir/scenes/$1.xml" -o "$scratch/mesh.ply" --resolution 96 \
    --report json >"$scratch/json"
  near "$(sed -n 's/^volume //p' "$scratch/output")" "$(json_field volume "$scratch/json")" 0.01
}

example_fails() {
  ! "$top_builddir/doc/examples/embed" "$scratch/absent.xml" 2>"$scratch/output"
  grep -q absent.xml "$scratch/output"
}

library=$top_builddir/.libs/libzeroset.so
if [ -e "$library" ] && command -v nm >/dev/null; then
  run_case "exports exactly what zeroset.h declares" exports "$library"
fi
run_case "one version everywhere" versions
run_case "the header is C17" header "$CC" c -std=c17
run_case "the header is C++17" header "$CXX" cc -std=c++17
run_case "the example weighs the cup" example cup
run_case "the example weighs the tangle" example surface
run_case "the example reports a missing file" example_fails
finish
