# Sourced by the tests that are scripts: named cases, reported as cmocka reports them.
#
#   begin [NEED...]     skip the whole test unless these commands exist
#   run_case NAME COMMAND...   one case; the command runs with `set -e`
#   finish              exit with the result
#
# The environment comes from the Makefile: top_srcdir, top_builddir, ZEROSET, XMLLINT, CC, CXX.
# $scratch is an empty folder that goes away at the end.

set -uo pipefail
failed_cases=0

begin() {
  local need
  : "${top_srcdir:?run this with make check}" "${top_builddir:?}" "${ZEROSET:?}"
  for need; do
    if ! command -v "$need" >/dev/null; then
      echo "skipped: there is no ${need:-such command}"
      exit 77
    fi
  done
  scratch=$(mktemp -d) || exit 99
  trap 'rm -rf "$scratch"' EXIT
}

run_case() {
  local name=$1 status
  shift
  printf '[ RUN      ] %s\n' "$name"
  (set -e; "$@")
  status=$?
  if [ $status -eq 0 ]; then
    printf '[       OK ] %s\n' "$name"
  else
    printf '[  FAILED  ] %s\n' "$name"
    failed_cases=$((failed_cases + 1))
  fi
}

finish() {
  [ "$failed_cases" -eq 0 ]
  exit
}

# complain WORDS: fail the case with a reason.
complain() {
  printf '%s\n' "$*"
  return 1
}

# json_field NAME FILE: the value of a field that is a number, a truth value or null.
json_field() {
  sed -n 's/.*"'"$1"'": *\([^],} ]*\).*/\1/p' "$2" | head -n 1
}

# expect_field NAME VALUE FILE
expect_field() {
  local value
  value=$(json_field "$1" "$3")
  [ "$value" = "$2" ] || complain "$1 is '$value', expected '$2'"
}

# near A B TOLERANCE: |A - B| <= TOLERANCE |B|
near() {
  awk -v a="$1" -v b="$2" -v t="$3" 'BEGIN {
    d = a - b; if (d < 0) d = -d
    m = b < 0 ? -b : b
    exit !(a != "" && b != "" && d <= t * m)
  }' || complain "$1 is not within a fraction $3 of $2"
}
