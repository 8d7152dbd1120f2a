#!/usr/bin/env bash
# Instructions for adding a sample to an estimator of optimal weights (double, three channels), and for solving it,
# beside what they may cost and what a published header-only library costs, in the same way of counting:
#     count_optimal.sh PROGRAM PROGRAM_FOR_THIS_MACHINE
# Fails if PROGRAM, which is built for any machine, costs more than it may.
set -euo pipefail
program=${1:?usage: count_optimal.sh PROGRAM PROGRAM_FOR_THIS_MACHINE}
native=${2:?usage: count_optimal.sh PROGRAM PROGRAM_FOR_THIS_MACHINE}
repetitions=1000
status=0

# at most, published
declare -A limits=(
    [add_2]="60 170" [add_4]="110 302" [add_8]="250 662" [add_16]="700 1766"
    [solve_2]="400 4327" [solve_4]="900 8616" [solve_8]="2500 20633" [solve_16]="9000 59660"
    [bytes_2]="96 816" [bytes_4]="224 1230" [bytes_8]="560 2459" [bytes_16]="1620 6462"
)

# instructions PROGRAM NAME: of one repetition; a dash if valgrind does not know all of this machine's
instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="measure_$2" "$1" "$2" 2>&1 |
        awk -v n=$repetitions '/Collected/ { found = $NF } END { if (found) printf "%.1f", found / n; else printf "-" }' || true
}
row() { # NAME OURS NATIVE
    local limit published verdict=""
    read -r limit published <<<"${limits[$1]}"
    if ! awk -v ours="$2" -v limit="$limit" 'BEGIN { exit !(ours + 0 > 0 && ours + 0 <= limit) }'; then
        verdict=" MISSED"
        status=1
    fi
    printf '| %s | %s%s | %s | %s | %s |\n' "${1/_/ }" "$2" "$verdict" "$limit" "$3" "$published"
}

printf '| optimal weights | instructions | at most | -march=native | published |\n| --- | --- | --- | --- | --- |\n'
for name in add_2 add_4 add_8 add_16 solve_2 solve_4 solve_8 solve_16; do
    row $name "$(instructions "$program" $name)" "$(instructions "$native" $name)"
done
for m in 2 4 8 16; do
    row bytes_$m "$("$program" bytes $m)" "$("$native" bytes $m || echo -)"
done
exit $status
