# Tables and sentences from the metrics.json of several comparisons, as Markdown:
#
#     jq -n -r -f scripts/results.jq docs/results/compare/*/metrics.json >docs/results/compare/README.md
#
# A case is a model in a material under a light. Nothing that is said here is written down beforehand: which method is
# nearer, how often, and whether a claim holds follow from the figures, by these rules.
#
# Error is rmse, without the noise of the reference. Two methods are told apart where their errors a and b in a case differ by
# more than 4 nu / sqrt(N), nu the noise's rmse and N the object's pixels: the difference a^2 - b^2 has the standard deviation
# 2 nu d / sqrt(N), where d, the relative difference of the two pictures, is at most a + b (docs/theory.md, Judging methods). So that is
# two standard deviations, whatever the pictures are.
#
# "A is nearer than B" holds where A's mean is the lower one and A is nearer beyond the noise in three quarters of the
# cases or more; the opposite likewise; else it is undecided.

# ---- numbers and words ----

def mean: map(select(. != null)) | if length > 0 then add / length else null end;
def median: map(select(. != null)) | sort | if length == 0 then null
    elif length % 2 == 1 then .[length / 2 | floor] else (.[length / 2 - 1] + .[length / 2]) / 2 end;

# $d decimals, .25 for a quarter
def fix($d):
    if . == null then "–" elif . < 0 then "-" + (-. | fix($d))
    else (. * pow(10; $d) | round | tostring) as $s
        | if $d == 0 then $s
          else ((if ($s | length) < $d then "0" * ($d - ($s | length)) else "" end) + $s)
              | .[:length - $d] + "." + .[length - $d:] end
    end;
def thousands:
    round | tostring | [while(length > 0; .[:([length - 3, 0] | max)]) | .[([length - 3, 0] | max):]] | reverse | join(",");
def listed: if length < 2 then join("") else (.[:-1] | join(", ")) + " and " + .[-1] end;
def code: "`" + . + "`";
def cells: "| " + join(" | ") + " |";
def table($head): ($head | cells), ($head | map("---") | cells), (.[] | cells);
def unique_in_order: reduce .[] as $x ([]; if index([$x]) then . else . + [$x] end);

# ---- the cases ----

def light_words: {front: "in front", side: "from the side", back: "from behind"}[.] // .;
def numbers: if . then "fitted" else "as is" end;
def titled: split(", ") | [(.[0] | code)] + .[1:] | join(", ");

