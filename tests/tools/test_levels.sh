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
# Three boxes in a row: edges alone keep them apart, pairs make one box of them, and the file holds all that.
awk 'BEGIN { for (i = 0; i < 3; ++i) for (k = 0; k < 8; ++k) print "v", 1.01 * i + k % 2, int(k / 2) % 2, int(k / 4)
    split("1 3 4 1 4 2 5 6 8 5 8 7 1 2 6 1 6 5 3 7 8 3 8 4 1 5 7 1 7 3 2 4 8 2 8 6", t, " ")
    for (i = 0; i < 3; ++i) for (k = 1; k < 36; k += 3) print "f", t[k] + 8 * i, t[k + 1] + 8 * i, t[k + 2] + 8 * i }' >row.obj
expect 0 simplify row.obj --faces 12 --pairs .01 -o row.ply --progressive row.fpm --json
keys pairs_found pairs_joined
holds "$(value pairs_found) == 8 && $(value pairs_joined) == 8 && $(value faces_after) == 12 && $(value distance_max) < 1e-6"
expect 0 simplify row.obj --faces 12 --pairs .009 -o apart.ply --json
holds "$(value pairs_found) == 0 && $(value pairs_joined) == 0"
expect 0 level row.fpm --ratio 1 -o all.ply
expect 0 compare all.ply row.obj --json
holds "$(value e_max) < 1e-12"
expect 0 level row.fpm --faces 12 -o least.ply
expect 0 compare least.ply row.ply --json
holds "$(value e_max) < 1e-5"
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
keys levels seconds total peak_bytes faces_before faces_after vertices stopped_because pairs_found pairs_joined max_cost distance_rms distance_max color_rms uv_rms normal_rms lost_area file
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
