# tests/tools/test_cuts.sh: flat pieces, charts, meshlets and neighbours from outside: files, JSON keys, bad options, odd meshes.
source "$(dirname "$0")/support.sh"
sphere 16 >sphere.off
grid 8 '.1 * x * y' >grid.off
cube 2 >cube.off
expect 0 cluster sphere.off -o sphere.fct

# --- by distance ---
last=961
for d in 0 .001 .01 .1 .5 5; do
    expect 0 partition sphere.fct --max-distance $d -o labels.txt --json
    keys clusters largest_distance diagonal mean_fit connected
    holds "$(value clusters) <= $last && ($d == 0 || $(value largest_distance) <= $d)"
    last=$(value clusters)
    check "$last labels" test "$(wc -l <labels.txt) $(sort -u labels.txt | wc -l)" = "960 $last"
done
check "one cluster in the end" test "$last" = 1
expect 0 partition sphere.fct --max-distance 1% -o percent.txt --json
diagonal=$(value diagonal)
holds "$(value largest_distance) <= .01 * $diagonal"
expect 0 partition sphere.fct --max-distance "$(awk "BEGIN { printf \"%.17g\", .01 * $diagonal }")" -o length.txt
check "a share of the diagonal is a length" cmp percent.txt length.txt
expect 0 partition sphere.fct --max-distance 1% -o - --quiet
check "labels on standard output" cmp out percent.txt
for bad in -1 x '%' 1%% nan; do expect 64 partition sphere.fct --max-distance "$bad" -o x.txt; done

expect 0 boxes sphere.fct --max-distance 1% --json
check "boxes of the same clusters" test "$(value clusters)" = "$(sort -u percent.txt | wc -l)"
expect 0 boxes sphere.fct --max-distance 1% -o boxes.ply
expect 64 boxes sphere.fct --max-distance 1% -k 3
expect 64 boxes sphere.fct

# --- charts ---
for angle in 5 30 80; do
    expect 0 partition sphere.fct --charts $angle -o charts.txt --json
    keys clusters charts non_disks opened angle limit topology merged largest_faces largest_angle seam_length boundary_length
    holds "$(value non_disks) == 0 && $(value largest_angle) <= $angle && $(value charts) == $(value clusters)"
    check "$(value charts) charts" test "$(sort -u charts.txt | wc -l)" = "$(value charts)"
    merged=$(value charts)
    expect 0 partition sphere.fct --charts $angle --keep-cuts -o cuts.txt --json
    holds "$(value charts) >= $merged && $(value merged) == 0"
done
expect 0 partition cube.off --charts 44 -o charts.txt --json
holds "$(value charts) == 6 && $(value seam_length) == 24 && $(value boundary_length) == 0 && $(value largest_angle) == 0"
expect 0 partition cube.off --charts 180 --any-topology -o charts.txt --json
holds "$(value charts) == 1 && $(value non_disks) == 1"
expect 0 partition grid.off --charts 90 --max-faces 10 -o charts.txt --json
holds "$(value charts) >= 13 && $(value largest_faces) <= 10"
expect 0 partition grid.off --charts 90 --max-area .1 -o charts.txt --json
holds "$(value charts) >= 10 && $(value charts) < 60"
expect 0 partition sphere.fct --charts 40 -o charts.glb
expect 0 info charts.glb --json
holds "$(value faces) == 960"
expect 64 partition sphere.fct --charts 200 -o x.txt
expect 64 partition sphere.fct --charts 20 -k 3 -o x.txt
says "expected exactly one of"
expect 64 partition sphere.fct -o x.txt
expect 64 partition sphere.fct -k 3 --max-faces 9 -o x.txt
expect 64 partition sphere.fct --charts 20 --refine 2 -o x.txt

# --- neighbours ---
expect 0 partition cube.off --charts 44 -o charts.txt --adjacency pairs.txt --json
holds "$(value pairs) == 12"
check "sides of a cube: length 2, one edge" test "$(awk '$1 < $2 && $3 == 2 && $4 == 1' pairs.txt | wc -l)" = 12
expect 0 partition sphere.fct -k 20 -o labels.txt --adjacency pairs.txt
check "sorted pairs below 20" awk '$1 >= $2 || $2 >= 20 || $1 < a || ($1 == a && $2 <= b) { bad = 1 } { a = $1; b = $2 } END { exit bad }' pairs.txt
expect 0 partition sphere.fct -k 1 -o labels.txt --adjacency pairs.txt
check "one cluster has no neighbour" test ! -s pairs.txt
expect 73 partition sphere.fct -k 2 -o labels.txt --adjacency missing/pairs.txt
expect 64 partition sphere.fct -k 2 -o labels.txt --adjacency labels.txt

# --- meshlets ---
expect 0 meshlets sphere.fct -o m.json --json
keys meshlets faces vertices mean_vertices mean_triangles vertex_fill triangle_fill mean_radius without_cone culled seconds
holds "$(value meshlets) >= 10 && $(value meshlets) <= 13 && $(value faces) == 960 && $(value culled) > .15"
count=$(value meshlets)
vertices=$(value vertices)
check "a line a meshlet" test "$(grep -c cone_cutoff m.json)" = "$count"
check "every face once" test "$(grep -o '"faces":\[[0-9,]*' m.json | sed 's/.*\[//' | tr ',' '\n' | sort -un | wc -l)" = 960
expect 0 meshlets sphere.fct -o m.bin
triangles=$(od -A n -t u4 -j 20 -N 4 m.bin | tr -d ' ')
check "magic" test "$(head -c 8 m.bin)" = FCTMLETS
check "counts" test "$(od -A n -t u4 -j 8 -N 12 m.bin | tr -s ' ')" = " 1 $count $vertices"
holds "$(stat -c %s m.bin) == 64 + $count * (16 + 128) + 4 * ($count + 1) + 4 * $vertices + $triangles + 4 * 960"
expect 0 meshlets sphere.fct -o - --quiet
check "JSON on standard output" cmp out m.json
expect 0 meshlets sphere.off -o m.ply --vertices 3 --triangles 1 --json
holds "$(value meshlets) == 960 && $(value vertex_fill) == 1"
expect 0 meshlets sphere.off -o m.glb --vertices 256 --triangles 512 --flatness 0
expect 0 info m.glb --json
holds "$(value faces) == 960"
for bad in '--vertices 2' '--vertices 257' '--triangles 0' '--triangles 513' '--flatness -1' '--vertices x'; do
    # shellcheck disable=SC2086 # two words
    expect 64 meshlets sphere.fct -o x.json $bad
