# tests/tools/test_large.sh: inputs on which quadratic algorithms hang. Each command must end with the right answer.
source "$(dirname "$0")/support.sh"
[ "$scale" = 1 ] && many=1000000 fan=100000 || { many=$((1000000 / scale)); fan=$((100000 / scale)); }
printf '0 0 9 0 0 -1\n' >rays.txt

through() {
    local file=$1 faces=$2 rays=$3 # every ray near a fan's middle meets all of its triangles
    expect 0 cluster "$file" -o large.fct --json
    holds "$(value faces) == $faces && $(value roots) == 1 && $(value depth) <= 3 * log($faces) / log(2) + 1"
    echo "$file: $(value total) s to cluster"
    expect 0 info large.fct --verify --json
    expect 0 partition large.fct -k 100 -o labels.txt
    check "100 clusters" test "$(sort -u labels.txt | wc -l)" = 100
    expect 0 raycast large.fct --check --count $rays --json
    holds "$(value unexplained) == 0"
    expect 0 simplify "$file" --ratio .5 -o large.ply --json
    rm -f large.*
}

# One edge shared by many triangles.
awk -v n=$fan 'BEGIN { print "OFF"; print n + 2, n, 0; print "0 0 0"; print "0 0 1"
    for (i = 0; i < n; ++i) print cos(6.2831853 * i / n), sin(6.2831853 * i / n), .5
    for (i = 0; i < n; ++i) print 3, 0, 1, i + 2 }' >edge.off
through edge.off $fan 300
# A vertex of high valence.
awk -v n=$fan 'BEGIN { print "OFF"; print n + 1, n, 0; print "0 0 1"
    for (i = 0; i < n; ++i) print cos(6.2831853 * i / n), sin(6.2831853 * i / n), 0
    for (i = 0; i < n; ++i) print 3, 0, i + 1, (i + 1) % n + 1 }' >fan.off
through fan.off $fan 300
# A strip: a chain of neighbours.
awk -v n=$fan 'BEGIN { print "OFF"; print n + 2, n, 0; for (i = 0; i < n + 2; ++i) print int(i / 2), i % 2, 0
    for (i = 0; i < n; ++i) print 3, i, i + 1, i + 2 }' >strip.off
through strip.off $fan 20000
# Triangles without neighbours.
awk -v n=$many 'BEGIN { print "OFF"; print 3 * n, n, 0; side = int(n ^ (1 / 3)) + 1
    for (i = 0; i < n; ++i) { x = i % side; y = int(i / side) % side; z = int(i / side / side)
        print x, y, z; print x + .5, y, z; print x, y + .5, z }
    for (i = 0; i < n; ++i) print 3, 3 * i, 3 * i + 1, 3 * i + 2 }' >soup.off
through soup.off $many 20000
# A mesh that does not fit is clustered in parts, with an equally good tree. The whole process obeys the limit.
parts() {
    expect 0 make terrain --triangles 1000000 -o sheet.ply --max-memory 40M
    expect 0 cluster sheet.ply -o whole.fct --json
    holds "$(value parts) == 1"
    expect 0 cluster sheet.ply -o parts.fct --max-memory 100M --json
    holds "$(value parts) > 1 && $(value peak_bytes) < 100 * 1048576 && $(value roots) == 1"
    holds "$(value depth) <= 3 * log($(value faces)) / log(2)"
    expect 0 info parts.fct --verify --json
    holds "$(value boundary_edges) == 2828 && $(value components) == 1"
    for k in 1000 20000; do
        expect 0 partition whole.fct -k $k -o labels.txt --json
        local fit=$(value mean_fit) direction=$(value mean_direction) irregularity=$(value mean_irregularity)
        expect 0 partition parts.fct -k $k -o labels.txt --json
        holds "$(value mean_fit) < 1.05 * $fit && $(value mean_direction) < 1.05 * $direction"
        holds "$(value mean_irregularity) < 1.05 * $irregularity"
    done
    mkdir folder
    expect 0 cluster sheet.ply -o again.fct --max-memory 100M --temporary folder --threads 1
    check "the same bytes" cmp parts.fct again.fct
    expect 73 cluster sheet.ply -o again.fct --max-memory 100M --temporary nowhere
    expect 75 cluster sheet.ply -o again.fct --max-memory 20M
    says "needs at least"
    check "nothing is left" test -z "$(ls folder)"
    check "the old file" cmp parts.fct again.fct
    # Doubled vertices are joined, as in memory.
    expect 0 make sphere --triangles 200000 -o ball.off
    awk 'NR == 2 { n = $1; f = $2 } NR > 2 && NR <= n + 2 { p[NR - 3] = $0 }
        NR > n + 2 { for (i = 2; i <= 4; ++i) q[c++] = p[$i] }
        END { print "OFF"; print c, f, 0; for (i = 0; i < c; ++i) print q[i]; for (i = 0; i < f; ++i) print 3, 3 * i, 3 * i + 1, 3 * i + 2 }' \
        ball.off >torn.off
    expect 0 cluster torn.off -o parts.fct --max-memory 50M --json
    holds "$(value parts) > 1"
    expect 0 info parts.fct --verify --json
    check "doubled vertices in parts" test "$(value boundary_edges) $(value components) $(value weld)" = "0 1 true"
    expect 0 cluster torn.off -o parts.fct --max-memory 50M --no-weld
    expect 0 info parts.fct --json
    check "--no-weld in parts" test "$(value components)" = 200000
    rm -f ball.off torn.off
    # An edge that all faces share takes more than the estimate.
    awk -v n=200000 'BEGIN { print "OFF"; print n + 2, n, 0; print 0, 0, 0; print 0, 0, 1
        for (i = 0; i < n; ++i) print cos(i / 10000) * (1 + i % 7 / 10), sin(i / 10000), i % 13 / 100
        for (i = 0; i < n; ++i) print 3, 0, 1, i + 2 }' >book.off
    expect 0 cluster book.off -o parts.fct --max-memory 56M --json
    holds "$(value parts) > 1 && $(value faces) == 200000"
    rm -f sheet.ply whole.fct parts.fct again.fct book.off
}
[ "$scale" != 1 ] || parts
# A memory limit gives an exit code, not a crash.
expect 75 cluster soup.off -o limited.fct --max-memory 20M
check "no output" test ! -e limited.fct
expect 75 simplify soup.off --ratio .5 -o limited.ply --max-memory 20M
leftovers
finish
