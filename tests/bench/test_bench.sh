# The benchmark works: every row at tiny sizes, once, with the right answers.
. "$top_srcdir/tests/program/cases.sh"
begin

bench=$top_builddir/tests/bench/bench
cd "$scratch" || exit 99

# Whatever peers the machine has, they are left out: they may be slow to start.
smoke() {
  BENCH_PYTHON=${python:-false} BENCH_GTS='' ZEROSET_BENCH_DATA="$scratch" "$bench" --smoke "$@" >table || {
    cat table
    return 1
  }
  cat table
}

# The same formula as a scene would have, in the benchmark's notation.
write_vm() {
  cat >prospero.vm <<'END'
# a disc, less a half-plane
_0 const 0.5
_1 var-x
_2 var-y
_3 square _1
_4 mul _2 _2
_5 add _3 _4
_6 sqrt _5
_7 sub _6 _0
_8 neg _1
_a max _7 _8
END
}

check_rows() {
  local row
  for row in spheres-100000 menger-4 twisted-column scalar handwritten peers load render fit sum; do
    grep -q "$row" table || complain "there is no row $row"
  done
}

check_vm() {
  write_vm
  smoke prospero
  grep -q '^prospero  *picture' table || complain "prospero.vm was not used"
}

check_failure() {
  echo "_0 nonsense" >prospero.vm
  ! smoke prospero || complain "a scene that cannot be compiled went unnoticed"
  grep -q 'wrong!' table || complain "nothing is marked"
}

# A peer is asked with a script and FILE NX NY NZ for each grid.
check_peer() {
  local python=$scratch/peer
  printf '%s\n' '#!/bin/sh' 'test -s "$2" && echo "vtk $3 0.5 7777"' >peer
  chmod +x peer
  smoke "peers gyroid"
  grep -q '^gyroid.* 500\.00 .*x .* 7777$' table || complain "the peer's answer is not shown"
}

check_words() {
  smoke gear
  ! grep -q spheres table || complain "a word does not choose rows"
}

# All but the rows whose fits take seconds.
run_case "every row has the right answer" \
  smoke rings spheres menger gyroid twisted gear load "render c" fit sum
run_case "every section is there" check_rows
run_case "a formula in operations is read" check_vm
run_case "what cannot be run is a failure" check_failure
run_case "what a peer answers is shown" check_peer
run_case "words choose rows" check_words
finish
