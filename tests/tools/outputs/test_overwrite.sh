# tests/tools/outputs/test_overwrite.sh: an output is never an input by mistake, has the kind of its name, and no message goes into it.
source "$(dirname "$0")/../support.sh"
cube 1 >cube.off
cp cube.off copy.off
ln copy.off hard.off
ln -s copy.off soft.off
mkdir sub
printf '0 0 9 0 0 -1\n' >rays.txt
printf '0 0 9\n' >points.txt
echo 1 0 0 0 0 1 0 0 0 0 1 0 >poses.txt

# kept FILE COMMAND...: the command is refused, names --in-place, and leaves the file.
kept() {
    local file=$1
    shift
    cp "$file" before
    expect 64 "$@"
    says "--in-place"
    check "$file is as before: $*" cmp -s "$file" before
}
for name in copy.off ./copy.off sub/../copy.off hard.off soft.off "$here/copy.off"; do
    kept copy.off simplify copy.off --faces 6 -o "$name"
    kept copy.off partition copy.off -k 2 -o "$name"
    kept copy.off boxes copy.off -k 2 -o "$name"
done
kept copy.off bake copy.off -o copy.off
kept copy.off bake copy.off -o new.ply --also copy.off
kept rays.txt raycast cube.off --rays rays.txt -o rays.txt
kept poses.txt collide cube.off cube.off --poses poses.txt -o poses.txt
kept points.txt closest cube.off --points points.txt -o ./points.txt
expect 0 cluster cube.off -o cube.fct
kept cube.fct cluster cube.fct -o cube.fct
kept cube.fct cluster cube.fct -o ./
check "nothing was written" test ! -e new.ply
expect 0 simplify copy.off --faces 6 -o soft.off --in-place
check "the link is still a link" test -L soft.off
expect 0 info copy.off --json
holds "$(value faces) == 6"
expect 0 info hard.off --json
holds "$(value faces) == 12"
expect 64 bake cube.off -o x.ply --also ./x.ply
expect 64 partition cube.off -k 2 -o x.txt --adjacency sub/../x.txt

