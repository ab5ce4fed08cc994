#!/usr/bin/env bash
# What bake and candle write passes the Khronos validator without an error, whatever the store and the bands.
here=$(cd "$(dirname "$0")" && pwd)
. "$here/lib.sh"
modules=$here/../validator/node_modules
if ! command -v node >/dev/null || [ ! -d "$modules/gltf-validator" ]; then
    echo "skipped: the glTF validator is not installed (make setup)"
    exit 77
fi

expect 0 candle -o candle.glb -q
expect 0 bake candle.glb -o unshared.glb -q --directions 16
for store in float snorm16 snorm8; do
    for bands in 1 2 5 6 8; do
        expect 0 bake box.obj -o "box-$store-$bands.glb" -q --directions 16 --bands $bands --store $store
    done
done
cat >check.cjs <<'JS'
const fs = require('fs');
const validator = require(process.argv[2] + '/gltf-validator');
(async () => {
    let bad = 0;
    for (const file of process.argv.slice(3)) {
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
        if (report.issues.numErrors || report.issues.numWarnings) {
            bad++;
            console.log(file, JSON.stringify(report.issues.messages.slice(0, 3)));
        }
    }
    process.exit(bad ? 1 : 0);
})();
JS
expect 0 bake box.obj -o rivals.glb -q --directions 16 --for shsss,prt-cpca,patro,prt
expect 0 bake box.obj -o rivals-box.glb -q --directions 16 --bands 5 --for prt,patro
expect 0 bake rivals.glb -o rivals-again.glb -q --directions 16 --for prt --bands 3
few="--noise 1 --for response --directions 16"
expect 0 bake box.obj -o response.glb -q $few
expect 0 bake rivals.glb -o response-rivals.glb -q $few --response-form rgb --store float
expect 0 bake response-rivals.glb -o response-cpca.glb -q $few --store cpca --clusters 3
expect 0 bake response-rivals.glb -o response-linear.glb -q --noise 1 --directions 16 --for response,shsss --response-form linear --bands 3 --store snorm16
node check.cjs "$modules" ./*.glb || fail "the validator has something to say"
finish
