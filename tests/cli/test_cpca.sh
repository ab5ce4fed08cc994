#!/usr/bin/env bash
# Thickness stored as clustered principal components: figures, the same bytes for any number of threads, back and forth, drawn like any other.
. "$(dirname "$0")/lib.sh"

expect 0 candle -o candle.glb -q
expect 0 bake candle.glb -o a.glb --store cpca --clusters 40 --vectors 7 --directions 64 --threads 1 --json
field '.store == "cpca" and .clusters == 40 and .vectors == 7 and .bytes_per_vertex == 8 and .bytes_per_vertex_gpu == 12'
field '.table_bytes == 40 * 8 * 36 * 4 and .relative_error > 0 and .relative_error < 0.1'
expect 0 bake candle.glb -o b.glb --store cpca --clusters 40 --vectors 7 --directions 64 --threads 4 -q
cmp a.glb b.glb || fail "1 and 4 threads differ"
expect 0 info a.glb --json
field '.baked | .store == "cpca" and .clusters == 40 and .vectors == 7 and .bytes_per_vertex == 8 and .table_bytes == 46080'

# over another store and back
expect 0 bake a.glb -o plain.glb --directions 64 -q
expect 0 info plain.glb --json
field '.baked.store == "snorm8"'
expect 0 bake plain.glb -o back.glb --store cpca --clusters 40 --vectors 7 --directions 64 -q
expect 0 info back.glb --json
field '.baked.store == "cpca"'

# more clusters than positions, one band
expect 0 bake box.obj -o box.glb --store cpca --bands 1 --directions 16 --json
field '.bytes_per_vertex == 2 and .relative_error < 0.01'

expect 0 info candle.glb --compression --directions 64 --json
field '.compression | length == 6 and .[0].error.sphere == 0 and (.[5] | .store == "cpca" and .clusters == 128 and .error.sphere < 0.05)'
field '.compression | .[5].error.sphere < .[4].error.sphere and .[4].error.sphere < .[3].error.sphere and .[2].bytes_per_vertex == 36'
expect 0 info candle.glb --compression --directions 16 --clusters 3 --vectors 2
grep -q 'cpca 3 x 2' stdout || fail "no row for --clusters and --vectors: $(cat stdout)"
refuse 1 'out of range' bake box.obj -o box.glb --store cpca --clusters 5000
refuse 1 'out of range' bake box.obj -o box.glb --store cpca --vectors 37
finish
