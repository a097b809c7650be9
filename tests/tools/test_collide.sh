# tests/tools/test_collide.sh: the answers of collide against closed forms, and its forms of output.
source "$(dirname "$0")/support.sh"
cube 2 >cube.off
sphere 16 >sphere.off
grid 8 >grid.off
moved() { echo "1 0 0 $1 0 1 0 $2 0 0 1 $3"; } # X Y Z
column() { awk -v c="$1" '{ print $c }' out | tr '\n' ' '; }

# --- Cubes: from -1 to 1 ---
expect 0 collide cube.off cube.off
check "a cube touches itself" grep -qE '^1 [0-9]+ [0-9]+$' out
expect 1 collide cube.off cube.off --pose "$(moved 5 0 0)"
check "two cubes apart" test "$(cat out)" = 0
# Faces are closed, and the decision is exact: 2^-40 more than 2 is apart.
{ moved 2 .5 .25; moved 2.0000000000009095 .5 .25; moved 1.9999999999990905 .5 .25; moved 0 0 -2
    moved 2 2 2; moved 2 2 2.0000000000009095
    moved -2 -2 2; } >poses.txt
expect 0 collide cube.off cube.off --poses poses.txt
check "exact contacts of cubes" test "$(column 1)" = "1 0 1 1 1 0 1 "
{ moved 5 0 0; echo "# a comment"; moved 5 6 0; echo; moved -5 6 -14; moved 1 1 1; } >poses.txt
expect 0 collide cube.off cube.off --poses - --distance <poses.txt
check "distances of cubes" test "$(column 1)" = "3 5 13 0 "
check "the nearest points of two corners" test "$(sed -n 3p out | cut -d ' ' -f 4-)" = "-1 1 -1 -4 5 -13"
expect 0 collide cube.off cube.off --poses poses.txt --within 5
check "within 5" test "$(column 1)" = "1 1 0 1 "
expect 0 collide cube.off cube.off --poses poses.txt --within 4.999999
check "within less" test "$(column 1)" = "1 0 0 1 "
expect 1 collide cube.off cube.off --pose "$(moved 9 0 0)" --within 1
expect 0 collide cube.off cube.off --poses poses.txt --within 200% # the diagonal is 3.4641
check "within two diagonals" test "$(column 1)" = "1 1 0 1 "
expect 0 collide cube.off cube.off --poses poses.txt --within 4 --distance
check "-1 where nothing is within" test "$(column 1)" = "3 -1 -1 0 "
# A turn by 90 degrees with commas, a mirror, and a factor: x -> 3 x makes B reach from -3 to 3.
expect 0 collide cube.off cube.off --pose '0,-1,0,5, 1,0,0,0, 0,0,1,0' --distance
check "a turned cube" test "$(column 1)" = "3 "
expect 0 collide cube.off cube.off --pose '-3 0 0 5 0 3 0 0 0 0 3 0' --distance
check "a mirrored, larger cube" test "$(column 1)" = "1 "
check "no warning" test ! -s err
expect 0 collide cube.off cube.off --pose '2 0 0 5 0 1 0 0 0 0 1 0' --distance
check "a stretched cube" test "$(column 1)" = "2 "
says "shears or scales unequally"

# Contacts: B enters the side x = 1 of A by .1, away from all edges of that side.
cube 1 >small.off
expect 0 collide cube.off small.off --pose "$(moved 1.4 .1 .2)" --contacts
holds "$(wc -l <out) >= 8 && $(awk 'NF != 13' out | wc -l) == 0"
# Every segment lies on x = 1 and on the surface of B.
awk 'function size(x) { return x < 0 ? -x : x }
    function off(y, z) { y = size(y - .1); z = size(z - .2); return size((y > z ? y : z) - .5) > 1e-9 }
    $4 != 1 || $7 != 1 || off($5, $6) || off($8, $9) { print }' out >bad
check "segments of contact" test ! -s bad
awk '{ sum += sqrt(($4 - $7) ^ 2 + ($5 - $8) ^ 2 + ($6 - $9) ^ 2) } END { print sum }' out >length
check "the segments make up the outline of B's side" test "$(cat length)" = 4
awk '{ n = $10 * $10 + $11 * $11 + $12 * $12 } n < .99999999 || n > 1.00000001' out >bad
check "the shortest ways out have unit directions" test ! -s bad
awk '$10 > .999999 && $13 > .0999999 && $13 < .1000001' out >found
check "sides of B that cross the plane leave it by .1 along x" test -s found
check "no way is longer" test -z "$(awk '$13 > .1000001 || $13 < 0' out)"
expect 0 collide cube.off small.off --pose "$(moved 1.4 .1 .2)" --pairs
holds "$(wc -l <out) >= 8 && $(awk 'NF != 3 || $1 != 0' out | wc -l) == 0"
expect 0 collide cube.off small.off --pose "$(moved 1.4 .1 .2)" --pairs --limit 3
holds "$(wc -l <out) == 3"

