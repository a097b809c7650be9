# tests/tools/test_commands.sh: the answers of each command: files, JSON keys, standard input and output.
source "$(dirname "$0")/support.sh"
cube 2 >cube.off
sphere 16 >sphere.off # 2 * 32 * 15 = 960 faces
grid 8 '.1 * x * y' >grid.off

# --- cluster, info ---
expect 0 cluster sphere.off -o sphere.fct --json
keys faces vertices roots depth mean_depth seconds read dual contract boxes write total peak_bytes file_bytes
holds "$(value faces) == 960 && $(value vertices) == 482 && $(value roots) == 1"
holds "$(value depth) <= 30 && $(value mean_depth) >= 9 && $(value peak_bytes) > 1000000"
holds "$(value file_bytes) == $(stat -c %s sphere.fct)"
expect 0 info sphere.fct --verify --json
keys faces vertices boundary_edges nonmanifold_edges components depth source build verified
holds "$(value faces) == 960 && $(value boundary_edges) == 0 && $(value components) == 1"
check "the source is recorded" test "$(value source)" = sphere.off
expect 0 info sphere.fct
check "info prints lines" grep -qE '^faces +960$' out
expect 0 info grid.off --json
holds "$(value faces) == 128 && $(value boundary_edges) == 32 && $(value boundary_loops) == 1"
expect 0 cluster sphere.off -o roots.fct --roots 7 --cost mean --fit 2 --direction 1 --shape .5 --fit-measure points --json
holds "$(value roots) == 7"
expect 0 info roots.fct --json
check "the options of the build are recorded" test "$(value cost) $(value fit_measure) $(value fit) $(value shape)" = "mean points 2.0 0.5"
for method in greedy rounds; do
    expect 0 cluster sphere.off -o method.fct --method $method
    expect 0 info method.fct --json
    check "the method is recorded" test "$(value method)" = $method
done
expect 0 cluster sphere.off -o quiet.fct --quiet
check "--quiet says nothing" test ! -s out -a ! -s err
expect 0 cluster sphere.off -o progress.fct --progress
check "--progress shows a bar" grep -q '\[#' err

