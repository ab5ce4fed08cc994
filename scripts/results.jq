# Tables and sentences from the metrics.json of several comparisons, as Markdown:
#
#     jq -n -r -f scripts/results.jq docs/results/compare/*/metrics.json >docs/results/compare/README.md
#
# A case is a model in a material, at a size where there are several, under a light. Nothing that is said here is written down beforehand: which method is
# nearer, how often, and whether a claim holds follow from the figures, by these rules.
#
# Error is rmse, without the noise of the reference. Two methods are told apart where their errors a and b in a case differ by
# more than 4 nu / sqrt(N), nu the noise's rmse and N the object's pixels: the difference a^2 - b^2 has the standard deviation
# 2 nu d / sqrt(N), where d, the relative difference of the two pictures, is at most a + b (docs/theory.md, Judging methods).
# So that is two standard deviations at least, whatever the pictures are.
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

def capital: (.[:1] | ascii_upcase) + .[1:];
def light_words: {front: "in front", side: "from the side", back: "from behind"}[.] // .;
def numbers: if . then "fitted" else "as is" end;
def titled: split(", ") | [(.[0] | code)] + .[1:] | join(", ");

[inputs | . + {folder: (input_filename | split("/") | .[-2] // .[-1]), size: (.size_mm * 100 | round | . / 100)}
    | . + {model: (.folder | sub("-[0-9.]+mm$"; ""))}] as $runs
| ($runs | map(.size) | unique) as $sizes
| [$runs[] | . as $run | .materials as $materials
    | .results[] | select(.shown or (.method == "shsss" and (.variant | test("^[0-9]+ bands$"))))
    | . as $row | ($materials[] | select(.name == $row.material)) as $stuff
    | ($stuff.lights[] | select(.light == $row.light)) as $truth
    | ("\($run.model) in \(.material)" + (if ($sizes | length) > 1 then " at \($run.size) mm" else "" end)) as $case
    | {model: $run.model, size: "\($run.size) mm", case: $case, material, light, fitted, method, bands, rmse, psnr, ssim, flip,
       warning, payload_bytes, bytes_per_vertex, table_bytes,
       averaged: .rmse_view_averaged, all: .rmse_all_lights, all_averaged: .rmse_all_lights_view_averaged,
       apart: $truth.view_averaged_rmse, all_apart: $stuff.all_lights.view_averaged_rmse,
       name: (.method + (if .variant then ", " + .variant else "" end)), where: "\($case), \(.light)",
       noise: .noise.psnr, limit: (4 * .noise.rmse / ($truth.pixels | sqrt)),
       # lights share their walks, so more of them are counted as no more pixels
       all_limit: (4 * ($stuff.all_lights.noise // 0) / ([$stuff.all_lights.pixels // 1, 1] | max | sqrt))}] as $all
| ($all | map(select(.rmse == null) | .where) | unique_in_order) as $lost
| ($all | map(select(.where | IN($lost[]) | not))) as $rows
| ($runs | map(.model) | unique_in_order) as $models
| ($all | map(.material) | unique_in_order) as $materials
| ($all | map(.light) | unique_in_order) as $lights
| ($all | map(.name) | unique_in_order) as $names
| ($all | map(.case) | unique | length) as $npair
# one row of every case for what all lights have together
| ($all | map(select(.light == $lights[0] and .all != null))) as $whole

# ---- what is asked of them ----

| def of($name; $fitted): map(select(.name == $name and .fitted == $fitted));
def average($name; $fitted; f): of($name; $fitted) | map(f) | mean;
def lit($light): map(select(.light == $light));
def error_row($name; $fitted; f; $d): [$lights[] as $l | $rows | lit($l) | average($name; $fitted; f) | fix($d)];
def bytes($name): $rows | map(select(.name == $name) | .payload_bytes) | max;
def fetched_bytes($name): $rows | map(select(.name == $name) | .bytes_per_vertex) | max;
def table_bytes($name): $rows | map(select(.name == $name) | .table_bytes) | max;

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
       # the cases in which $a is farther beyond the noise, the worst first
       lost: (map(select(.own.rmse - .other.rmse > .own.limit)
                  | {where: "\(.own.where), \($fitted | numbers)", case: .own.case,
                     own: .own.rmse, other: .other.rmse, ratio: (.own.rmse / ([.other.rmse, 1e-9] | max))}) | sort_by(-.ratio))};
# a duel for each light and for both kinds of numbers, with {light, fitted}
def duels($a; $b; $lights): . as $rows | $lights[] as $l | [true, false][] as $f
    | $rows | lit($l) | duel($a; $b; $f) + {light: $l, fitted: $f, rival: $b};
def verdict: # of a duel
    if .n == 0 then "no case" elif .own < .other and .clear_ahead >= .75 * .n then "nearer"
    elif .own > .other and .clear_behind >= .75 * .n then "farther" else "undecided" end;
def count_words: "\(.ahead) of \(.n), \(.clear_ahead) beyond the noise";
def against: "\(.own | fix(3)) against \(.other | fix(3))";
def condition: "light \(.light | light_words), \(.fitted | numbers)";
# whether the other figures side with rmse's majority
def agreement:
    . as $d | (.ahead - .behind) as $side
    | [["PSNR", .psnr], ["SSIM", .ssim], ["FLIP", .flip]]
    | (map(select($side * (2 * .[1] - $d.n) > 0) | .[0])) as $same
    | (map(select($side * (2 * .[1] - $d.n) <= 0) | "\(.[0]) does not (ahead in \(.[1]))")) as $not
    | if $side == 0 then "PSNR is ahead in \($d.psnr), SSIM in \($d.ssim), FLIP in \($d.flip)"
      else [if ($same | length) > 0 then ($same | listed) + (if ($same | length) > 1 then " agree" else " agrees" end)
            else empty end, if ($not | length) > 0 then ($not | listed) else empty end] | join("; ") end;
def ranked($light; $fitted):
    [$names[] | . as $n | {name: $n, error: ($rows | lit($light) | average($n; $fitted; .rmse))} | select(.error != null)]
    | sort_by(.error) | map("\(.name | titled) \(.error | fix(3))") | join("; ");

($all | map(select(.method == "shsss" and .bands != 2) | .name) | first) as $many
| ($all | map(select(.method == "shsss" and .bands == 2) | .name) | first) as $few
| ($names | map(select(. == "green" or . == "green-gauss"))) as $greens
| ($names | map(select(startswith("response")))) as $responses
| ($lights | map(select(. != "front"))) as $hard
| $runs[0] as $first

# ---- what is measured ----

| def opening:
    "# Every method beside the path-traced truth", "",
    "`diaphan compare` on \($models | listed) in \($materials | listed), "
        + "\($sizes | map("\(.) mm") | listed) large: \($npair * ($lights | length)) cases, each method "
        + "twice, with the numbers that it derives from the material (as is) and with its free numbers fitted to twelve other "
        + "lights. The protocol, and what each figure means, is in [theory.md](../../theory.md#judging-methods). "
        + "`scripts/results.sh` makes all that is in this folder, this page included; its figures and what is said of them are "
        + "computed from the `metrics.json` by `scripts/results.jq`.", "",
    "    scripts/results.sh build/diaphan FOLDER_OF_MODELS docs/results/compare --methods "
        + "\([$all[].method] | unique_in_order | join(","))", "",
    "which calls, in a folder with the models as it prepares them,", "",
    ($runs[] | "    diaphan compare \(.input) -o \(.folder) --methods \([.results[].method] | unique_in_order | join(","))"
        + (.materials | map(" --material " + .name) | join(""))
        + " --size-mm \(.size_mm) --resolution \(.width)x\(.height) --spp \(.reference.spp)"
        + (if .reference.boundary == "matched" then "" else " --boundary " + .reference.boundary end)),
    "",
    ($runs
        | map([.model, "\(.size) mm", (.triangles | thousands), ([.materials[].lights[].pixels] | max | thousands),
               (if .size == $sizes[0] then "[pictures](\(.folder)/comparison.png), " else "" end)
                   + "[figures](\(.folder)/metrics.json)"])
        | table(["model", "size", "triangles", "pixels of the object", "results"])),
    "",
    "Drawn by \($first.renderer); reference with \($first.reference.boundary) boundary, light half-angle "
        + "\($first.light_angle) degrees. The commands also make an HTML report each, with all pictures inside, which is left "
        + "out here for its size. Milliseconds in sheets and figures are of the machine that made them, beside other work; `diaphan bench` is for speed.",
    "",
    "Error is `rmse`, RMS error / RMS truth of linear luminance without the reference's noise: 0 is the truth, 1 a black "
        + "picture. Means are over the \($npair) "
        + (if ($sizes | length) > 1 then "triples of model, material and size" else "pairs of model and material" end) + ". \"Beyond the noise\" is a difference of more than "
        + "two standard deviations; \"nearer\" is said of a method with the lower mean that is ahead beyond the noise in three "
        + "quarters of the cases or more, \"farther\" of the opposite, and \"undecided\" of the rest.", "";

# ---- what is found ----

def how_far:
    "### How far is every method from the truth?", "",
    "From the nearest to the farthest, mean error:", "",
    ($lights[] as $l | [true, false][] as $f
        | "* **Light \($l | light_words), \($f | numbers)**: \(ranked($l; $f))."),
    "";

def against_green:
    [$greens[] as $g | $rows | duels($many; $g; $hard) | . + {verdict: verdict}] as $d
    | ($d | map(select(.verdict == "nearer")) | length) as $yes
    | ($d | map(select(.verdict == "farther")) | length) as $no
    | "### Does SHSSS beat Green and Green-Gauss for light from the side and from behind, as the paper says?", "",
      "Of \($d | length) comparisons below \($yes) say that SHSSS is nearer, \($no) that it is farther, and "
        + "\(($d | length) - $yes - $no) are undecided: as error, the paper's claim "
        + (if $yes == ($d | length) then "holds" elif $no == ($d | length) then "fails"
           elif $yes > 0 and $no == 0 then "holds in part" elif $no > 0 and $yes == 0 then "does not hold"
           elif $yes + $no == 0 then "is not borne out: the methods are level" else "depends on the case" end)
        + ". \(bytes($many)) bytes a vertex stand against a depth map and a pass for each light.",
      "",
      ($d[] | "* **\(.rival | titled), \(condition)**: \(.verdict). SHSSS is ahead in \(count_words); behind in \(.behind), "
        + "\(.clear_behind) beyond it; mean \(against). \(agreement | capital)."),
      "";

def beside_prt:
    [$rows | duels($many; "prt"; $lights)] as $d
    | [true, false] | map(. as $f | $rows | duel($many; "prt"; $f) + {fitted: $f}) | . as $whole
    | "### How close does it come to PRT, at its fraction of the bytes?", "",
      "With \(bytes($many)) of PRT's \(bytes("prt")) bytes a vertex, one in \(bytes("prt") / bytes($many) | fix(0)), SHSSS has "
        + (map("\(.own / .other | fix(2)) times its error \(.fitted | numbers)") | listed) + ", on average over all cases.",
      "",
      (.[] | . as $all | ($d | map(select(.fitted == $all.fitted))) as $each
        | "* **\(.fitted | numbers | capital)**: "
            + ($each | map("\(against) with the light \(.light | light_words)") | listed)
            + ", that is \($each | map(.own / .other | fix(2)) | listed) times the error of PRT; in all \(verdict), ahead in "
            + "\(count_words). \(agreement | capital)."),
      (if "prt-cpca" | IN($names[]) then
          ([$rows | duels("prt-cpca"; "prt"; $lights) | .own - .other | fabs] | max) as $gap
          | "* **Bytes**: compressed by CPCA, PRT has \(bytes("prt-cpca")) a vertex and a table of up to "
            + "\(table_bytes("prt-cpca") | thousands) bytes, and its mean errors move by less than \($gap + .00005 | fix(4))"
            + (if bytes("prt-cpca") < bytes($many)
               then ", so that SHSSS has no advantage in bytes over it (`--store cpca` compresses SHSSS likewise)" else "" end)
            + "."
       else empty end),
      (($rows | lit("front") | [average("prt"; true, false; .rmse)]) as [$fitted, $plain]
        | if $fitted == null or $fitted <= $plain then empty
          else "* Transfer by the dipole has no number of its own. The factor per channel of its fitted row weighs all training "
            + "lights alike and spoils the front: \($plain | fix(3)) as is, \($fitted | fix(3)) fitted." end),
      "";

def four:
    [$rows | duels($few; $many; ["front"]) | . + {verdict: verdict}] as $front
    | ([$rows | duels($few; $many; $hard) | select(verdict == "farther") | "\(.light | light_words) \(.fitted | numbers)"]
        | if length > 0 then listed else "nowhere" end) as $fail
    | ([$rows | duel($few; $many; true, false) | .lost[]] | sort_by(-.ratio) | .[:4]) as $worst
    | "### Do 4 coefficients serve a light in front? Where do they fail?", "",
      "For a light in front the claim "
        + ($front | map(.verdict != "farther") | if all then "holds" elif any then "holds in part" else "fails" end) + ": "
        + ($front | map("\(.fitted | numbers), 4 coefficients are \(.own / .other | fix(2)) times as far from the truth as 36 "
            + "(\(.verdict))") | listed)
        + ". They fail with the light \($fail).",
      "",
      ($rows | duels($few; $many; $lights) | "* **\(condition | capital)**: "
        + ({nearer: "4 coefficients are nearer to the truth than 36",
            farther: "4 coefficients are farther from the truth than 36"}[verdict] // verdict)
        + "; mean \(against), ahead in \(count_words), behind in \(.behind), \(.clear_behind) beyond it. \(agreement | capital)."),
      ($front[] | "* In front, \(.fitted | numbers), "
        + (if .clear_behind == 0 then "there is no case in which 36 are nearer beyond the noise."
           else "36 are nearer beyond the noise in \(.clear_behind): "
            + (.lost[:4] | map("\(.case) (\(against))") | listed)
            + (if .clear_behind > 4 then ", and \(.clear_behind - 4) more" else "" end) + "." end)),
      (if ($worst | length) > 0
       then "* They fail most in \($worst | map("\(.where) (\(against), \(.ratio | fix(1)) times)") | listed)." else empty end),
      "",
      ([$lights[] as $l | [true, false][] as $f | [$l, ($f | numbers)]
        + [$models[] as $m | $rows | lit($l) | map(select(.model == $m))
            | [average($few, $many; $f; .rmse) | fix(3)] | join(" / ")]]
        | table(["light", "numbers"] + ($models | map(. + ", 4 / 36")))),
      "";

# errors over all directions of light, of the rows of $whole; f: .all or .all_averaged
def over_all($name; $fitted; f): $whole | average($name; $fitted; f);
# $a beside $b over all lights: the cases of both
def whole_duel($a; $fitted_a; $b; $fitted_b; f):
    ($whole | of($b; $fitted_b) | map({key: .case, value: .}) | from_entries) as $other
    | [$whole | of($a; $fitted_a)[] | select($other[.case]) | {own: f, other: ($other[.case] | f), limit: .all_limit}
        | select(.own != null and .other != null)]
    | {n: length, own: (map(.own) | mean), other: (map(.other) | mean), ahead: (map(select(.own < .other)) | length),
       clear_ahead: (map(select(.other - .own > .limit)) | length), clear_behind: (map(select(.own - .other > .limit)) | length)};
def square_share($name): # of the squared error over all lights, what that of the average is
    ($whole | of($name; false) | map(select(.all_averaged != null and .all > 0)))
    | if length == 0 then null else (map(.all_averaged * .all_averaged) | add) / (map(.all * .all) | add) end;
def percent: if . == null then "–" else "\(100 * . | round) %" end;

# the aims of the response, over all lights, by bytes a vertex
def aims: {"9": .18, "16": .14, "36": .11};
def peer($name): bytes($name) as $b | $names | map(select(. as $n | ($n | startswith("shsss")) and bytes($n) == $b)) | first;

def response:
    ($responses | map(select(. as $r | $whole | any(.name == $r)))) as $forms
    | ($whole | map(.all_averaged) | any) as $both
    | "### And a response by random walks?", "",
    ($responses[] as $r | [true, false][] as $f | ($rows | average($r; $f; .rmse)) as $own | select($own != null)
        | "* **\($r | titled), \($f | numbers)**, \(bytes($r)) bytes a vertex: "
            + ([$lights[] as $l | "\($rows | lit($l) | average($r; $f; .rmse) | fix(3)) with the light \($l | light_words)"]
                | listed)
            + "; mean \($own | fix(3)), against "
            + ([(peer($r) // $many), ("prt", "green-gauss" | select(IN($names[]))) | . as $n | $rows | duel($r; $n; $f)
                | "\(.other | fix(3)) of \($n | titled) (\(bytes($n)) bytes; the response is \(verdict), ahead in "
                    + "\(count_words))"] | listed)
            + "."),
    "",
    (if ($forms | length) == 0 then empty else
      "#### All directions of light, and both truths", "",
      "Over \($runs[0].materials[0].all_lights.lights) lights that cover the sphere and that nothing is fitted on, all object pixels of all "
        + "lights together. What a response stores is an average over views and a picture is one view, so both truths are asked: what is "
        + "drawn against the picture, and the average alone against the reference averaged over views.", "",
      ($forms[] as $r | aims["\(bytes($r))"] as $aim | over_all($r; false; .all) as $picture
        | over_all($r; false; .all_averaged) as $average
        | "* **\($r | titled), as is**, \(bytes($r)) bytes a vertex: \($picture | fix(3)) from the picture"
            + (if $average then ", \($average | fix(3)) from the average over views" else "" end)
            + (if $aim then "; the aim of \($aim | fix(2)) is "
                + ([["from the picture", $picture, "all"], ["from the average", $average, "all_averaged"]]
                    | map(select(.[1]) | . as $t
                        | ($whole | of($r; false) | map(.[$t[2]])) as $each
                        | "\(if .[1] <= $aim then "reached" else "missed" end) \(.[0]) (in \($each | map(select(. <= $aim)) | length) of "
                            + "\($each | length) cases)")
                    | listed) else "" end)
            + ". "
            + (peer($r) as $s
                | if $s then [[true, "fitted"], [false, "as is"]] | map(. as $f
                    | whole_duel($r; false; $s; $f[0]; .all)
                    | "\(.clear_ahead) of \(.n) (mean \(against)) where SHSSS is \($f[1])")
                    | "It is ahead of \($s | titled), of the same bytes, beyond the noise in \(listed)"
                    + ", each from the picture"
                  else "There is no SHSSS of the same bytes" end)
            + "."),
      (if $both then
        "* **How much of that are the views?** The two truths are \($whole | of($forms[0]; false) | map(.all_apart) | mean | fix(3)) apart over "
          + "all lights, \([$lights[] as $l | "\($rows | lit($l) | of($forms[0]; false) | map(.apart) | mean | fix(3)) with the light \($l | light_words)"] | listed): "
          + "an exact average would have these as its errors. What the eye sees over the average is drawn by a polynomial of the body, which "
          + "has no part in the errors from the average. Of the squared error from the picture over all lights, that from the average is "
          + ([$forms[] | "\(square_share(.) | percent) of \(titled)"] | listed) + "; the rest are the views."
       else empty end),
      "",
      ([$forms[] as $r | $r, (peer($r) | select(. != null))] + ["prt", "green-gauss"] | unique_in_order
        | map(select(IN($names[])))
        | [.[] as $n | [false, true][] as $f
            | [($n | titled), (bytes($n) | fix(0)), ($f | numbers)]
                + [$lights[] as $l | $rows | lit($l) | average($n; $f; .rmse) | fix(3)] + [over_all($n; $f; .all) | fix(3)]
                + (if $both then [$lights[] as $l | $rows | lit($l) | average($n; $f; .averaged) | fix(3)]
                    + [over_all($n; $f; .all_averaged) | fix(3)] else [] end)]
        | table(["method", "bytes a vertex", "numbers"] + ($lights + ["all lights"])
            + (if $both then ($lights + ["all lights"] | map(. + ", from the average")) else [] end))),
      "",
      (if ($sizes | length) > 1 then
        "By material and size, over all lights" + (if $both then ", from the picture / from the average over views" else "" end) + ":", "",
        ([$forms[] as $r | $r, (peer($r) | select(. != null))] + ["prt", "green-gauss"] | unique_in_order
          | map(select(IN($names[])))
          | [.[] as $n | [false, true][] as $f | [($n | titled), ($f | numbers)]
              + [$materials[] as $m | $sizes[] as $z
                  | $whole | of($n; $f) | map(select(.material == $m and .size == "\($z) mm"))
                  | "\(map(.all) | mean | fix(3))" + (if $both then " / \(map(.all_averaged) | mean | fix(3))" else "" end)]]
          | table(["method", "numbers"] + [$materials[] as $m | $sizes[] as $z | "\($m), \($z) mm"])), ""
       else empty end),
      (if $both then
        "Distance of the two truths in every case, as `rmse`:", "",
        ([$whole | of($forms[0]; false)[] | . as $w
            | [.case] + [$lights[] as $l | $all | lit($l) | of($forms[0]; false) | map(select(.case == $w.case)) | .[0].apart | fix(3)]
              + [.all_apart | fix(3)]]
          | table(["case"] + $lights + ["all lights"])), ""
       else empty end)
     end);

# ---- tables ----

def by_light($figure; f; $d; $better):
    "### \($figure), mean (\($better) is better)", "",
    ([$names[] | [titled] + error_row(.; true; f; $d) + error_row(.; false; f; $d)]
        | table(["method"] + ($lights | map(. + ", fitted")) + ($lights | map(. + ", as is")))), "";

def errors:
    "### Error, mean, and bytes", "",
    "Bytes a vertex are what is stored beside position and normal, as fetched what drawing reads more than plain shading does "
        + "(Patro's normals replace the ordinary ones; Green moves vertices along a direction of 4 bytes).", "",
    ([$names[] | . as $n | [titled, (bytes($n), fetched_bytes($n) | fix(0)), (table_bytes($n) | thousands)]
        + ([true, false] | map(. as $f | error_row($n; $f; .rmse; 3) + [$rows | average($n; $f; .rmse) | fix(3)]) | add)]
        | table(["method", "bytes a vertex", "as fetched", "tables and maps, bytes, up to"]
            + ($lights + ["all"] | map(. + ", fitted")) + ($lights + ["all"] | map(. + ", as is")))), "";

def by_kind($title; $kinds; field; $fitted):
    "### Error by \($title), \($fitted | numbers)", "",
    ([$names[] | . as $n | [titled] + [$kinds[] as $k | $lights[] as $l
            | $rows | lit($l) | map(select(field == $k)) | average($n; $fitted; .rmse) | fix(3)]]
        | table(["method"] + [$kinds[] as $k | $lights[] as $l | "\($k), \($l)"])), "";

def beside_green:
    "### SHSSS of 36 coefficients beside Green", "",
    ([$greens[] as $g | $rows | duels($many; $g; $hard)
        | [(.rival | titled), .light, (.fitted | numbers), (.own | fix(3)), (.other | fix(3)), "\(.ahead) of \(.n)",
           (.clear_ahead, .clear_behind, .psnr, .ssim, .flip | tostring), verdict]]
        | table(["rival", "light", "numbers", "SHSSS, mean", "rival, mean", "SHSSS ahead", "beyond the noise",
                 "behind beyond it", "ahead by PSNR", "by SSIM", "by FLIP", "SHSSS is"])), "";

def noise:
    ($all | map({where, noise, limit}) | unique) as $n | ($n | map(.noise)) as $psnr
    | "## Noise of the reference", "",
      "With \([$runs[].reference.spp] | unique | map(tostring) | join(" to ")) samples a pixel the noise alone leaves a PSNR of "
        + "\($psnr | min | fix(1)) dB at the least (\($n | min_by(.noise) | .where)), \($psnr | median | fix(1)) dB in the "
        + "middle. Two methods are told apart where their errors differ by \($n | map(.limit) | min | fix(4)) to "
        + "\($n | map(.limit) | max | fix(4)), by the case. Of \($all | length) rows "
        + "\($all | map(select(.warning | test("within 10 dB")?)) | length) have a PSNR within 10 dB of the noise, and "
        + "\($all | map(select(.warning | test("within noise as far off")?)) | length) are as far off as their neighbour in the "
        + "ranking within the noise, which `metrics.json` says row by row. `rmse` is freed of the noise and is what is to be "
        + "relied on; PSNR, SSIM and FLIP have it in them, and where it is large they favour nobody but hide differences.",
      (if ($lost | length) > 0 then "", "Left out, since the light is no more than noise there: \($lost | join("; "))."
       else empty end);

opening,
"## What it says", "",
how_far,
(if $many and ($greens | length) > 0 and ($hard | length) > 0 then against_green else empty end),
(if $many and ("prt" | IN($names[])) then beside_prt else empty end),
(if $many and $few and ("front" | IN($lights[])) then four else empty end),
(if $many and ($responses | length) > 0 then response else empty end),
"## Tables", "",
errors,
by_light("PSNR, dB"; .psnr; 1; "more"), by_light("SSIM"; .ssim; 3; "more"), by_light("FLIP"; .flip; 3; "less"),
beside_green,
by_kind("material"; $materials; .material; true, false),
by_kind("model"; $models; .model; true, false),
(if ($sizes | length) > 1 then by_kind("size"; $sizes | map("\(.) mm"); .size; true, false) else empty end),
noise
