# tests/tools/test_figures.sh: figures that the commands compute themselves, against closed forms.
source "$(dirname "$0")/support.sh"

# Two parallel squares: the distance is .25 everywhere, the diameter is the root of 2.
grid 4 >flat.off
grid 4 .25 >raised.off
expect 0 compare flat.off raised.off --samples 5 --json
holds "($(value e_avg) - .0625) ^ 2 < 1e-12 && ($(value e_max) - .25) ^ 2 < 1e-12"
holds "($(value diameter) - sqrt(2)) ^ 2 < 1e-12"
holds "($(value e_avg_relative) - .03125) ^ 2 < 1e-12 && ($(value e_max_relative) - .25 / sqrt(2)) ^ 2 < 1e-12"

# A cone of the cutoff c culls its triangles for the share (1 - c) / 2 of all directions.
sphere 16 >sphere.off
expect 0 cluster sphere.off -o sphere.fct
expect 0 meshlets sphere.fct -o meshlets.json --json
culled=$(value culled)
want=$(awk '/"cone_cutoff"/ {
    cutoff = $0; sub(/.*"cone_cutoff":/, "", cutoff); sub(/,.*/, "", cutoff)
    faces = $0; sub(/.*"faces":\[/, "", faces); sub(/].*/, "", faces); count = gsub(/,/, ",", faces) + 1
    sum += count * .5 * (1 - (cutoff < 1 ? cutoff : 1)); all += count
} END { printf "%.9f", sum / all }' meshlets.json)
holds "($culled - $want) ^ 2 < 1e-12 && $culled > .1"

# D% is a share of the diagonal, which is 2 sqrt(3) for the bounds of this sphere.
expect 0 partition sphere.fct --max-distance 1% -o percent.txt --quiet
expect 0 partition sphere.fct --max-distance .034641016 -o length.txt --quiet
check "1% of the diagonal" cmp -s percent.txt length.txt
expect 0 partition sphere.fct --max-distance .036 -o longer.txt --quiet
check "another length gives another cut" test "$(cmp -s percent.txt longer.txt; echo $?)" = 1

# Sizes: K, M and G are powers of 1024.
expect 75 cluster sphere.off -o out.fct --max-memory 1K
says "--max-memory 1024 bytes"
expect 75 cluster sphere.off -o out.fct --max-memory 1.5M
says "--max-memory 1572864 bytes"
finish