done
expect 64 meshlets sphere.fct -o x.txt
says "expected a name"
expect 64 meshlets sphere.fct
expect 66 meshlets missing.fct -o x.json

# --- doubled vertices: the same clusters as with single ones ---
expect 0 make sphere --triangles 800 -o single.off
awk 'NR == 2 { n = $1; f = $2 } NR > 2 && NR <= n + 2 { p[NR - 3] = $0 }
    NR > n + 2 { for (i = 2; i <= 4; ++i) q[c++] = p[$i] }
    END { print "OFF"; print c, f, 0; for (i = 0; i < c; ++i) print q[i]; for (i = 0; i < f; ++i) print 3, 3 * i, 3 * i + 1, 3 * i + 2 }' \
    single.off >doubled.off
for how in '-k 20' '--charts 50' '-k 9 --refine 2'; do
    for mesh in single doubled; do
        # shellcheck disable=SC2086 # several words
        expect 0 partition $mesh.off $how -o $mesh.txt --adjacency $mesh-pairs.txt
    done
    check "$how: labels of doubled vertices" cmp single.txt doubled.txt
    check "$how: neighbours of doubled vertices" cmp single-pairs.txt doubled-pairs.txt
done
expect 0 meshlets single.off -o single.json --json
meshlets=$(value meshlets)
expect 0 meshlets doubled.off -o doubled.json --json
check "meshlets of doubled vertices" test "$(value meshlets)" = "$meshlets"
says "name one vertex per position"
expect 0 cluster doubled.off --no-weld -o doubled.fct
expect 0 partition doubled.fct --charts 50 -o labels.txt --json
check "--no-weld: each face is a chart" test "$(value charts)" = "$(sed -n 2p doubled.off | cut -d ' ' -f 2)"
expect 0 info doubled.fct --verify
expect 0 info doubled.fct --json
check "info: the choice of the weld" test "$(value weld)" = false
expect 64 info doubled.off --no-weld
cp doubled.off soup.off # no hierarchy file is beside it
printf '{"materials": {"light": {"emission": 1}}, "models": {"m": "soup.off"}, "instances": [{"model": "m", "material": "light"}, {"model": "m", "material": "light", "translate": [2.5, 0, 0]}]}' >scene.json
for how in '' --no-weld; do
    # shellcheck disable=SC2086 # nothing or a word
    expect 0 bake scene.json -o lit.ply --final none --error 1e-4 --json $how
    echo "$(value elements)" >"elements$how"
done
check "bake --no-weld: other clusters" sh -c '! cmp -s elements elements--no-weld'

# --- odd meshes: every face gets an answer ---
printf 'OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n' >one.off
printf 'OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 0\n3 0 1 2\n3 0 1 2\n3 0 1 1\n3 0 3 1\n' >odd.off
awk 'BEGIN { print "OFF"; print 202, 200, 0; print "0 0 0"; print "0 0 1"; for (i = 0; i < 200; ++i) print cos(i / 31.83), sin(i / 31.83), .5
    for (i = 0; i < 200; ++i) print 3, 0, 1, i + 2 }' >book.off
for mesh in one odd book; do
    faces=$(sed -n 2p $mesh.off | cut -d ' ' -f 2)
    for how in '--max-distance 0' '--max-distance 10%' '--charts 30' '--charts 0 --keep-cuts' '--charts 180 --any-topology'; do
        # shellcheck disable=SC2086 # several words
        expect 0 partition $mesh.off $how -o labels.txt --adjacency pairs.txt --json
        check "$mesh $how: a label a face" test "$(wc -l <labels.txt) $(sort -u labels.txt | wc -l)" = "$faces $(value clusters)"
    done
    expect 0 meshlets $mesh.off -o m.json --json
    check "$mesh: every face in a meshlet" test "$(value faces)" = "$faces"
done
expect 0 partition odd.off --charts 30 -o labels.txt --json
check "a face with two corners at one place is no disk" test "$(value non_disks)" = 2
expect 0 partition odd.off --charts 30 -o labels.txt --json --no-weld
check "a face with a vertex twice is no disk" test "$(value non_disks)" = 1
head -c 5000 sphere.fct >cut.fct
for command in 'partition cut.fct --charts 30 -o x.txt' 'partition cut.fct --max-distance 1 -o x.txt' 'meshlets cut.fct -o x.json'; do
    # shellcheck disable=SC2086 # words
    expect 65 $command
done
check "nothing is left of what failed" test ! -e x.txt -a ! -e x.json
for threads in 1 2 3; do
    expect 0 meshlets sphere.fct -o threads$threads.bin --threads $threads
    expect 0 partition sphere.fct --charts 25 -o threads$threads.txt --threads $threads
    check "the same bytes on $threads threads" cmp threads1.bin threads$threads.bin
    check "the same labels on $threads threads" cmp threads1.txt threads$threads.txt
done
leftovers
finish