# --- A triangle through a grid: it crosses 8 lower and 7 upper triangles of the first row ---
printf 'OFF\n3 1 0\n.05 .01 -1\n.95 .01 -1\n.5 .01 5\n3 0 1 2\n' >blade.off
expect 0 collide grid.off blade.off --pairs --pose "$(moved 0 0 .9999999)"
cut -d ' ' -f 2,3 out | sort -n >pairs
for cell in 0 1 2 3 4 5 6 7; do [ $cell -gt 0 ] && echo "$((2 * cell + 1)) 0"; echo "$((2 * cell)) 0"; done | sort -n >expected
check "the pairs of a blade" cmp -s pairs expected
{ moved 0 0 .9999999; moved 0 0 1.5; moved 0 .03 .9999999; } >poses.txt
expect 0 collide grid.off blade.off --pairs --poses poses.txt --json
holds "$(value poses) == 3 && $(value found) == 30 && $(grep -c face_a out) == 30 && $(grep -c '"pairs"' out) == 3"

# --- Spheres of radius 1, with faces up to .0096 inside ---
awk 'BEGIN { for (i = 0; i < 400; ++i) {
    a = 7 * i; c = cos(a); s = sin(a); r = i == 0 || i == 10 ? 0 : .05 * (1 + i % 79)
    x = r * cos(3 * i); y = r * sin(3 * i) * cos(i); z = r * sin(3 * i) * sin(i)
    printf "%.9f %.9f 0 %.9f %.9f %.9f 0 %.9f 0 0 1 %.9f\n", c, -s, x, s, c, y, z } }' >poses.txt
expect 0 collide sphere.off sphere.off --poses poses.txt
cp out touching
awk 'NR == FNR { r[FNR] = sqrt($4 * $4 + $8 * $8 + $12 * $12); next }
    (r[FNR] < 1.98 && r[FNR] > .02 && $1 != 1) || (r[FNR] >= 2 && $1 != 0)' poses.txt touching >bad
check "spheres touch up to the sum of their radii" test ! -s bad
expect 0 collide sphere.off sphere.off --poses poses.txt --distance
cp out apart
awk 'NR == FNR { r[FNR] = sqrt($4 * $4 + $8 * $8 + $12 * $12) - 2; next }
    { low = r[FNR] > 0 ? r[FNR] : 0; high = r[FNR] + .02 > 0 ? r[FNR] + .02 : 0 }
    $1 < low - 1e-8 || (r[FNR] > -1.9 && $1 > high)' poses.txt apart >bad
check "distances of spheres" test ! -s bad
awk '{ d = ($4 - $7) ^ 2 + ($5 - $8) ^ 2 + ($6 - $9) ^ 2 - $1 ^ 2 } d > 1e-6 || d < -1e-6' apart >bad
check "the points are that far apart" test ! -s bad
paste -d ' ' touching apart | awk '{ x = $1 == 1 ? $4 : $2 } ($1 == 1) != (x == 0)' >bad
check "distance 0 where faces meet, and only there" test ! -s bad
expect 0 collide sphere.off sphere.off --poses poses.txt --distance --tolerance .05
paste -d ' ' out apart | awk '$1 < $10 - 1e-8 || $1 > $10 + .05 + 1e-8' >bad
check "the tolerance bounds the distance" test ! -s bad
holds "$(paste -d ' ' out apart | awk '$1 > $10 + 1e-4' | wc -l) > 3"
# A sphere inside another one does not touch it.
expect 1 collide sphere.off sphere.off --pose '.5 0 0 .1 0 .5 0 0 0 0 .5 0'
expect 0 collide sphere.off sphere.off --pose '.5 0 0 .1 0 .5 0 0 0 0 .5 0' --distance
holds "$(column 1) > .39 && $(column 1) < .41"
for pose in '.5 0 0 .1 0 .5 0 0 0 0 .5 0 b-inside' '2 0 0 .1 0 2 0 0 0 0 2 0 a-inside' \
    '.5 0 0 1 0 .5 0 0 0 0 .5 0 touching' \
    '.5 0 0 1.6 0 .5 0 0 0 0 .5 0 apart' '-.5 0 0 .1 0 .5 0 0 0 0 .5 0 b-inside' '-2 0 0 .1 0 2 0 0 0 0 2 0 a-inside'; do
    expect 0 collide sphere.off sphere.off --pose "${pose% *}" --relation
    check "the relation of spheres: $pose" test "$(cat out)" = "${pose##* }"
