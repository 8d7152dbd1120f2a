#!/usr/bin/env bash
# Weak scaling of the laboratory's renders: as many passes for each rank, ever more ranks of one thread each.
#
#     scale_ranks.sh LAB [REPETITIONS [RANKS..]]
#
# Instructions are those of the rank that executes most, in the laboratory's own code: waiting and copying are MPI's and
# the C library's. They do not depend on how busy the machine is. Seconds are those of rendering and exchange, the least of
# the repetitions, which take turns. Ratios are to one process alone, for as much work of each rank or processor.
set -euo pipefail
lab=$(realpath "${1:?usage: scale_ranks.sh LAB [REPETITIONS [RANKS..]]}") repetitions=${2:-5}
shift $(($# < 2 ? $# : 2))
[ $# -gt 0 ] || set -- 1 2 4 8
passes=4 # of each rank
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 # in containers
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

launch() { # RANKS COMMAND..; 0 ranks: without MPI
    local ranks=$1
    shift
    if [ "$ranks" -eq 0 ]; then "$@"; else mpirun --oversubscribe --bind-to none -n "$ranks" "$@"; fi
}
work() { echo $(($1 > 0 ? $1 : 1)); } # RANKS
# seconds NAME RANKS THREADS PROCESSES: are added to the file NAME
seconds() {
    launch "$2" "$lab" --size 128 --no-checks --snapshots --samples $((passes * $4)) --threads "$3" \
        --output "$folder/out" >/dev/null
    awk -F, 'END { print $2 }' "$folder/out/cornell-convergence.csv" >>"$folder/$1"
}
# instructions RANKS: in millions
instructions() {
    local counts=$folder/$1.instructions
    launch "$1" valgrind --tool=callgrind --callgrind-out-file="$counts.%p" "$lab" --size 32 --no-checks --threads 1 \
        --samples $((passes * $(work "$1"))) --output "$folder/out" >/dev/null 2>&1
    for rank in "$counts".*; do
        callgrind_annotate --threshold=100 "$rank" 2>/dev/null |
            awk -v own="[$lab]" '$NF == own { gsub(",", "", $1); sum += $1 } END { print sum / 1e6 }'
    done | sort -g | tail -n 1
}

for ((i = 0; i < repetitions; ++i)); do
    seconds 0 0 1 1
    seconds threads 0 2 2
    for ranks in "$@"; do seconds "$ranks" "$ranks" 1 "$ranks"; done
done
least() { sort -g "$folder/$1" | head -n 1; }
row() { # NAME PROCESSES MILLIONS WHAT
    awk -v t="$(least "$1")" -v alone="$(least 0)" -v n="$2" -v count="$3" -v one="$one" -v processors="$(nproc)" \
        -v what="$4" -v passes=$passes 'BEGIN {
            more = n > processors ? n / processors : 1
            printf "| %s | %d | %s | %s | %.2f | %.2f |\n", what, passes * n, count == "" ? "" : sprintf("%.1f", count),
                count == "" ? "" : sprintf("%.3f", count / one), t, t / alone / more }'
}
echo "| on $(nproc) processors | passes | million instructions | ratio | seconds | ratio |"
echo "| --- | --- | --- | --- | --- | --- |"
one=$(instructions 0)
row 0 1 "$one" "one process of one thread, without MPI"
row threads 2 "" "one process of two threads, without MPI"
for ranks in "$@"; do row "$ranks" "$ranks" "$(instructions "$ranks")" "\`-n $ranks\`"; done
