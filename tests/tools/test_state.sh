# tests/tools/test_state.sh: simplify --save-state, --resume, --contour and --paint, each stop in a process of its own.
source "$(dirname "$0")/support.sh"
"$program" make terrain --triangles 60000 -o hill.ply --quiet
expect 0 simplify hill.ply --levels 30000,8000,1000 -o chain.ply
for threads in 1 3; do
    expect 0 simplify hill.ply --faces 30000 -o one.ply --save-state one.fst --threads $threads --json
    holds "$(value faces_after) <= 30000 && $(value faces_after) >= 29999"
    expect 0 simplify --resume one.fst --faces 8000 -o two.ply --save-state two.fst --threads $threads
    expect 0 simplify --resume two.fst --faces 1000 -o three.ply --save-state three-$threads.fst --threads $threads --json
    holds "$(value faces_before) == $("$program" info hill.ply --json | sed -n 's/.*"faces": \([0-9]*\).*/\1/p' | head -n 1)"
    check "the first level" cmp -s one.ply chain-1.ply
    check "the second level" cmp -s two.ply chain-2.ply
    check "the third level" cmp -s three.ply chain-3.ply
done
check "the same state" cmp -s three-1.fst three-3.fst
expect 0 simplify --resume one.fst --levels 8000,1000 -o rest.ply --save-state rest.fst
check "levels of a state" cmp -s rest-2.ply chain-3.ply
check "the state after levels" cmp -s rest.fst three-1.fst
expect 0 simplify --resume - --ratio .1 -o two.ply <one.fst
expect 0 simplify --resume one.fst --max-error 1e-9 -o two.ply --json
check "an error that stops" test "$(value stopped_because)" = error

# paint: of the input, and of the current mesh
vertices() { sed -n 's/element vertex //p' "$1" | head -n 1; }
weights() { awk -v n="$1" 'BEGIN { for (i = 0; i < n; ++i) print 1 }'; }
"$program" make sphere --triangles 20000 -o ball.ply --quiet
weights "$(vertices ball.ply)" >plain.txt
expect 0 simplify ball.ply --faces 1000 -o plain.ply
expect 0 simplify ball.ply --faces 1000 -o painted.ply --paint plain.txt
check "weights of 1 change nothing" cmp -s plain.ply painted.ply
"$program" convert ball.ply -o ball.off --quiet
awk 'FNR == 1 { next } FNR == 2 { n = $1; next } FNR <= n + 2 { print ($1 > 0 ? 64 : 1) }' ball.off >right.txt
right() { # the share of the vertices with x > 0
    "$program" convert "$1" -o share.off --quiet
    awk 'FNR == 2 { n = $1 } FNR > 2 && FNR <= n + 2 { k += $1 > 0 } END { print k / n }' share.off
}
expect 0 simplify ball.ply --faces 1000 -o painted.ply --paint right.txt
holds "$(right painted.ply) > .76 && $(right painted.ply) < .84"
expect 0 simplify ball.ply --faces 5000 -o ball5.ply --save-state ball.fst
"$program" convert ball5.ply -o ball5.off --quiet
awk 'FNR == 2 { n = $1 } FNR > 2 && FNR <= n + 2 { print ($1 > 0 ? 64 : 1) }' ball5.off >right5.txt
expect 0 simplify --resume ball.fst --faces 1000 -o painted.ply --paint right5.txt
holds "$(right painted.ply) > .76 && $(right painted.ply) < .84"
expect 65 simplify --resume ball.fst --faces 1000 -o painted.ply --paint right.txt
says "one per vertex of the current mesh"
echo 0 >zero.txt
expect 65 simplify ball.ply --faces 1000 -o painted.ply --paint zero.txt
says "zero.txt:1: expected a weight from 1e-6 to 1e6, found 0"

# contours: the row y = 1/2 of a flat grid
awk 'BEGIN { n = 20; print "OFF"; print (n + 1) ^ 2, 2 * n * n, 0
    for (j = 0; j <= n; ++j) for (i = 0; i <= n; ++i) print i / n, j / n, 0
    for (j = 0; j < n; ++j) for (i = 0; i < n; ++i) { a = j * (n + 1) + i; print 3, a, a + 1, a + n + 2; print 3, a, a + n + 2, a + n + 1 } }' >grid.off
awk 'BEGIN { n = 20; for (i = 0; i < n; ++i) print n / 2 * (n + 1) + i, n / 2 * (n + 1) + i + 1, "# an edge" }' >row.txt
expect 0 simplify grid.off --faces 12 -o held.off --contour row.txt
awk 'FNR == 2 { n = $1 } FNR > 2 && FNR <= n + 2 { k += ($2 == .5 && ($1 == 0 || $1 == 1)) } END { exit k != 2 }' held.off || fail "the ends of the contour stay"
expect 0 simplify grid.off --faces 12 -o loose.off
cmp -s held.off loose.off && fail "the contour has an effect"
echo 3 >bad.txt
expect 65 simplify grid.off --faces 12 -o held.off --contour bad.txt
echo "0 1.5" >bad.txt
expect 65 simplify grid.off --faces 12 -o held.off --contour bad.txt
says "bad.txt:1: expected a vertex number, found 1.5"
echo "0 9" >bad.txt
expect 65 simplify grid.off --faces 12 -o held.off --contour bad.txt
says "pair 0 of the contour is no edge of the input"

# mistakes
head -c 5000 one.fst >part.fst
expect 65 simplify --resume part.fst --faces 10 -o x.ply
says "truncated or damaged"
expect 65 simplify --resume hill.ply --faces 10 -o x.ply
says "no state of a simplification"
expect 66 simplify --resume absent.fst --faces 10 -o x.ply
expect 64 simplify --faces 10 -o x.ply
says "expected either IN or --resume STATE, found none"
expect 64 simplify hill.ply --resume one.fst --faces 10 -o x.ply
expect 64 simplify --resume one.fst -o x.ply
expect 64 simplify --resume one.fst --faces 10 --primitive face -o x.ply
says "the state has its own --primitive"
expect 64 simplify --resume one.fst --faces 10 --placement ends -o x.ply
says "the state has its own --placement"
expect 64 simplify --resume one.fst --faces 10 --flip-inward -o x.ply
expect 64 simplify --resume one.fst --faces 10 --progressive x.fpm -o x.ply
expect 64 simplify hill.ply --faces 10 -o x.ply --save-state x.ply
expect 64 simplify hill.ply --faces 10 -o x.fst
expect 73 simplify hill.ply --faces 10 -o x.ply --save-state nowhere/x.fst
leftovers
finish
