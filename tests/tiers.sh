#!/usr/bin/env bash
# Data flows one way: a file includes headers of its own tier or lower, and each third-party library has its wrapping files. The tier of a header
# stands in its first lines ("Tier 2"), the tier of a folder in the table below.
set -u
cd "$1" || exit 1
bad=0
complain() { echo "$1"; bad=1; }

declare -A tier=([core]=0 [mesh]=1 [sh]=1 [image]=1 [bake]=2 [shade]=2 [trace]=2 [render]=3 [judge]=4)

tier_of_header() { # what an #include line names; a private header that says nothing is of its folder's tier
    local said
    if [[ $1 == diaphan/* ]]; then
        grep -m1 -o 'Tier [0-9]' "include/$1" | cut -d' ' -f2
    else
        said=$(grep -m1 -o 'Tier [0-9]' "src/$1" | cut -d' ' -f2)
        echo "${said:-${tier[${1%%/*}]:-}}"
    fi
}

for file in src/*/*.[ch] include/diaphan/*.h; do
    if [[ $file == src/* ]]; then
        folder=${file#src/}; folder=${folder%%/*}
        own=${tier[$folder]:-}
        [ -n "$own" ] || complain "$file: the folder has no tier in tests/tiers.sh"
    else
        [ "$(basename "$file")" = diaphan.h ] && continue # the umbrella
        own=$(grep -m1 -o 'Tier [0-9]' "$file" | cut -d' ' -f2)
        [ -n "$own" ] || complain "$file: says no tier"
    fi
    while read -r include; do
        theirs=$(tier_of_header "$include")
        [ -n "$theirs" ] || { complain "$file: includes $include, which says no tier"; continue; }
        # the readers of meshes fill scenes, which are a tier above; files named below are those where it is meant
        if [ "$theirs" -gt "${own:-9}" ]; then
            case "$file $include" in
            "src/mesh/gltf"*" diaphan/rivals.h"|"src/mesh/"*" diaphan/scene.h"|"src/mesh/"*" mesh/readers.h") ;;
            *) complain "$file (tier $own) includes $include (tier $theirs)" ;;
            esac
        fi
    done < <(grep -o '^#include [<"]\(diaphan\|core\|mesh\|sh\|image\|bake\|shade\|trace\|render\|judge\)/[a-z_0-9]*\.h' "$file" | sed 's/.*[<"]//')
done

# one library, one wrapping place; the tool sees public headers only
only() { # pattern of the include, allowed files
    local found
    found=$(grep -rlE "^#include [<\"]$1" src cli include --include=*.[ch] | grep -vE "^($2)$")
    [ -z "$found" ] || complain "only $2 may include $1: $found"
}
only 'jansson' 'src/(mesh|shade)/[a-z_]+\.[ch]'
only 'meshoptimizer' 'src/(mesh/gltf[a-z_]*|render/order)\.c'
only 'embree' 'src/trace/ray\.c'
only '(png|openexr)' 'src/image/[a-z_]+\.c'
only '(epoxy|EGL|GL)/' 'src/render/[a-z_]+\.[ch]'
only '(cairo|fontconfig)' 'cli/canvas\.c'
only '(core|mesh|sh|image|bake|shade|trace|render|judge)/' 'src/.*'
[ $bad = 0 ] && echo "every include goes down or stays"
exit $bad