done
expect 0 collide sphere.off sphere.off --pose '.5 0 0 .1 0 .5 0 0 0 0 .5 0' --relation --json
keys results relation found
holds "$(value found) == 1"
check "the relation in JSON" test "$(value relation)" = b-inside
# One pose at a time, and on other threads.
for i in 7 111 399; do
    expect 0 collide sphere.off sphere.off --pose "$(sed -n ${i}p poses.txt)" --distance
    check "pose $i alone" test "$(cut -d ' ' -f 1 out)" = "$(sed -n ${i}p apart | cut -d ' ' -f 1)"
done
for threads in 1 5; do
    for how in '' --relation --distance '--distance --tolerance 1%' --pairs --contacts; do
        expect 0 collide sphere.off sphere.off --poses poses.txt $how --threads $threads -o "$threads$how.txt"
        check "$threads threads, $how" cmp -s "1$how.txt" "$threads$how.txt"
    done
    expect 0 collide sphere.off sphere.off --poses poses.txt --threads $threads --json -o x.txt
    echo "$(value box_tests) $(value triangle_tests)" >visits$threads
    check "the same tests on $threads threads" cmp -s visits1 visits$threads
done
# A pose with more pairs than its part of the memory of a block, as the first pose of its block and in the middle.
holds "$(grep -c '^0 ' 1--pairs.txt) > 4096 && $(grep -c '^10 ' 1--pairs.txt) > 4096"
for i in 0 10 11 330; do
    expect 0 collide sphere.off sphere.off --pose "$(sed -n $((i + 1))p poses.txt)" --pairs
    grep "^$i " 1--pairs.txt | cut -d ' ' -f 2,3 >expected
    cut -d ' ' -f 2,3 out >found
    check "the pairs of pose $i alone" cmp -s found expected
done
# Tests of several poses add up.
boxes=0 triangles=0
sed -n '1p;12p;331p' poses.txt >three.txt
while read -r pose; do
    expect 0 collide sphere.off sphere.off --pose "$pose" --pairs --json
    boxes=$((boxes + $(value box_tests))) triangles=$((triangles + $(value triangle_tests)))
done <three.txt
expect 0 collide sphere.off sphere.off --poses three.txt --pairs --json
holds "$(value box_tests) == $boxes && $(value triangle_tests) == $triangles"
check "one pair of many" test "$(cut -d ' ' -f 1 1--pairs.txt | uniq | wc -l)" = "$(grep -c ^1 touching)"
paste -d ' ' <(cut -d ' ' -f 1-3 1--contacts.txt) 1--pairs.txt | awk '$1 != $4 || $2 != $5 || $3 != $6' >bad
check "contacts of the same pairs" test ! -s bad

# --- JSON ---
expect 0 collide sphere.off sphere.off --poses poses.txt --json
keys results touching face_a face_b found poses seconds box_tests triangle_tests peak_bytes
holds "$(value poses) == 400 && $(value found) == $(grep -c ^1 touching) && $(grep -c '"touching": true' out) == $(value found)"
holds "$(grep -c '"touching"' out) == 400 && $(value box_tests) > 400 && $(value triangle_tests) > 0"
expect 0 collide cube.off cube.off --pose "$(moved 5 0 0)" --distance --json
keys results distance point_a point_b face_a face_b
holds "$(value distance) == 3 && $(value found) == 1"
expect 1 collide cube.off cube.off --pose "$(moved 5 0 0)" --distance --within 2 --json
check "no distance is null" grep -q '"distance": null' out
expect 1 collide cube.off cube.off --pose "$(moved 5 0 0)" --within 2 --json
check "within is false" grep -q '"within": false' out
expect 0 collide cube.off small.off --pose "$(moved 1.4 .1 .2)" --contacts --json --limit 1
keys results pairs from to normal depth
expect 0 collide cube.off cube.off --json -o lines.txt
check "lines in a file, without results" sh -c '! grep -q results out && grep -q ^1 lines.txt'

