# tests/tools/test_levels.sh: progressive meshes: simplify --progressive and level.
source "$(dirname "$0")/support.sh"
sphere 20 >sphere.off
"$program" convert sphere.off -o sphere.ply --quiet
expect 0 simplify sphere.off --faces 60 -o small.ply --progressive sphere.fpm --json
holds "$(value faces_after) == 60"
expect 0 simplify sphere.off --faces 60 -o plain.ply
check "the log does not change the result" cmp -s small.ply plain.ply
holds "$(wc -c <sphere.fpm) < .6 * $(wc -c <sphere.ply)"
expect 0 level sphere.fpm --faces 301 -o level.ply --json
keys faces vertices least_faces most_faces total_faces splits max_cost seconds read level write total peak_bytes
holds "$(value faces) == 300 && $(value least_faces) == 60 && $(value most_faces) == 1520 && $(value total_faces) == 1520"
cp out level
expect 0 simplify sphere.off --faces 301 --refit 0 -o same.ply --json
check "the error of the level" test "$(value max_cost | cut -c 1-7)" = "$(value max_cost level | cut -c 1-7)"
expect 0 compare level.ply same.ply --json
holds "$(value e_max) < 1e-12"
expect 0 level sphere.fpm --ratio 1 -o all.ply
expect 0 compare all.ply sphere.ply --json
holds "$(value e_max) < 1e-12"
expect 0 level sphere.fpm --max-error .01 -o fine.ply --json
holds "$(value max_cost) <= .01 && $(value max_cost) > .005 && $(value faces) < 1520"
expect 0 level sphere.fpm --faces 10 -o least.ply
says "the coarsest level has 60 faces, 10 were asked for"
head -c 3000 sphere.fpm >part.fpm
expect 0 level part.fpm --faces 100 -o level.ply
says "truncated"
expect 0 level part.fpm --faces 1500 -o level.ply --json
says "were asked for"
holds "$(value faces) > 60 && $(value faces) < 1500"
expect 0 level - --faces 100 -o - <sphere.fpm
check "a PLY on standard output" test "$(head -c 3 out)" = ply
head -c 200 sphere.fpm >part.fpm
expect 65 level part.fpm --faces 100 -o x.ply
says "truncated in the base mesh"
expect 65 level sphere.off --faces 100 -o x.ply
says "no progressive mesh"
expect 66 level absent.fpm --faces 100 -o x.ply
expect 64 level sphere.fpm -o x.ply
says "expected --faces N, --ratio R, --max-error E or --view CAMERA"
expect 64 level sphere.fpm --faces 10 --ratio .5 -o x.ply
expect 64 level sphere.fpm --ratio 0 -o x.ply
expect 64 level sphere.fpm --faces 10 -o x.fpm
expect 64 simplify sphere.off --faces 10 -o x.ply --progressive x.ply
says "expected a name that ends in .fpm"
expect 73 simplify sphere.off --faces 10 -o x.ply --progressive absent/x.fpm
# view-dependent levels
camera=0,0,4,0,0,0,40
expect 0 level sphere.fpm --view $camera --tolerance 4 --silhouette 1 --size 800x600 -o view.ply --json
keys faces vertices least_faces most_faces total_faces splits pixels distance splits_done splits_forced seconds_hierarchy seconds_cut seconds read level write total peak_bytes
holds "$(value faces) > 60 && $(value faces) < 1520 && $(value pixels) > .4 && $(value pixels) <= 4"
holds "$(value splits_done) > $(value splits_forced) && $(value splits_done) < $(value splits)"
cp out view
"$program" info view.ply --json >out
holds "$(value boundary_edges) == 0 && $(value nonmanifold_edges) == 0 && $(value degenerate_faces) == 0"
holds "$(value faces) == $(value faces view)"
for options in "--tolerance 8 --silhouette 1" "--silhouette 4" "--size 400x300" "--back 1 --tolerance 1" "--up z --outside 1"; do
    expect 0 level sphere.fpm --view $camera --tolerance 4 --silhouette 1 --size 800x600 $options -o other.ply --json
    case $options in
    --back*) holds "$(value faces) > $(value faces view)" ;;
    --up*) holds "$(value faces) == $(value faces view)" ;;
    *) holds "$(value faces) < $(value faces view)" ;;
    esac
done
expect 0 level sphere.fpm --view 0,0,3,0,0,9,10 --tolerance 1 -o far.ply --json
cp out far
expect 0 level sphere.fpm --view 0,0,3,0,0,9,10 --tolerance 1 --outside inf -o far.ply --json
holds "$(value faces) == 60 && $(value faces far) > 60 && $(value pixels) == 0 && $(value distance) > .01"
expect 0 level sphere.fpm --view $camera --tolerance 0 -o all.ply
expect 0 compare all.ply sphere.ply --json
holds "$(value e_max) < 1e-12"
expect 0 level sphere.fpm --view $camera --tolerance inf -o least.ply --json
holds "$(value faces) == 60 && $(value pixels) > 4"
head -c 3000 sphere.fpm >part.fpm
expect 0 level part.fpm --view $camera --tolerance 0 -o level.ply
says "the file was truncated"
expect 64 level sphere.fpm --view 0,0,0,0,0,0 -o x.ply
says "with an eye away from its target"
expect 64 level sphere.fpm --view $camera --faces 100 -o x.ply
says "found several"
expect 64 level sphere.fpm --view $camera --tolerance 1 --silhouette 2 -o x.ply
says "expected at most the tolerance of 1, found 2"
expect 64 level sphere.fpm --view $camera --back .5 -o x.ply
expect 64 level sphere.fpm --view $camera --size 800 -o x.ply
says "expected WIDTHxHEIGHT"
expect 64 level sphere.fpm --faces 100 --tolerance 2 -o x.ply
says "--tolerance: expected --view with it"
# several levels in one run
expect 0 simplify sphere.off --levels .5,300,60 -o chain.ply --json
keys levels seconds total peak_bytes faces_before faces_after vertices stopped_because max_cost distance_rms distance_max color_rms uv_rms normal_rms file
holds "$("$program" info chain-1.ply --json | sed -n 's/.*"faces": \([0-9]*\).*/\1/p' | head -n 1) == 760"
expect 0 simplify sphere.off --ratio .5 -o half.ply
check "the first level is that of a run of its own" cmp -s half.ply chain-1.ply
expect 0 compare sphere.off chain-3.ply
expect 64 simplify sphere.off --levels 1.5 -o chain.ply
says "expected a number of faces or a ratio below 1"
expect 64 simplify sphere.off --levels 300 --faces 10 -o chain.ply
expect 64 simplify sphere.off --levels 300,60 -o -
says "found standard output"
expect 73 simplify sphere.off --levels 300,60 -o nowhere/chain.ply
expect 65 simplify sphere.off --levels 60,300 -o chain.ply
says "level 2 has 300 faces, expected fewer than the 60 of level 1"
leftovers
finish
