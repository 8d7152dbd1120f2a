#!/usr/bin/env bash
# Weak scaling of the laboratory's renders: as many passes for each rank, ever more ranks of one thread each.
#
#     scale_ranks.sh LAB [REPETITIONS [RANKS..]]
#
# Of the repetitions, which take turns, the least counts: a busy machine only adds time. Seconds are those of rendering and
# exchange; their ratio is to one process's, for more ranks than processors to as much more work of each processor.
# Processor time is that of all ranks, their start and their waiting included; its ratio is to as many times one process's.
set -euo pipefail
lab=${1:?usage: scale_ranks.sh LAB [REPETITIONS [RANKS..]]} repetitions=${2:-5}
shift $(($# < 2 ? $# : 2))
[ $# -gt 0 ] || set -- 1 2 4 8
passes=${PASSES:-16} # of each rank
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 # in containers
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# render NAME RANKS THREADS COMMAND..: its seconds and its processor time are added to NAME.wall and NAME.cpu.
render() {
    local name=$folder/$1 ranks=$2 threads=$3 TIMEFORMAT='%U %S'
    shift 3
    { time "$@" "$lab" --size 128 --no-checks --snapshots --samples $((passes * ranks)) --threads "$threads" \
        --output "$name.out" >/dev/null; } 2>"$name.time"
    awk 'END { print $1 + $2 }' "$name.time" >>"$name.cpu"
    awk -F, 'END { print $2 }' "$name.out/cornell-convergence.csv" >>"$name.wall"
}
for ((i = 0; i < repetitions; ++i)); do
    render alone 1 1 env
    render threads 2 2 env
    for ranks in "$@"; do
        render "$ranks" "$ranks" 1 mpirun --oversubscribe --bind-to none -n "$ranks"
    done
done

least() { sort -g "$folder/$1" | head -n 1; }
row() { # NAME WORK PROCESSORS WHAT: as much work as that of so many processes alone
    awk -v wall="$(least "$1.wall")" -v cpu="$(least "$1.cpu")" -v wall1="$(least alone.wall)" \
        -v cpu1="$(least alone.cpu)" -v work="$2" -v most="$3" -v passes=$passes -v what="$4" 'BEGIN {
        more = work > most ? work / most : 1
        printf "| %s | %d | %.2f | %.2f | %.2f |\n", what, passes * work, wall, wall / wall1 / more, cpu / cpu1 / work }'
}
echo "| on $(nproc) processors | passes | seconds | ratio | ratio of processor time |"
echo "| --- | --- | --- | --- | --- |"
row alone 1 1 "one process of one thread, without MPI"
row threads 2 "$(nproc)" "one process of two threads, without MPI"
for ranks in "$@"; do
    row "$ranks" "$ranks" "$(nproc)" "\`-n $ranks\`"
done
