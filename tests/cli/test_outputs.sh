#!/usr/bin/env bash
# Outputs appear whole or not at all, and an existing one survives a failure, a full disk and a kill.
. "$(dirname "$0")/lib.sh"

refuse 4 "no/such: *|does not exist" bake box.obj -o no/such/box.glb
mkdir folder.glb
refuse 4 "folder" bake box.obj -o folder.glb
refuse 4 "" candle -o no/such/candle.obj
refuse 4 "" render box.obj -o no/such/box.png

echo precious >box.glb
cp box.glb before
[ -e /dev/full ] && {
    ln -s /dev/full full.glb
    ln -s /dev/full full.obj
    refuse 4 "No space left" bake box.obj -o full.glb
    refuse 4 "No space left" candle -o full.obj
    "$diaphan" info box.obj >/dev/full 2>stderr
    [ $? = 4 ] || fail "a full stdout goes unnoticed"
}

# a disk that fills up: files may not grow beyond 8 KiB here
expect 0 candle -o candle.glb -q
(ulimit -f 8; "$diaphan" bake candle.glb -o box.glb --directions 16 -q 2>stderr)
code=$?
[ "$code" = 4 ] || fail "file too large: exit code $code"
cmp box.glb before || fail "an existing file did not survive a full disk"

# bad input leaves it alone
echo "f 1 2 3" >bad.obj
refuse 2 "bad.obj:1: " bake bad.obj -o box.glb
cmp box.glb before || fail "an existing file did not survive bad input"

# a kill in the middle
"$diaphan" bake candle.glb -o box.glb --directions 65536 -q &
child=$!
sleep 0.5
kill -9 $child || fail "the bake was over too soon"
wait $child 2>/dev/null
cmp box.glb before || fail "an existing file did not survive a kill"
[ "$(ls)" = "$(printf 'bad.obj\nbefore\nbox.glb\nbox.obj\ncandle.glb\nfolder.glb\nfull.glb\nfull.obj\nstderr\nstdout')" ] ||
    fail "something was left behind: $(ls)"

# and after all that it is replaced
expect 0 bake box.obj -o box.glb -q
cmp -s box.glb before && fail "the file was not replaced"
finish
