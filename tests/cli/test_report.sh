#!/usr/bin/env bash
# What compare INPUT -o FOLDER leaves for people: a contact sheet and a report that needs nothing beside it, whatever files are called.
. "$(dirname "$0")/lib.sh"

name="a <b>&\"'\$é日.obj"
cp box.obj "$name"
mkdir "out <&'"
"$diaphan" compare "$name" -o "out <&'" --resolution 64x40 --spp 2 --directions 64 --methods lambert,shsss --lights back --json >stdout 2>stderr
code=$?
if [ "$code" = 3 ]; then
    echo "skipped: $(cat stderr)"
    exit 77
fi
[ "$code" = 0 ] || { fail "exit code $code"; sed 's/^/    /' stderr; finish; }
cd "out <&'" || exit 1
[ "$(ls | tr '\n' ' ')" = "comparison.png metrics.json report.html " ] || fail "not the three files: $(ls)"

# the sheet is a picture that the tool itself reads
"$diaphan" compare comparison.png comparison.png --json >stdout 2>stderr || fail "the sheet: $(cat stderr)"
field '.width > 500 and .height > 500 and .flip == 0'

# the report: names are texts, not tags; nothing is fetched; its tags fit each other
escaped='a &lt;b&gt;&amp;&quot;&#39;$é日.obj'
grep -qF "<h1>$escaped</h1>" report.html || fail "no heading: $(grep -m1 '<h1>' report.html)"
grep -qF '<b>&"' report.html && fail "a name is a tag"
grep -qE "diaphan compare .*--methods lambert,shsss --lights back" report.html || fail "no command"
grep -oE '(src|href|url|srcset|action) *[=(] *"?[^d"]+' report.html | grep -vx 'src = picture.src;.*' && fail "something is fetched"
grep -qE 'https?:|//[a-z]+\.|@import|<link rel="stylesheet"|<iframe' report.html && fail "an address"
grep -q "default-src 'none'" report.html || fail "the page may fetch"
[ "$(grep -o 'data:image/png;base64,iVBORw0KGgo' report.html | wc -l)" -ge 9 ] || fail "pictures are missing"
for tag in html head body style script section table thead tbody tfoot tr figure figcaption select dl div details; do
    opened=$(grep -oE "<$tag[ >]" report.html | wc -l) closed=$(grep -o "</$tag>" report.html | wc -l)
    [ "$opened" = "$closed" ] || fail "$tag: opened $opened times, closed $closed times"
done
if command -v xmllint >/dev/null; then # which knows no tag that is younger than HTML 4
    xmllint --html --huge --noout report.html 2>&1 | grep 'error :' | grep -vE 'Tag (section|figure|figcaption|details|summary|noscript) invalid' &&
        fail "the report is no HTML"
else
    echo "skipped in part: no xmllint"
fi

# each picture of the report is one
number=0
grep -oE 'data:image/png;base64,[A-Za-z0-9+/=]+' report.html | cut -d, -f2 | while read -r bytes; do
    echo "$bytes" | base64 -d >"picture.png" && "$diaphan" compare picture.png picture.png -q || echo "bad $number"
    number=$((number + 1))
done >bad
[ ! -s bad ] || fail "pictures that are none: $(cat bad)"

# nothing is left where a file cannot be written, and the code says so
cd ..
mkdir full && mkdir full/comparison.png
refuse 4 "comparison.png: is a folder" compare box.obj -o full --resolution 32x20 --spp 1 --directions 64 --methods lambert --lights back
[ ! -e full/report.html ] || fail "a report without its sheet"
finish