# --- One mesh with itself ---
expect 1 collide sphere.off --self
check "a sphere does not cross itself" test ! -s out
join() { # A B: both meshes in one, B moved by .9 .3 .2
    awk 'FNR == 1 { ++file; next } FNR == 2 { n[file] = $1; f += $2; next }
        NF == 3 { vertex[++v] = file == 1 ? $0 : ($1 + .9) " " ($2 + .3) " " ($3 + .2) }
        NF == 4 { o = file == 2 ? n[1] : 0; face[++faces] = "3 " $2 + o " " $3 + o " " $4 + o }
        END { print "OFF"; print v, f, 0
            for (i = 1; i <= v; ++i) print vertex[i]
            for (i = 1; i <= faces; ++i) print face[i] }' "$1" "$2"
}
join cube.off small.off >both.off
expect 0 collide cube.off small.off --pose "$(moved .9 .3 .2)" --pairs
awk '{ print $2, $3 + 12 }' out | sort >expected
expect 0 collide both.off --self
sort out >found
check "the pairs of one mesh are those of its parts" cmp -s found expected
expect 0 collide both.off --self --contacts --limit 2
holds "$(wc -l <out) == 2 && $(awk 'NF != 12' out | wc -l) == 0"
expect 0 collide both.off --self --json
holds "$(value found) == $(wc -l <expected)"

# --- Far from the origin: floats have steps of .5 there, and the readers choose a local origin ---
far() { awk -v x="$2" -v y="$3" 'NR > 2 && NF == 3 { printf "%.9f %.9f %.9f\n", $1 + x, $2 + y, $3; next } { print }' "$1"; }
far cube.off 5000000.3 -3000000.7 >far.off
far small.off -7000000.1 9000000.4 >far-small.off
near() { # EXPECTED: out has the same distance and, moved to the far cube, the same points
    paste -d ' ' out "$1" | awk '{ $4 -= 5000000.3; $7 -= 5000000.3; $5 += 3000000.7; $8 += 3000000.7
        for (k = 1; k <= 9; ++k) if (k != 2 && k != 3) { d = $k - $(k + 9); if (d > 1e-6 || d < -1e-6) bad = 1 } } END { exit bad || NR != 1 }'
}
expect 0 collide cube.off small.off --pose "$(moved 2 .5 4)" --distance
cp out expected
expect 0 collide far.off far-small.off --pose "$(moved 12000002.4 -12000000.6 4)" --distance
check "two far models" near expected
expect 0 collide far.off small.off --pose "$(moved 5000002.3 -3000000.2 4)" --distance
check "a far and a near model" near expected
expect 0 collide far.off far-small.off --pose '0 1 0 -3999998.1 -1 0 0 -10000000.3 0 0 1 4' --distance
check "a far model that is turned" near expected
expect 0 collide far.off far-small.off --pose "$(moved 12000001.8 -12000001 .2)" --contacts
awk '$4 < 5000001.299 || $4 > 5000001.301 || $7 < 5000001.299 || $7 > 5000001.301' out >bad
check "contacts of far models" test ! -s bad
holds "$(wc -l <out) >= 8"

# --- Scenes ---
cat >scene.json <<'END'
{"models": {"ball": "sphere.off", "box": "cube.off"},
 "materials": {"grey": {"reflectance": [0.5, 0.5, 0.5]}},
 "instances": [{"name": "left", "model": "ball", "material": "grey", "translate": [-3, 0, 0]},
               {"name": "box", "model": "box", "material": "grey"},
               {"name": "big ball", "model": "ball", "material": "grey", "translate": [2.9, 0, 0], "scale": 2},
               {"name": "thin", "model": "ball", "material": "grey", "translate": [3.5, 2.2, 0], "scale": [-1, 0.5, 1]},
               {"name": "inside", "model": "box", "material": "grey", "scale": 0.5}]}
END
expect 0 collide scene.json
check "instances that touch" test "$(cut -d ' ' -f 1,2 out | tr '\n' ',')" = "1 2,2 3,"
expect 0 collide scene.json --limit 1
check "one pair of instances" test "$(cut -d ' ' -f 1,2 out)" = "1 2"
expect 0 collide scene.json --json
keys results instance_a instance_b name_a name_b face_a face_b found seconds box_tests triangle_tests
holds "$(value found) == 2"
check "names of instances" test "$(value name_a),$(value name_b)" = "box,big ball"
sed -e 's/"translate": \[2.9/"translate": [3.1/' -e 's/2.2, 0/6, 0/' scene.json >apart.json
expect 1 collide apart.json
check "no pair" test ! -s out
# A cube of two materials has two parts, which adjoin; cube three touches the part with the side x = 1.
cat >parts.json <<'END'
{"models": {"box": "cube.off"},
 "materials": {"grey": {"reflectance": [0.5, 0.5, 0.5]}, "red": {"reflectance": [0.5, 0.1, 0.1]}},
 "instances": [{"name": "one", "model": "box", "face_materials":
                ["grey", "grey", "grey", "grey", "grey", "grey", "grey", "grey", "grey", "grey", "red", "red"]},
               {"name": "two", "model": "box", "material": "grey", "translate": [2, 0, 0], "scale": 0.5},
               {"name": "three", "model": "box", "material": "grey", "translate": [1.25, 0, 0], "scale": 0.3}]}
