#!/usr/bin/env bash
# Help: starts with examples, shows units and defaults, exists for every command; misspelt words get a suggestion.
. "$(dirname "$0")/lib.sh"

expect 0 --help
grep -q '^Examples:' stdout || fail "no examples"
commands=$(sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p' stdout)
[ -n "$commands" ] || fail "no list of commands"
for command in bake render compare info candle bench; do
    grep -qw "$command" <<<"$commands" || fail "$command is missing in the help"
done
for command in $commands; do
    expect 0 help "$command"
    cp stdout help
    [ ! -s stderr ] || fail "help of $command talks on stderr"
    expect 0 "$command" --help
    cmp -s stdout help || fail "help $command and $command --help differ"
    expect 0 "$command" -h
    [ "$(sed -n '3p' help)" = "Examples:" ] || fail "help of $command does not start with examples"
    grep -q "^Usage: diaphan $command" help || fail "no usage of $command"
    for option in help version quiet verbose threads json; do
        grep -q -- "--$option" help || fail "--$option is missing in the help of $command"
    done
    expect 0 "$command" --version
    grep -qE '^diaphan [0-9]+\.[0-9]+\.[0-9]+$' stdout || fail "$command --version says $(cat stdout)"
done
expect 0 help bake
for option in bands directions thickness fit store size-mm material; do
    grep -q -- "--$option " stdout || fail "--$option is missing in the help of bake"
done
grep -q -- '--directions .*\[1024\]' stdout || fail "no default of --directions"
grep -q -- '--size-mm .*mm' stdout || fail "no unit of --size-mm"
expect 0 help render
for option in method light camera fov exposure background resolution use-bands samples; do
    grep -q -- "--$option " stdout || fail "--$option is missing in the help of render"
done
expect 0 --version
grep -qE '^diaphan [0-9]+\.[0-9]+\.[0-9]+$' stdout || fail "--version says $(cat stdout)"

expect 1 # nothing at all: the help, on stderr
grep -q '^Commands:' stderr || fail "no help without arguments"
[ ! -s stdout ] || fail "help without arguments belongs on stderr"
refuse 1 "did you mean bake" bakee
refuse 1 "see diaphan --help" frobnicate
refuse 1 "did you mean --bands" bake box.obj -o x.glb --band 3
refuse 1 "did you mean --directions" bake box.obj -o x.glb --direction=3
finish
