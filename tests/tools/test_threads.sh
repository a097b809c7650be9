# tests/tools/test_threads.sh: every number of threads and every run give the same bytes.
source "$(dirname "$0")/support.sh"
[ "$scale" = 1 ] && rings=24 error=1e-4 || rings=8 error=1e-3 # instrumented code is slow
sphere $rings | awk 'NF == 3 && NR > 2 { r = 1 + .05 * sin(40 * $1) * sin(31 * $2) * cos(23 * $3); print r * $1, r * $2, r * $3; next } { print }' >bumpy.off
cube 4 | awk 'NF == 4 { print $1, $2, $4, $3; next } { print }' >room.off
cube 1 >lamp.off
cat >scene.json <<'END'
{"models": {"room": "room.off", "ball": "bumpy.off", "lamp": "lamp.off"},
 "materials": {"wall": {"reflectance": [0.7, 0.6, 0.5]}, "grey": {"reflectance": [0.5, 0.5, 0.5]},
               "light": {"reflectance": [0.1, 0.1, 0.1], "emission": [8, 7, 6]}},
 "instances": [{"name": "room", "model": "room", "material": "wall"},
               {"name": "ball", "model": "ball", "material": "grey", "translate": [0, 0, -0.7]},
               {"name": "lamp", "model": "lamp", "material": "light", "translate": [0, 0, 1.6], "scale": 0.3}]}
END
awk 'BEGIN { for (i = 0; i < 300; ++i) printf "1 0 0 %.6f 0 1 0 %.6f 0 0 1 %.6f\n", 2 * sin(i), cos(3 * i), sin(7 * i) }' >poses.txt
for threads in 1 2 5; do
    expect 0 collide bumpy.off bumpy.off --poses poses.txt -o $threads-touching.txt --threads $threads
    expect 0 cluster bumpy.off -o $threads.fct --threads $threads --quiet
    expect 0 simplify bumpy.off --ratio .1 -o $threads.ply --threads $threads --quiet
    expect 0 bake scene.json -o $threads.glb --error $error --threads $threads --quiet
    expect 0 simplify $threads.glb --ratio .2 -o $threads-lit.ply --progressive $threads-lit.fpm --threads $threads --quiet
    expect 0 compare bumpy.off 1.ply --threads $threads
    cp out $threads.txt
    sed -i '/^seconds/d' $threads.txt
done
for threads in 2 5; do
    for file in .fct .ply .glb -lit.ply -lit.fpm .txt -touching.txt; do
        check "$threads threads make the same $file as one" cmp -s 1$file $threads$file
    done
done
expect 0 bake scene.json -o again.glb --error $error --quiet
check "a second run makes the same bytes" cmp -s 1.glb again.glb
expect 0 bake scene.json -o seed.glb --error $error --seed 7 --quiet
check "another seed makes others" test "$(cmp -s 1.glb seed.glb; echo $?)" = 1
if [ -e "$data/stanford-bunny.obj" ] && [ "$scale" = 1 ]; then
    for threads in 1 2; do
        expect 0 cluster "$data/stanford-bunny.obj" -o bunny$threads.fct --threads $threads --quiet
        expect 0 simplify "$data/stanford-bunny.obj" --ratio .1 -o bunny$threads.ply --threads $threads --quiet
    done
    check "the bunny's hierarchy" cmp -s bunny1.fct bunny2.fct
    check "the bunny's tenth" cmp -s bunny1.ply bunny2.ply
    # Several files over all cores make the same files as one after the other.
    mkdir in && cp bumpy.off room.off lamp.off in
    expect 0 cluster in -o many --quiet
    expect 0 cluster in -o alone --threads 1 --quiet
    for file in many/*.fct; do check "$file" cmp -s "$file" "alone/${file#many/}"; done
fi
leftovers
finish
