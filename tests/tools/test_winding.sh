# tests/tools/test_winding.sh: closed bodies that are wound inwards are reported and turned.
source "$(dirname "$0")/support.sh"
sphere 8 >outward.off
awk 'NF == 4 { print $1, $2, $4, $3; next } { print }' outward.off >inward.off

expect 0 info outward.off --json
check "outward" test "$(value inward_bodies)" = 0
expect 0 info inward.off --json
check "inward" test "$(value inward_bodies)" = 1
for how in 'convert -o turned.off' 'simplify --ratio 1 -o turned.off' 'cluster -o turned.fct'; do
    # shellcheck disable=SC2086 # several words
    expect 0 $how inward.off --flip-inward
    case $how in cluster*) expect 0 convert turned.fct -o turned.off ;; esac
    expect 0 info turned.off --json
    check "$how: turned" test "$(value inward_bodies)" = 0
    expect 0 compare turned.off outward.off --json
    holds "$(value e_max) < 1e-9"
done
expect 0 convert outward.off --flip-inward -o same.off
expect 0 convert outward.off -o plain.off
check "outward bodies stay" cmp same.off plain.off
expect 64 info inward.off --flip-inward

# Every command that builds or opens a tree of a model tells it, also of a hierarchy file.
echo '0 0 5 0 0 -1' >rays.txt
expect 0 cluster inward.off -o inward.fct
says "inward.off: the surface is closed and wound inwards"
expect 0 cluster outward.off -o outward.fct
expect 0 info inward.fct --verify --json
check "a hierarchy file holds the winding" test "$(value inward)" = true
for ending in off fct; do
    for how in 'boxes -k 9 -o x.json' 'meshlets -o x.json' 'raycast --rays rays.txt -o x.txt'; do
        # shellcheck disable=SC2086 # several words
        expect 0 $how inward.$ending
        says "inward.$ending: the surface is closed and wound inwards"
        # shellcheck disable=SC2086 # several words
        expect 0 $how outward.$ending
        check "$how: nothing is wound inwards" sh -c '! grep -q "wound inwards" err'
    done
done
expect 64 info inward.off --flip-inward
says "unknown option '--flip-inward'"

# A lamp in a room, beside a ball that is wound inwards.
cat >scene.json <<'END'
{"models": {"room": "inward.off", "ball": "inward.off", "lamp": "outward.off"},
 "materials": {"grey": {"reflectance": [0.5, 0.5, 0.5]}, "light": {"reflectance": [0, 0, 0], "emission": [1, 1, 1]}},
 "instances": [{"name": "room", "model": "room", "material": "grey", "scale": 10},
               {"name": "ball", "model": "ball", "material": "grey", "translate": [3, 0, 0]},
               {"name": "lamp", "model": "lamp", "material": "light", "translate": [-3, 0, 0]}]}
END
expect 0 info scene.json --json
check "models that are wound inwards" test "$(value inward_models)" = 2
expect 0 bake scene.json -o lit/ --final direct --error 1e-3
says '1 closed object is wound inwards, such as "ball"'
sed 's/"room": "inward.off", //; s/{"name": "room".*/{"name": "far", "model": "lamp", "material": "light", "translate": [0, 9, 9]},/' scene.json >free.json
expect 0 bake free.json -o lit/ --final direct --error 1e-3
says '1 closed object is wound inwards, such as "ball"'
expect 0 info lit/ball.ply --json
check "the bake keeps the winding" test "$(value inward_bodies)" = 1
expect 0 bake free.json -o lit/ --final direct --error 1e-3 --flip-inward
check "nothing is wound inwards" sh -c '! grep -q "wound inwards" err'
expect 0 info lit/ball.ply --json
check "the bake turns the ball" test "$(value inward_bodies)" = 0
sed 's/inward.off/inward.fct/' free.json >tree.json
expect 0 bake tree.json -o lit/ --final direct --error 1e-3
says '1 closed object is wound inwards, such as "ball"'
expect 0 bake tree.json -o lit/ --final direct --error 1e-3 --flip-inward
expect 0 info lit/ball.ply --json
check "the bake turns a tree" test "$(value inward_bodies)" = 0
leftovers
finish