END
expect 0 collide parts.json --json
check "parts of one object do not count" test "$(grep -E 'name_[ab]' out | tr -d ' \n')" = '"name_a":"one","name_b":"three","name_a":"two","name_b":"three",'
# 40 cubes that all touch: 780 pairs, in order.
awk 'BEGIN { print "{\"models\": {\"box\": \"cube.off\"}, \"materials\": {\"grey\": {\"reflectance\": [0.5, 0.5, 0.5]}}, \"instances\": ["
    for (i = 0; i < 40; ++i)
        printf "{\"name\": \"%d\", \"model\": \"box\", \"material\": \"grey\", \"translate\": [%g, 0, 0]}%s\n", i, i / 20, i < 39 ? "," : "]}" }' >many.json
expect 0 collide many.json
cut -d ' ' -f 1,2 out >found
awk 'BEGIN { for (i = 0; i < 40; ++i) for (j = i + 1; j < 40; ++j) print i, j }' >expected
check "all pairs of 40 cubes" cmp -s found expected
expect 0 make cornell -o cornell --triangles 200 --quiet
expect 0 collide cornell/scene.json
cut -d ' ' -f 1,2 out >expected
holds "$(wc -l <expected) == 5"
expect 0 bake cornell/scene.json -o cornell.glb --error 1 --final none --quiet
expect 0 collide cornell.glb
cut -d ' ' -f 1,2 out >found
check "a glTF file has the same instances" cmp -s found expected

# --- Wrong input ---
for bad in '1 0 0 0 0 1 0 0 0 0 1' '1 0 0 0 0 1 0 0 0 0 1 0 5' '1 0 0 0 0 1 0 x 0 0 1 0' '1 0 0 0 0 1 0 nan 0 0 1 0' \
    'inf 0 0 0 0 1 0 0 0 0 1 0'; do
    { moved 0 0 0; echo "$bad"; } >bad.txt
    expect 65 collide cube.off cube.off --poses bad.txt
    says "bad.txt:2: expected"
    expect 64 collide cube.off cube.off --pose "$bad"
    says "--pose"
done
for bad in '1 0 0 0 0 1 0 0 1 0 0 0' '0 0 0 0 0 0 0 0 0 0 0 0' '1 2 3 0 4 5 6 0 7 8 9 0'; do
    { moved 0 0 0; moved 1 1 1; echo "$bad"; } >bad.txt
    expect 65 collide cube.off cube.off --poses bad.txt
    says "bad.txt:3: pose 2: expected a matrix with an inverse, found the determinant 0"
done
: >none.txt
expect 1 collide cube.off cube.off --poses none.txt
expect 66 collide cube.off cube.off --poses missing.txt
expect 66 collide cube.off missing.off
expect 64 collide cube.off cube.off --pose ''
expect 64 collide cube.off cube.off --pose "$(moved 0 0 0)" --poses poses.txt
expect 64 collide cube.off
says "expected A B, a scene or --self"
expect 64 collide
expect 64 collide cube.off cube.off cube.off
expect 64 collide cube.off cube.off --self
expect 64 collide cube.off scene.json
expect 64 collide scene.json --self
expect 64 collide scene.json --pairs
expect 64 collide cube.off --self --distance
expect 64 collide cube.off cube.off --limit 3
expect 64 collide cube.off cube.off --pairs --limit 0
expect 64 collide cube.off cube.off --pairs --distance
expect 64 collide cube.off cube.off --contacts --within 1
expect 64 collide cube.off cube.off --relation --distance
expect 64 collide cube.off cube.off --relation --pairs
expect 64 collide cube.off --self --relation
expect 64 collide cube.off cube.off --tolerance 1
expect 64 collide cube.off cube.off --distance --tolerance -1
expect 64 collide cube.off cube.off --within inch
expect 64 collide - - --format off
expect 64 collide cube.off - --format off --poses -
expect 0 collide cube.off - --format off <cube.off
expect 75 collide cube.off cube.off --pairs --max-memory 1M
leftovers
finish
