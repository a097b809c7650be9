# tests/tools/outputs/test_signals.sh: a signal ends a run within a second in every phase, with the status 128 + signal and without a
# temporary file. A killed run leaves no broken file, and the next run no temporary file. $4 is a library to preload, which
# takes files without a name away; $5 is the number of kills (default 20).
source "$(dirname "$0")/../support.sh"
preload=${4:-}
kills=${5:-20}
count=$((40000 / ${scale:-1}))
"$program" make sphere -o ball.ply --triangles $count --inside --quiet
"$program" make terrain -o ground.ply --triangles $count --quiet
cat >lit.json <<'END'
{"models": {"ball": "ball.ply"},
 "materials": {"lamp": {"reflectance": [0.5, 0.5, 0.5], "emission": [1, 1, 1]}},
 "instances": [{"name": "ball", "model": "ball", "material": "lamp"}]}
END
mkfifo pipe

now() { date +%s%N; }

# ends SIGNAL SECONDS COMMAND...: sends the signal after the time, and checks status, time and leftovers.
ends() {
    local name=$1 wait=$2 number begin end status
    number=$(kill -l "$name")
    shift 2
    timeout 60 "$program" "$@" >out 2>err &
    local parent=$!
    sleep "$wait"
    local child
    child=$(pgrep -P $parent)
    begin=$(now)
    kill -"$name" "$child" 2>/dev/null
    wait $parent 2>/dev/null
    status=$?
    end=$(now)
    checks=$((checks + 2))
    [ "$status" = $((128 + number)) ] || fail "expected status $((128 + number)), found $status: $*"
    [ $(((end - begin) / 1000000)) -lt $((1000 * (${scale:-1} > 1 ? 5 : 1))) ] || fail "took $(((end - begin) / 1000000)) ms to end: $*"
    check "no temporary file: $*" test -z "$(find . -name '.facetree*')"
}
for preloaded in '' $preload; do
    export LD_PRELOAD=$preloaded
    for name in HUP INT TERM; do
        ends $name .3 bake lit.json -o new.ply --error 1e-9
        ends $name .3 bake lit.json -o new.ply --method reference --samples 100000
        # A reader that waits for a pipe makes no progress: the grace ends.
        ends $name .2 simplify ball.ply --faces 9 -o pipe
        ends $name .2 raycast ball.ply --rays pipe -o new.txt
    done
    ends TERM .3 compare ball.ply ground.ply --samples 100000
    ends HUP .4 make bust -o new.ply --triangles 4000000
    ends TERM .5 cluster ball.ply ground.ply pipe -o .
    unset LD_PRELOAD
done
check "no output" test -z "$(find . -name 'new.*')"
bash -c 'trap "" HUP; exec "$@"' ignoring "$program" simplify ball.ply --faces 9 -o pipe 2>err &
child=$!
sleep .3
kill -HUP $child
sleep .8
check "an ignored signal stays ignored" kill -TERM $child
wait $child 2>/dev/null
check "another signal ends the run" test $? = 143

# A mapped input that becomes shorter: 66, in one line.
for command in 'info long.ply' 'simplify long.ply --ratio .5 -o new.ply' 'cluster long.ply -o new.fct' 'bake long.ply -o new.ply'; do
    for delay in 0 .01 .02 .04 .08; do
        cp ground.ply long.ply
        "$program" $command >out 2>err &
        child=$!
        sleep $delay
        : >long.ply
        wait $child
        status=$?
        checks=$((checks + 1))
        case $status in
        0 | 65 | 66) ;;
        *) fail "a shortened input: status $status: $command" ;;
        esac
        rm -f new.*
    done
done

# Kills at random times. The outputs are those of a whole run, or the old ones.
RANDOM=7
commands=('cluster ground.ply -o tree.fct' 'simplify ground.ply --ratio .3 -o less.ply' 'bake lit.json -o light.ply --final none --error 1e-3')
for command in "${commands[@]}"; do
    file=${command#* -o }
    file=${file%% *}
    begin=$(now)
    "$program" $command --quiet || fail "$command"
    mv "$file" "whole.$file"
    echo $((($(now) - begin) / 1000000)) >"time.$file"
done
for ((i = 0; i < kills; ++i)); do
    command=${commands[i % 3]}
    file=${command#* -o }
    file=${file%% *}
    if [ $((i % 2)) = 0 ]; then rm -f "$file"; else cp "whole.$file" "$file"; fi
    [ $((i % 4)) -ge 2 ] && export LD_PRELOAD=$preload
    "$program" $command --quiet >out 2>err &
    child=$!
    unset LD_PRELOAD
    milliseconds=$((RANDOM % ($(cat "time.$file") + 20)))
    sleep "$(printf '%d.%03d' $((milliseconds / 1000)) $((milliseconds % 1000)))"
    kill -KILL $child 2>/dev/null
    wait $child 2>/dev/null
    checks=$((checks + 1))
    [ ! -e "$file" ] || cmp -s "$file" "whole.$file" || fail "a broken file after a kill: $command"
done
for command in "${commands[@]}"; do expect 0 $command --quiet; done
check "no temporary file after the next run" test -z "$(find . -name '.facetree*' -o -name '*.tmp')"
finish