# The outputs of several files and folders go to a folder.
mkdir in
cp cube.off grid.off in
cp sphere.off in/ball.off
echo text >in/notes.txt
expect 0 cluster in -o trees --json
keys faces files peak_bytes total
holds "$(value faces) == 12 + 128 + 960"
check "a hierarchy for each mesh" test "$(ls trees | tr '\n' ' ')" = "ball.fct cube.fct grid.fct "
expect 0 cluster sphere.off -o ball.fct
check "the same bytes as one by one, but for the name" test "$(stat -c %s ball.fct)" -ge "$(stat -c %s trees/ball.fct)"
expect 0 cluster cube.off grid.off -o both/
for tree in trees/*.fct both/*.fct; do expect 0 info "$tree" --verify; done
expect 64 cluster in/cube.off cube.off -o both
says "would both be written to"
mkdir empty
expect 66 cluster empty -o both
echo nonsense >in/bad.off
expect 65 cluster in -o trees
check "the bad file is named" grep -q 'in/bad.off' err

# --- partition, boxes ---
for k in 1 2 17 960; do
    expect 0 partition sphere.fct -k $k -o labels.txt --json
    keys clusters mean_fit mean_direction mean_irregularity connected
    holds "$(value clusters) == $k"
    check "connected clusters" test "$(value connected)" = true
    check "$k labels on 960 lines" test "$(wc -l <labels.txt) $(sort -u labels.txt | wc -l)" = "960 $k"
done
expect 0 partition sphere.off -k 5 -o -
check "labels on standard output and words on stderr" test "$(wc -l <out)" = 960 -a -s err
sort -u out >labels
check "labels count from 0" test "$(tr '\n' ' ' <labels)" = "0 1 2 3 4 "
expect 0 partition sphere.fct --max-cost 0 -o labels.txt --json
holds "$(value clusters) >= 1 && $(value clusters) <= 960"
for ending in ply off glb obj; do
    expect 0 partition sphere.fct -k 9 -o parts.$ending
    expect 0 info parts.$ending --json
    holds "$(value faces) == 960"
done
expect 0 info parts.glb --json
check "vertices have colours" test "$(value vertex_colors)" = true
expect 0 info parts.ply --json
check "faces have colours" test "$(value face_colors)" = true
expect 0 partition sphere.fct -k 20 -o cut.txt --json
cut=$(value mean_normal_deviation)
expect 0 partition sphere.fct -k 20 --refine 4 -o refined.txt --json
keys clusters mean_normal_deviation box_area sweeps moves seconds before
refined=$(value mean_normal_deviation)
holds "$refined < $cut && $(value moves) > 0"
holds "$(value mean_irregularity) <= $(sed -n '/"before"/,$p' out | value mean_irregularity /dev/stdin)"
check "20 labels on 960 lines" test "$(wc -l <refined.txt) $(sort -u refined.txt | wc -l)" = "960 20"
check "other labels than the cut's" test "$(cmp -s cut.txt refined.txt; echo $?)" = 1
expect 0 partition sphere.fct -k 20 --refine 4 --perimeter 0 --irregularity inf -o freely.txt --json
holds "$(value mean_normal_deviation) < $refined"
expect 0 partition sphere.fct -k 20 --refine 0 -o same.txt --quiet
check "no sweep, no change" cmp -s cut.txt same.txt
expect 0 partition sphere.fct -k 20 --refine 4 -o refined.glb
expect 0 info refined.glb --json
holds "$(value faces) == 960"
expect 0 boxes sphere.fct -k 6 -o boxes.json
check "boxes tell their geometry" grep -q half_extents boxes.json
check "six boxes" test "$(grep -c '"center"' boxes.json)" = 6
expect 0 boxes sphere.fct -k 6 --json
keys clusters boxes center axes half_extents plane area faces
expect 0 boxes sphere.fct -k 6
check "JSON on standard output" grep -q '"boxes"' out
expect 0 boxes sphere.fct -k 6 -o boxes.ply
expect 0 info boxes.ply --json
holds "$(value faces) == 72 && $(value vertices) == 48 && $(value boundary_edges) == 0 && $(value misoriented_edges) == 0"

# --- raycast, closest ---
: >none.txt
cat >rays.txt <<'END'
# from outside, from inside, beside, too short, beginning behind
.1 .2 5  0 0 -1
0 .1 .2  1 0 0 # a comment
5 5 5  0 0 1

.1 .2 5  0 0 -1  0 3
.1 .2 5  0 0 -2  2.5 inf
END
expect 0 raycast cube.off --rays rays.txt
awk '{ print ($1 < 0 ? "miss" : $2) }' out | tr '\n' ' ' >ts
check "closest hits of a cube" test "$(cat ts)" = "4 1 miss miss 3 "
cp out obb.txt
expect 0 raycast cube.off --rays - -o hits.txt --backend embree <rays.txt
check "both backends hit the same faces" test "$(cut -d " " -f 1 hits.txt)" = "$(cut -d " " -f 1 obb.txt)"
expect 0 raycast cube.off --rays rays.txt --occlusion
check "occlusion" test "$(tr '\n' ' ' <out)" = "1 1 0 0 1 "
expect 0 raycast cube.off --rays rays.txt --json
keys rays hits seconds
holds "$(value rays) == 5 && $(value hits) == 3"
expect 0 raycast cube.off --rays rays.txt --all
check "all hits of a cube" test "$(awk '{ print $1 ":" ($2 < 0 ? "miss" : $3) }' out | tr '\n' ' ')" = "0:4 0:6 1:1 2:miss 3:miss 4:3 "
cp out all.txt
check "the first of all hits is the closest" cmp -s <(awk '$1 != p { p = $1; $1 = ""; print substr($0, 2) }' p=-1 all.txt) obb.txt
expect 0 raycast cube.off --rays rays.txt --all --json
keys rays hits rays_hit seconds
holds "$(value rays) == 5 && $(value hits) == 4 && $(value rays_hit) == 3"
expect 0 raycast cube.off --rays none.txt --all
check "no rays, no hits" test ! -s out
# A pile of 300 squares: a chunk has no room for the hits of one ray, and few rays fit one text.
awk 'BEGIN { print "OFF"; print 1200, 300, 0; for (i = 0; i < 300; ++i) { z = i * 7 % 300
    print 0, 0, z; print 1, 0, z; print 1, 1, z; print 0, 1, z } for (i = 0; i < 300; ++i) print 4, 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3 }' >pile.off
awk 'BEGIN { for (i = 0; i < 500; ++i) print .1 + i / 1000, .05, i % 2 ? -1 : 9, 0, 0, i % 3 ? 1 : -1, 0, i % 97 ? 100.5 : "inf" }' >many.txt
expect 0 raycast pile.off --rays many.txt --all -o pile.txt
expect 0 raycast pile.off --rays many.txt --all -o one.txt --threads 1
check "all hits on every number of threads" cmp pile.txt one.txt
awk '{ up = $6 > 0; last = $8 == "inf" ? 1e9 : $8; start = $3; any = 0
    for (k = 0; k < 300; ++k) { z = up ? k : 299 - k; t = up ? z - start : start - z; if (t >= 0 && t <= last) { print NR - 1, t; any = 1 } }
    if (!any) print NR - 1, "miss" }' many.txt >wanted.txt
check "each square of the pile is hit in order" cmp -s <(awk '{ print $1, ($2 < 0 ? "miss" : $3) }' pile.txt) wanted.txt
# Attributes: linear fields on a square. The mesh has no normals.
cat >field.obj <<'END'
v 0 0 0 1 0 0
v 2 0 0 0 1 0
v 2 2 0 0 0 1
v 0 2 0 1 1 1
vt 0 0
vt 1 0
vt 1 .5
vt 0 .5
vn 1 0 1
vn 0 0 1
f 1/1/1 2/2/2 3/3/2
f 1/1/2 3/3/2 4/4/1
END
echo '1.5 .5 3 0 0 -2' >field-ray.txt
expect 0 raycast field.obj --rays field-ray.txt --attributes normal,uv,color
holds "$(awk '{ print NF == 12 && $1 == 0 && $2 == 1.5 && ($5 - .242536) ^ 2 < 1e-10 && $6 == 0 && ($7 - .970143) ^ 2 < 1e-10 }' out)"
holds "$(awk '{ print $8 == .75 && $9 == .125 && $10 == .25 && $11 == .5 && $12 == .25 }' out)"
expect 0 raycast field.obj --rays field-ray.txt --attributes uv --all
check "attributes of all hits" test "$(cut -d " " -f 1,6,7 out)" = "0 .75 .125" -o "$(cut -d " " -f 1,6,7 out)" = "0 0.75 0.125"
expect 65 raycast cube.off --rays rays.txt --attributes normal
says "cube.off: expected normals for --attributes, found none"
expect 65 raycast sphere.fct --rays rays.txt --attributes color,uv
says "sphere.fct: expected"
expect 0 raycast sphere.fct --check --json
keys rays hits differences explained unexplained seconds obb embree
holds "$(value rays) == 1000000 && $(value unexplained) == 0 && $(value hits) > 100000"
expect 0 raycast cube.off --check --rays rays.txt --json
holds "$(value rays) == 5 && $(value unexplained) == 0"
for bad in '0 0 0 1 1' '0 0 0 1 1 1 0 1 2' '0 0 x 1 1 1' '0 0 nan 1 1 1' 'inf 0 0 1 0 0' '1e99 0 0 1 0 0' '0 0 0 1 0 0 nan'; do
    printf '0 0 0 1 0 0\n%s\n' "$bad" >bad.txt
    expect 65 raycast cube.off --rays bad.txt
    says "bad.txt:2: expected"
done
expect 66 raycast cube.off --rays missing.txt
expect 0 raycast cube.off --rays none.txt
check "no rays, no hits" test ! -s out
printf '3 0 0\n0.9 0 0\n' >points.txt
expect 0 closest cube.off --points points.txt
check "nearest points of a cube" test "$(awk '{ print $2, $3, $4, $5 }' out | head -n 1)" = "1 0 0 2"
holds "$(awk 'NR == 2 { print $5 }' out) > .0999 && $(awk 'NR == 2 { print $5 }' out) < .1001"
expect 0 closest cube.off --points points.txt --max-distance 1 -o near.txt
check "-1 where nothing is near" test "$(head -n 1 near.txt)" = -1
expect 0 closest cube.off --points points.txt --signed
holds "$(awk 'NR == 1 { print $5 }' out) == 2"
holds "$(awk 'NR == 2 { print $5 }' out) < -.0999 && $(awk 'NR == 2 { print $5 }' out) > -.1001"
expect 0 closest cube.off --points points.txt --signed --max-distance 1 --json
keys points found inside seconds
holds "$(value points) == 2 && $(value found) == 1 && $(value inside) == 1"
printf '1 2\n' >bad.txt
expect 65 closest cube.off --points bad.txt
says "bad.txt:1: expected 3 numbers, found 2"

# --- compare, simplify ---
expect 0 compare sphere.off sphere.off --json
keys e_avg e_max e_avg_ab e_avg_ba e_max_ab e_max_ba diameter color_rms color_max
holds "$(value e_avg) < 1e-12 && $(value e_max) < 1e-6 && $(value diameter) > 3.4 && $(value diameter) < 3.5"
awk 'NR > 2 && NF == 3 { $3 += .25 } { print }' grid.off >raised.off
expect 0 compare grid.off raised.off --json --samples 10
holds "$(value e_avg) > .05 && $(value e_avg) < .0626 && $(value e_max) <= .25001 && $(value e_max) > .2499"
expect 0 simplify sphere.off --faces 100 -o small.ply --json
keys faces_before faces_after stopped_because pairs_found pairs_joined max_cost seconds init contract total peak_bytes
holds "$(value faces_before) == 960 && $(value faces_after) <= 100 && $(value faces_after) >= 98"
check "it says why it stopped" test "$(value stopped_because)" = faces
expect 0 simplify sphere.off --faces 100 -o faces.ply --primitive face --json
holds "$(value faces_after) <= 100 && $(value faces_after) >= 97"
check "faces and edges give different meshes" sh -c '! cmp -s small.ply faces.ply'
expect 0 simplify sphere.fct --ratio .25 -o quarter.off --placement subset --refit 0 --keep-topology
expect 0 info quarter.off --json
holds "$(value faces) <= 240 && $(value faces) >= 238 && $(value boundary_edges) == 0"
expect 0 compare sphere.off quarter.off --json
holds "$(value e_max_ab) < .1"
expect 0 simplify sphere.off --max-error .01 -o fine.obj --json
check "it stops at the error" test "$(value stopped_because)" = error
holds "$(value max_cost) <= .01 && $(value faces_after) < 960"
expect 0 simplify grid.off --faces 40 --lock-border -o fixed.off
expect 0 info fixed.off --json
holds "$(value faces) <= 40 && $(value boundary_edges) == 32"
expect 0 simplify grid.off --faces 40 -o free.off
expect 0 info free.off --json
holds "$(value boundary_edges) < 32"
for weights in area angle uniform; do
    expect 0 simplify sphere.off --faces 200 --weights $weights -o $weights.off
    expect 0 compare sphere.off $weights.off --json
    holds "$(value e_max) < .1"
done
check "weights change the result" test "$(cat area.off angle.off uniform.off | sort -u | wc -l)" -gt "$(sort -u area.off | wc -l)"
expect 65 simplify sphere.off --faces 10 --attributes color -o x.ply
says "expected the attribute color"
expect 0 simplify - --faces 20 -o - <small.ply
check "a PLY on standard output" test "$(head -c 3 out)" = ply
leftovers
finish
