# tests/tools/test_usage.sh: help, version, and every kind of wrong command line.
source "$(dirname "$0")/support.sh"
commands="bake boxes closest cluster collide compare convert info level make partition raycast render simplify"

expect 0 --version
check "the version is printed" grep -qE '^facetree [0-9]+\.[0-9]+\.[0-9]+ \((baseline|avx2)\)$' out
export FACETREE_SIMD=baseline
expect 0 --version
check "FACETREE_SIMD chooses the variant" grep -q '(baseline)$' out
export FACETREE_SIMD=sse9
expect 64 --version
says "FACETREE_SIMD: expected baseline or avx2, found 'sse9'"
unset FACETREE_SIMD
expect 0 --help
for command in $commands; do check "--help lists $command" grep -q "^  $command " out; done
expect 0 help
for command in $commands; do
    expect 0 help "$command"
    check "help $command tells its options" grep -q -- '--max-memory=SIZE' out
    cp out help
    expect 0 "$command" --help
    check "$command --help is help $command" cmp -s out help
    expect 0 help --man "$command"
    check "the man page of $command has a synopsis" grep -q '^\.SH SYNOPSIS' out
    check "the man page of $command lists options" grep -q '^\\fB.*json' out
    expect 64 "$command" --no-such-option
    says "unknown option '--no-such-option'"
done
expect 0 help --man
expect 64 help nothing
expect 64 help cluster info

expect 64
says "expected a command"
expect 64 clutser
says "did you mean 'cluster'?"
expect 64 qwertzuiop
says "'facetree help' lists them"
expect 64 --nothing
for later in relight form-factor; do
    expect 64 "$later" a b
    says "unknown command '$later'"
done

cube 1 >cube.off
expect 64 cluster
says "expected cluster IN"
expect 64 cluster cube.off
says "expected -o FILE"
expect 64 cluster cube.off -o
says "expected a value"
expect 64 cluster cube.off -o ''
expect 64 cluster cube.off -o x.fct -x
says "unknown option '-x'"
expect 64 cluster cube.off -o x.fct --json=1
says "--json takes no value"
expect 64 cluster cube.off -o x.fct --fit
says "--fit: expected a value"
expect 64 cluster cube.off -o x.fct --treads 2
says "did you mean --threads?"
expect 64 cluster cube.off -o x.fct --threads 0
expect 64 cluster cube.off -o x.fct --threads two
says "expected a whole number from 1 to 256, found 'two'"
expect 64 cluster cube.off -o x.fct --threads 2x
expect 64 cluster cube.off -o x.fct --seed -1
expect 64 cluster cube.off -o x.fct --seed 99999999999999999999999
expect 64 cluster cube.off -o x.fct --max-memory lots
expect 64 cluster cube.off -o x.fct --max-memory 0
expect 64 cluster cube.off -o x.fct --method quick
expect 64 cluster cube.off -o x.fct --cost cheap
says "expected increment or mean, found 'cheap'"
expect 64 cluster cube.off -o x.fct --fit -1
expect 64 cluster cube.off -o x.fct --shape nan
expect 64 cluster cube.off -o x.fct --fit-measure volume
expect 64 cluster cube.off -o x.fct --roots 0
expect 64 cluster cube.off -o x.fct --roots 13
says "only 12 faces"
expect 64 cluster cube.off -o - --json
says "cannot both write to standard output"
check "no file was made" test ! -e x.fct

expect 64 info
expect 64 info cube.off cube.off
says "unexpected argument 'cube.off'"
expect 64 info cube.off -o x
expect 64 info cube.off --verify
says "expected a hierarchy file"
expect 64 partition cube.off -o x
expect 64 partition cube.off -k 3 --max-cost 1 -o x
expect 64 partition cube.off -k 0 -o x
expect 64 partition cube.off -k 13 -o x
says "can be cut into 1 to 12 clusters"
expect 64 partition cube.off -k 2 -o x.stl
expect 64 partition cube.off -k 2 --refine -1 -o x
expect 64 partition cube.off -k 2 --perimeter 1 -o x
expect 64 partition cube.off -k 2 --refine 2 --irregularity .5 -o x
expect 64 partition cube.off -k 2 --refine 2 --perimeter nan -o x
expect 64 boxes cube.off
expect 64 boxes cube.off -k 13
expect 64 raycast cube.off
expect 64 raycast cube.off --check --backend obb
expect 64 raycast cube.off --check --occlusion
expect 64 raycast cube.off --count 5
expect 64 raycast cube.off --check --all
expect 64 raycast cube.off --rays r --all --occlusion
expect 64 raycast cube.off --rays r --occlusion --attributes uv
expect 64 raycast cube.off --make-rays 5 --all
expect 64 raycast cube.off --rays r --all --backend embree
says "--all: expected the backend obb, found embree"
expect 64 raycast cube.off --rays r --attributes smell
says "expected normal, uv or color, found 'smell'"
expect 64 raycast cube.off --rays r --attributes uv,uv
expect 64 raycast cube.off --rays r --backend bvh
expect 64 raycast - --rays -
expect 64 raycast scene.json --check
expect 64 closest cube.off
expect 64 closest scene.json --points p --signed
expect 64 closest cube.off --points p --max-distance -1
expect 64 compare cube.off
expect 64 compare cube.off cube.off --samples -5
expect 64 simplify cube.off -o x.ply
says "expected --faces N, --ratio R, --levels LIST or --max-error E"
expect 64 simplify cube.off -o x.ply --faces 4 --ratio .5
expect 64 simplify cube.off -o x.ply --ratio 0
expect 64 simplify cube.off -o x.ply --ratio 2
expect 64 simplify cube.off -o x.ply --faces 4 --pairs near
expect 64 simplify cube.off -o x.ply --faces 4 --pairs -1
expect 64 simplify cube.off -o x.ply --faces 4 --pairs .1 --keep-topology
says "either --pairs or --keep-topology"
expect 64 simplify cube.off -o x.ply --faces 4 --attributes smell
says "expected color, uv or normal, found 'smell'"
expect 64 simplify cube.off -o x.ply --faces 4 --attributes color=much
expect 64 simplify cube.off -o x.ply --faces 4 --placement best
expect 64 simplify cube.off -o x.ply --faces 4 --weights heavy
says "expected area, angle or uniform, found 'heavy'"
expect 64 simplify cube.off -o x.doc --faces 4
expect 64 simplify cube.off -o x.ply --faces 4 --primitive vertex
says "expected edge or face, found 'vertex'"
expect 64 simplify cube.off -o x.ply --faces 4 --primitive face --pairs .1
says "either --pairs or --primitive face"
expect 64 bake cube.off
says "expected -o OUT or --probe FILE"
expect 64 bake cube.off -o x.stl
expect 64 bake cube.off -o x.glb --method volume
expect 64 bake cube.off -o x.glb --visibility octree
expect 64 bake cube.off -o x.glb --final best
expect 64 bake cube.off -o x.glb --error 0
expect 64 bake cube.off -o x.glb --samples 0
for later in --light-groups --save-solution=x; do
    expect 64 bake cube.off -o x.glb "$later"
    says "unknown option"
done
check "no file was made" test -z "$(find . -name 'x.*')"
finish