[inputs | . + {model: (input_filename | split("/") | .[-2] // .[-1])}] as $runs
| [$runs[] | .model as $model | .materials as $materials | .results[] | select(.shown)
    | . as $row | ($materials[] | select(.name == $row.material) | .lights[] | select(.light == $row.light)) as $truth
    | {model: $model, material, light, fitted, method, bands, rmse, psnr, ssim, flip, warning, payload_bytes, bytes_per_vertex, table_bytes,
       name: (.method + (if .variant then ", " + .variant else "" end)), where: "\($model) in \(.material), \(.light)",
       noise: .noise.psnr, limit: (4 * .noise.rmse / ($truth.pixels | sqrt))}] as $all
| ($all | map(select(.rmse == null) | .where) | unique_in_order) as $lost
| ($all | map(select(.where | IN($lost[]) | not))) as $rows
| ($runs | map(.model)) as $models
| ($all | map(.material) | unique_in_order) as $materials
| ($all | map(.light) | unique_in_order) as $lights
| ($all | map(.name) | unique_in_order) as $names
| ($rows | map(.where) | unique_in_order | length) as $ncase
| ($models | length * ($materials | length)) as $ntriple

# ---- what is asked of them ----

| def of($name; $fitted): map(select(.name == $name and .fitted == $fitted));
def average($name; $fitted; f): of($name; $fitted) | map(f) | mean;
def lit($light): map(select(.light == $light));
def error_row($name; $fitted; f; $d): [$lights[] as $l | $rows | lit($l) | average($name; $fitted; f) | fix($d)];
def shared($name): # "green" or "shsss, 6 bands": its rows hold the same bytes but for what a model's seams add
    $rows | map(select(.name == $name));
def bytes($name): shared($name) | map(.payload_bytes) | max;

# $a beside $b in the cases of the input that have both
def duel($a; $b; $fitted):
    (of($b; $fitted) | map({key: .where, value: .}) | from_entries) as $other
    | [of($a; $fitted)[] | select($other[.where]) | {own: ., other: $other[.where]}]
    | {n: length, own: (map(.own.rmse) | mean), other: (map(.other.rmse) | mean),
       ahead: (map(select(.own.rmse < .other.rmse)) | length),
       behind: (map(select(.own.rmse > .other.rmse)) | length),
       clear_ahead: (map(select(.other.rmse - .own.rmse > .own.limit)) | length),
       clear_behind: (map(select(.own.rmse - .other.rmse > .own.limit)) | length),
       psnr: (map(select((.own.psnr // infinite) > (.other.psnr // infinite))) | length),
       ssim: (map(select(.own.ssim > .other.ssim)) | length),
       flip: (map(select(.own.flip < .other.flip)) | length),
       pairs: map({where: "\(.own.where), \($fitted | numbers)", own: .own.rmse, other: .other.rmse, clear: ((.own.rmse - .other.rmse | fabs) > .own.limit),
                   ratio: (if .other.rmse > 0 then .own.rmse / .other.rmse else null end)})};
def verdict: # of a duel
    if .n == 0 then "no case" elif .own < .other and .clear_ahead >= .75 * .n then "nearer"
    elif .own > .other and .clear_behind >= .75 * .n then "farther" else "undecided" end;
def count_words: "\(.ahead) of \(.n), \(.clear_ahead) beyond the noise";
# whether the other figures side with rmse's majority
def agreement:
    . as $d | (.ahead - .behind) as $side
    | [["PSNR", .psnr], ["SSIM", .ssim], ["FLIP", .flip]]
    | (map(select($side * (2 * .[1] - $d.n) > 0) | .[0])) as $same
    | (map(select($side * (2 * .[1] - $d.n) <= 0) | "\(.[0]) does not (ahead in \(.[1]))")) as $not
    | if $side == 0 then "PSNR is ahead in \($d.psnr), SSIM in \($d.ssim), FLIP in \($d.flip)"
      else [(if ($same | length) > 0 then ($same | listed) + (if ($same | length) > 1 then " agree" else " agrees" end) else empty end),
            (if ($not | length) > 0 then ($not | listed) else empty end)] | join("; ") end;
def ranked($light; $fitted):
    [$names[] | . as $n | {name: $n, error: ($rows | lit($light) | average($n; $fitted; .rmse))} | select(.error != null)] | sort_by(.error)
    | map("\(.name | titled) \(.error | fix(3))") | join("; ");

($all | map(select(.method == "shsss" and .bands != 2) | .name) | first) as $many
| ($all | map(select(.method == "shsss" and .bands == 2) | .name) | first) as $few
| ($names | map(select(. == "green" or . == "green-gauss"))) as $greens
| ($names | map(select(startswith("response")))) as $responses
| ($lights | map(select(. != "front"))) as $hard
| $runs[0] as $first

# ---- what is measured ----

| def opening:
    "# Every method beside the path-traced truth", "",
    "`diaphan compare` on \($models | listed) in \($materials | listed): \($ntriple * ($lights | length)) cases, each method twice, with the numbers that it derives "
        + "from the material (as is) and with its free numbers fitted to twelve other lights. The protocol, and what each figure means, is in "
        + "[theory.md](../../theory.md#judging-methods). `scripts/results.sh` makes all that is in this folder, this page included; its figures and what is said of "
        + "them are computed from the four `metrics.json` by `scripts/results.jq`.", "",
    "    scripts/results.sh build/diaphan FOLDER_OF_MODELS docs/results/compare", "",
    "which calls, in a folder with the models,", "",
    ($runs[] | "    diaphan compare \(.input) -o \(.model)" + (.materials | map(" --material " + .name) | join(""))
        + " --size-mm \(.size_mm) --resolution \(.width)x\(.height) --spp \(.reference.spp)"
        + (if .reference.boundary == "matched" then "" else " --boundary " + .reference.boundary end)),
    "",
    ($runs | map(["\(.model)", "\(.triangles | thousands)", "\([.materials[].lights[].pixels] | max | thousands)",
                  "[pictures](\(.model)/comparison.png), [report](\(.model)/report.html), [figures](\(.model)/metrics.json)"])
        | table(["model", "triangles", "pixels of the object", "results"])),
    "",
    "Drawn by \($first.renderer); reference with \($first.reference.boundary) boundary, light half-angle \($first.light_angle) degrees. The report is one file with "
        + "its pictures inside: download it and open it in a browser. Milliseconds in reports are of the machine that made them, beside other work; "
        + "`diaphan bench` is for speed.", "",
    "Error is `rmse`, RMS error / RMS truth of linear luminance without the reference's noise: 0 is the truth, 1 a black picture. Means are over "
        + "the \($ntriple) pairs of model and material. \"Beyond the noise\" is a difference of more than two standard deviations; \"nearer\" is said of a method "
        + "with the lower mean that is ahead beyond the noise in three quarters of the cases or more, \"farther\" of the opposite, and \"undecided\" of the rest.", "";

# ---- what is found ----

def how_far:
    "### How far is every method from the truth?", "",
    "From the nearest to the farthest, mean error:", "",
    ($lights[] as $l | [true, false][] as $f | "* **Light \($l | light_words), \($f | numbers)**: \(ranked($l; $f))."),
    "";

def against_green:
    "### Does SHSSS beat Green and Green-Gauss for light from the side and from behind, as the paper says?", "",
    ([$greens[] as $g | $hard[] as $l | [true, false][] as $f | ($rows | lit($l) | duel($many; $g; $f)) | verdict] as $v
        | ($v | map(select(. == "nearer")) | length) as $yes | ($v | map(select(. == "farther")) | length) as $no
        | "Of \($v | length) comparisons below \($yes) say that SHSSS is nearer, \($no) that it is farther, and \(($v | length) - $yes - $no) are undecided: as error, the paper's claim "
            + (if $yes == ($v | length) then "holds." elif $no == ($v | length) then "fails." elif $yes > 0 and $no == 0 then "holds in part."
               elif $no > 0 and $yes == 0 then "does not hold." elif $yes + $no == 0 then "is not borne out: the methods are level." else "depends on the case." end)
            + " \(bytes($many)) bytes a vertex stand against a depth map and a pass for each light."),
    "",
    ($greens[] as $g | $hard[] as $l | [true, false][] as $f | ($rows | lit($l) | duel($many; $g; $f))
        | "* **\($g | titled), light \($l | light_words), \($f | numbers)**: \(verdict). SHSSS is ahead in \(count_words); behind in \(.behind), \(.clear_behind) beyond it; "
            + "mean \(.own | fix(3)) against \(.other | fix(3)). \(agreement | (.[:1] | ascii_upcase) + .[1:])."),
    "";

def beside_prt:
    ("prt" | IN($names[])) as $has | if $has | not then empty else
    "### How close does it come to PRT, at its fraction of the bytes?", "",
    ([true, false] | map(. as $f | $rows | duel($many; "prt"; $f) | "\(.own / .other | fix(2)) times its error \($f | numbers)") | listed
        | "With \(bytes($many)) of PRT's \(bytes("prt")) bytes a vertex, one in \(bytes("prt") / bytes($many) | fix(0)), SHSSS has \(.), on average over all cases."),
    "",
    ([true, false][] as $f | ([$lights[] as $l | $rows | lit($l) | duel($many; "prt"; $f) | {light: $l, own, other}]) as $d
        | ($rows | duel($many; "prt"; $f)) as $whole
        | "* **\($f | numbers | (.[:1] | ascii_upcase) + .[1:])**: \($d | map("\(.own | fix(3)) against \(.other | fix(3)) with the light \(.light | light_words)") | listed), "
            + "that is \($d | map(.own / .other | fix(2)) | listed) times the error of PRT; in all \($whole | verdict), ahead in \($whole | count_words). "
            + "\($whole | agreement | (.[:1] | ascii_upcase) + .[1:])."),
    (if "prt-cpca" | IN($names[]) then
            ([$lights[] as $l | [true, false][] as $f | ($rows | lit($l) | average("prt-cpca"; $f; .rmse)) - ($rows | lit($l) | average("prt"; $f; .rmse)) | fabs] | max) as $gap
            | (shared("prt-cpca") | map(.table_bytes) | max) as $table
            | "* **Bytes**: compressed by CPCA, PRT has \(bytes("prt-cpca")) a vertex and a table of up to \($table | thousands) bytes, and its mean errors move by \($gap | fix(4)) at most"
              + (if bytes("prt-cpca") < bytes($many) then ", so that SHSSS has no advantage in bytes over it (`--store cpca` compresses SHSSS likewise)." else "." end)
     else empty end),
    (($rows | lit("front") | average("prt"; false; .rmse)) as $plain | ($rows | lit("front") | average("prt"; true; .rmse)) as $fitted
        | if $fitted == null or $fitted <= $plain then empty
          else "* Transfer by the dipole has no number of its own. The factor per channel of its fitted row weighs all training lights alike and spoils the front: "
            + "\($plain | fix(3)) as is, \($fitted | fix(3)) fitted." end),
    "" end;

def four:
    if ($few and $many) | not then empty else
    "### Do 4 coefficients serve a light in front? Where do they fail?", "",
    ([true, false] | map(. as $f | $rows | lit("front") | duel($few; $many; $f) | {numbers: ($f | numbers), verdict: verdict, own, other})) as $front
        | ([$hard[] as $l | [true, false][] as $f | $rows | lit($l) | duel($few; $many; $f) | select(verdict == "farther") | "\($l | light_words) \($f | numbers)"]) as $fail
        | "For a light in front the claim " + ($front | map(.verdict != "farther") | if all then "holds" elif any then "holds in part" else "fails" end)
            + ": " + ($front | map("\(.numbers), 4 coefficients are \(.own / .other | fix(2)) times as far from the truth as 36 (\(.verdict))") | listed) + ". They fail with the light "
            + (if ($fail | length) > 0 then $fail | listed else "nowhere" end) + ".", "",
    ($lights[] as $l | [true, false][] as $f | ($rows | lit($l) | duel($few; $many; $f))
        | "* **Light \($l | light_words), \($f | numbers)**: "
            + ({nearer: "4 coefficients are nearer to the truth than 36", farther: "4 coefficients are farther from the truth than 36"}[verdict] // verdict)
            + "; mean \(.own | fix(3)) against \(.other | fix(3)), ahead in \(count_words), behind in \(.behind), \(.clear_behind) beyond it. "
            + "\(agreement | (.[:1] | ascii_upcase) + .[1:])."),
    (([true, false][] as $f | ($rows | lit("front") | duel($few; $many; $f)) | (.pairs | map(select(.clear and .own > .other)) | sort_by(-.ratio)) as $bad
        | "* In front, \($f | numbers), "
            + (if ($bad | length) == 0 then "there is no case in which 36 are nearer beyond the noise."
               else "36 are nearer beyond the noise in \($bad | length): " + ($bad | .[:4] | map("\(.where | sub(", [^,]*, [^,]*$"; "")) (\(.own | fix(3)) against \(.other | fix(3)))") | listed)
                   + (if ($bad | length) > 4 then ", and \(($bad | length) - 4) more" else "" end) + "." end))),
    ([$rows | duel($few; $many; true, false) | .pairs[]] as $p
        | ($p | map(select(.clear and .own > .other)) | sort_by(-.ratio) | .[:4]) as $worst
        | if ($worst | length) == 0 then empty else
          "* They fail most in \($worst | map("\(.where) (\(.own | fix(3)) against \(.other | fix(3)), \(.ratio | fix(1)) times)") | listed)." end),
    "",
    "| light | numbers | \($models | map(. + ", 4 / 36") | join(" | ")) |", "| --- | --- |" + ($models | map(" --- |") | join("")),
    ($lights[] as $l | [true, false][] as $f | [$l, ($f | numbers)]
        + [$models[] as $m | $rows | lit($l) | map(select(.model == $m)) | "\(average($few; $f; .rmse) | fix(3)) / \(average($many; $f; .rmse) | fix(3))"] | cells),
    "" end;

def response:
    if ($responses | length) == 0 then empty else
    "### And a response by random walks?", "",
    ($responses[] as $r | [true, false][] as $f
        | ($rows | average($r; $f; .rmse)) as $own
        | select($own != null)
        | "* **\($r | titled), \($f | numbers)**, \(bytes($r)) bytes a vertex: "
            + ([$lights[] as $l | "\($rows | lit($l) | average($r; $f; .rmse) | fix(3)) with the light \($l | light_words)"] | listed) + "; mean \($own | fix(3)), against "
            + ([$many, ("prt", "green-gauss" | select(IN($names[])))
                | . as $n | ($rows | duel($r; $n; $f)) | "\(.other | fix(3)) of \($n | titled) (\(bytes($n)) bytes; the response is \(verdict), ahead in \(count_words))"] | listed)
            + "."),
    "" end;

# ---- tables ----

def by_light($figure; f; $d; $better):
    "### \($figure), mean (\($better) is better)", "",
    ([$names[] | [titled] + error_row(.; true; f; $d) + error_row(.; false; f; $d)]
        | table(["method"] + ($lights | map(. + ", fitted")) + ($lights | map(. + ", as is")))), "";

def errors:
    "### Error, mean, and bytes", "",
    ([$names[] | . as $n | [titled, (shared($n) | map(.payload_bytes) | unique | map(fix(0)) | join(" to ")),
            (shared($n) | map(.table_bytes) | max | if . > 0 then thousands else "0" end)]
        + error_row($n; true; .rmse; 3) + [$rows | average($n; true; .rmse) | fix(3)]
        + error_row($n; false; .rmse; 3) + [$rows | average($n; false; .rmse) | fix(3)]]
        | table(["method", "bytes a vertex", "tables and maps, bytes, up to"] + ($lights | map(. + ", fitted")) + ["all, fitted"] + ($lights | map(. + ", as is")) + ["all, as is"])), "";

def by_kind($title; $kinds; field; $fitted):
    "### Error by \($title), \($fitted | numbers)", "",
    ([$names[] | . as $n | [titled] + [$kinds[] as $k | $lights[] as $l | $rows | lit($l) | map(select(field == $k)) | average($n; $fitted; .rmse) | fix(3)]]
        | table(["method"] + [$kinds[] as $k | $lights[] as $l | "\($k), \($l)"])), "";

def duels:
    "### SHSSS of 36 coefficients beside Green", "",
    ([$greens[] as $g | $hard[] as $l | [true, false][] as $f | ($rows | lit($l) | duel($many; $g; $f))
        | [($g | titled), $l, ($f | numbers), (.own | fix(3)), (.other | fix(3)), "\(.ahead) of \(.n)", "\(.clear_ahead)", "\(.clear_behind)",
           "\(.psnr)", "\(.ssim)", "\(.flip)", verdict]]
        | table(["rival", "light", "numbers", "SHSSS, mean", "rival, mean", "SHSSS ahead", "beyond the noise", "behind beyond it", "ahead by PSNR", "by SSIM", "by FLIP", "SHSSS is"])), "";

def noise:
    ($all | map({where, noise, limit}) | unique) as $n | ($n | map(.noise)) as $psnr
    | "## Noise of the reference", "",
    "With \([$runs[].reference.spp] | unique | map(tostring) | join(" to ")) samples a pixel the noise alone leaves a PSNR of \($psnr | min | fix(1)) dB at the least ("
        + "\($n | min_by(.noise) | .where)), \($psnr | median | fix(1)) dB in the middle. Two methods are told apart where their errors differ by \($n | map(.limit) | min | fix(4)) to "
        + "\($n | map(.limit) | max | fix(4)), by the case. Of \($all | length) rows \($all | map(select(.warning | test("within 10 dB")?)) | length) have a PSNR within 10 dB of the noise, and "
        + "\($all | map(select(.warning | test("within noise as far off")?)) | length) are as far off as their neighbour in the ranking within the noise, which `metrics.json` says row by row. "
        + "`rmse` is freed of the noise and is what is to be relied on; PSNR, SSIM and FLIP have it in them, and where it is large they favour nobody but hide differences.",
    (if ($lost | length) > 0 then "", "Left out, since the light is no more than noise there: \($lost | join("; "))." else empty end);

opening, "## What it says", "", how_far, against_green, beside_prt, four, response,
"## Tables", "", errors,
by_light("PSNR, dB"; .psnr; 1; "more"), by_light("SSIM"; .ssim; 3; "more"), by_light("FLIP"; .flip; 3; "less"), duels,
by_kind("material"; $materials; .material; true), by_kind("material"; $materials; .material; false),
by_kind("model"; $models; .model; true), by_kind("model"; $models; .model; false), noise