# The files that a scene names are inputs too.
mkdir scene
cp cube.off scene/room.off
"$program" make sphere -o scene/ball.ply --triangles 80 --inside --quiet
cat >scene/scene.json <<'END'
{"models": {"ball": "ball.ply", "box": "room.off"},
 "materials": {"lamp": {"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}},
 "instances": [{"name": "ball", "model": "ball", "material": "lamp"},
               {"name": "box", "model": "box", "material": "lamp", "scale": 0.1}]}
END
kept scene/room.off bake scene/scene.json -o scene/room.off
kept scene/ball.ply bake scene/scene.json -o x.glb --also scene/ball.ply
kept scene/ball.ply bake scene/scene.json -o scene/
expect 0 cluster scene/ball.ply -o scene/ball.fct
kept scene/ball.fct cluster scene/ball.fct -o scene/ball.fct
printf 'mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n' >room.obj
printf 'newmtl a\nKd .5 .5 .5\nKe 1 1 1\n' >room.mtl
ln room.mtl mtl.ply
kept room.mtl bake room.obj -o mtl.ply
rm mtl.ply
check "no output of a refused bake" test ! -e x.glb

# --- Kinds ---
refuses() { # COMMAND...: the name has an ending of another kind
    expect 64 "$@"
    says "expected a name that ends in"
    check "nothing is written: $*" test -z "$(find . -name 'bad.*')"
}
refuses cluster cube.off -o bad.ply
says '.fct'
refuses cluster cube.off -o bad.JSON
refuses render cube.off -o bad.fct
says '.png'
refuses render cube.off -o bad.jpg
refuses render cube.off -o bad
refuses simplify cube.off --faces 6 -o bad.fct
says '.ply, .obj, .off, .stl, .om or .glb'
refuses simplify cube.off --faces 6 -o bad
refuses partition cube.off -k 2 -o bad.fct
refuses partition cube.off -k 2 -o bad.png
refuses partition cube.off -k 2 -o bad.stl
refuses partition cube.off -k 2 -o ok.txt --adjacency bad.ply
refuses boxes cube.off -k 2 -o bad.fct
refuses raycast cube.off --rays rays.txt -o bad.ply
refuses collide cube.off cube.off -o bad.ply
refuses closest cube.off --points points.txt -o bad.json
refuses meshlets cube.off -o bad.txt
refuses meshlets cube.off -o bad.stl
refuses bake cube.off -o bad.png
refuses bake cube.off -o bad.fct
refuses bake cube.off -o bad.stl
refuses bake cube.off -o x.glb --also bad.json
refuses make sphere -o bad.fct
expect 64 make cornell -o bad.ply
expect 64 cluster cube.off room.obj -o bad.fct
check "nothing is written" test -z "$(find . -name 'bad.*')"

commands() { # of each command that writes: with $1 as the output
    echo "cluster cube.off -o $1"
    echo "render cube.off --size 20x20 -o $1"
    echo "simplify cube.off --faces 6 -o $1"
    echo "partition cube.off -k 2 -o $1"
    echo "boxes cube.off -k 2 -o $1"
    echo "raycast cube.off --rays rays.txt -o $1"
    echo "closest cube.off --points points.txt -o $1"
    echo "collide cube.off cube.off -o $1"
    echo "meshlets cube.off -o $1"
    echo "bake scene/scene.json --error 1 --final none -o $1"
    echo "make sphere -o $1"
}
while read -r line; do expect 0 $line; done < <(commands /dev/null)
check "/dev/null is a device" test -c /dev/null
mkfifo pipe
while read -r line; do
    cat pipe >through &
    expect 0 $line
    wait
    check "a pipe receives the output: $line" test -s through
    # The messages of a command do not go into its output, whatever name standard output has.
    "$program" ${line% pipe} - >plain 2>err
    check "- receives the output: $line" cmp -s plain through
    "$program" ${line% pipe} /dev/stdout 2>err | cat >piped
    check "/dev/stdout is like -: $line" cmp -s piped plain
done < <(commands pipe | grep -v -e cluster -e render)

# --- Closed standard streams ---
head_of() { head -c 3 "$1"; }
"$program" simplify cube.off --faces 6 -o closed.ply <&- >&- 2>&-
check "without streams: exit code 0" test $? = 0
"$program" simplify cube.off --faces 6 -o open.ply --quiet
check "without streams the output is the same" cmp -s closed.ply open.ply
for streams in '<&-' '>&-' '2>&-' '<&- >&-' '<&- 2>&-' '>&- 2>&-'; do
    rm -f closed.ply
    eval "\"$program\" simplify cube.off --faces 6 -o closed.ply --progress $streams" >out 2>err
    check "with $streams the output is the same" cmp -s closed.ply open.ply
done
printf 'OFF\n3 1 0\n0 0 0\n1 0 0\n' >broken.off
(exec 2>&-; "$program" simplify broken.off --faces 1 -o none.ply)
check "a failure without stderr" test $? = 65
check "no output" test ! -e none.ply
(exec >&-; "$program" info cube.off 2>err)
check "an answer needs standard output" test $? = 73
(exec <&-; "$program" info - >out 2>err)
check "standard input is closed" test $? = 66

# --- Names of objects ---
cat >names.json <<'END'
{"models": {"ball": "scene/ball.ply"},
 "materials": {"lamp": {"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}},
 "instances": [{"name": "a/b", "model": "ball", "material": "lamp"},
               {"name": "a_b", "model": "ball", "material": "lamp", "translate": [3, 0, 0]},
               {"name": "A", "model": "ball", "material": "lamp", "translate": [6, 0, 0]},
               {"name": "a", "model": "ball", "material": "lamp", "translate": [9, 0, 0]},
               {"name": "a-2", "model": "ball", "material": "lamp", "translate": [12, 0, 0]},
               {"name": "Ä", "model": "ball", "material": "lamp", "translate": [15, 0, 0]},
               {"name": "ä", "model": "ball", "material": "lamp", "translate": [18, 0, 0]},
               {"name": "..", "model": "ball", "material": "lamp", "translate": [21, 0, 0]},
               {"name": "a\nb", "model": "ball", "material": "lamp", "translate": [24, 0, 0]}]}
END
expect 0 bake names.json -o lit --json --error 1 --final none
keys files object file faces source
check "a file per object" test "$(ls lit | wc -l)" = 9
check "no two names differ in case only" test "$(ls lit | tr A-Z a-z | sort -u | wc -l)" = 9
check "the names" test "$(cd lit; LC_ALL=C; echo *)" = "A.ply _..ply a-2-2.ply a-2.ply a_b-2.ply a_b-3.ply a_b.ply Ä.ply ä-2.ply"
check "one entry of files[] per object" test "$(grep -c '"source"' out)" = 9
check "the object of a file" test "$(grep -A 1 '"object": "a/b"' out | grep -c 'lit/a_b.ply')" = 1
check "the source of a file" test "$(grep -c '"source": "ball"' out)" = 9
i=0
for name in a_b a_b-2 A a-2 a-2-2 Ä ä-2 _. a_b-3; do
    expect 0 info "lit/$name.ply" --json
    tr -d ' \n' <out >flat
    x=$(sed 's/.*"lower":\[\([^],]*\),.*/\1/' flat)
    holds "($x - (3 * $i - 1)) ^ 2 < .01"
    i=$((i + 1))
done

# --- Control characters ---
bell=$(printf 'bell\a\033[2J\302\233.off')
cp cube.off "$bell"
control() { LC_ALL=C grep -q "$(printf '[\001-\010\013-\037\177]\\|\302[\200-\237]')" "$@"; }
silent() { if control out err; then fail "control characters are printed: $*"; fi; checks=$((checks + 1)); }
run info "$bell"
silent info
run simplify "$bell" --faces 6 -o "$(printf 'x\033.ply')"
run cluster "$bell" -o y.fct
silent cluster
run info y.fct
silent hierarchy
run info "$(printf 'missing\033.off')"
silent missing
run info --"$(printf 'opt\033ion')"
silent option
run "$(printf 'com\033mand')"
silent command
run cluster cube.off -o z.fct --threads "$(printf '\0331')"
silent value
run partition cube.off -k 2 -o "$(printf 'x\033.stl')"
silent output
printf 'mtllib no\033[31m.mtl\nusemtl b\001\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >odd.obj
run bake odd.obj -o odd.ply
silent materials
rm -f x*.ply
leftovers
check "no hidden file is left" test -z "$(find . -name '.facetree*')"
finish
