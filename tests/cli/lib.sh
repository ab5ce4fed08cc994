# What the tests of the tool share: source it with the tool's path as first argument.
set -u
diaphan=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
data=${DPH_DATA:-/nonexistent}
failures=0

fail() {
    echo "FAILED: $*"
    failures=$((failures + 1))
}

# expect CODE ARGUMENT...: runs the tool; its exit code has to be CODE. Leaves the files stdout and stderr.
expect() {
    local wanted=$1 got
    shift
    "$diaphan" "$@" >stdout 2>stderr
    got=$?
    [ "$got" = "$wanted" ] || { fail "diaphan $*: exit code $got, not $wanted"; sed 's/^/    /' stderr; }
}

# refuse CODE PATTERN ARGUMENT...: the same for a failure, which is one line on stderr that says who and, by PATTERN, what.
refuse() {
    local code=$1 pattern=$2
    shift 2
    expect "$code" "$@"
    [ "$(wc -l <stderr)" = 1 ] || { fail "diaphan $*: not one line on stderr:"; sed 's/^/    /' stderr; }
    grep -qE "^diaphan( [a-z]+)?: " stderr || fail "diaphan $*: does not say who: $(cat stderr)"
    grep -qE -- "$pattern" stderr || fail "diaphan $*: no '$pattern' in: $(cat stderr)"
    [ ! -s stdout ] || fail "diaphan $*: something on stdout: $(head -c 200 stdout)"
}

# field FILTER: the last stdout, read as one JSON object, has to satisfy the jq filter.
field() {
    jq -es "length == 1 and (.[0] | ($1))" stdout >/dev/null || fail "JSON: not '$1': $(head -c 400 stdout)"
}

finish() {
    [ "$failures" = 0 ] || exit 1
    exit 0
}

# a closed box of 1 x 2 x 3
cat >box.obj <<'OBJ'
v 0 0 0
v 1 0 0
v 1 2 0
v 0 2 0
v 0 0 3
v 1 0 3
v 1 2 3
v 0 2 3
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 4 8 7 3
f 1 5 8 4
f 2 3 7 6
OBJ
