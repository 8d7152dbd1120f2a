#!/usr/bin/env bash
# Prints the instructions that one weight costs in each way of computing it: count_instructions.sh weight_instructions
# Callgrind counts instructions, which do not depend on how busy the machine is. Fails if one costs more than it may.
set -euo pipefail
program=${1:?usage: count_instructions.sh PROGRAM}
repetitions=1000
status=0

declare -A limits=([power]=16 [complete_path_areas]=2500 [complete_path]=2800) # for GCC 12 and the release preset's flags
declare -A measured=([power]=call_power [power_by_hand]=call_power_by_hand) # functions; else measure_NAME
declare -A about=(
    [power_by_hand]="two techniques, power 2, by hand (overflows in float), a call"
    [power]="two techniques, mis::power, a call"
    [connection_loop]="connection weight, loop over 4 + 4 vertices, balance"
    [complete_path_areas]="all 15 weights of a path of 8, area densities"
    [complete_path]="all 15 weights of a path of 8, measured geometry"
)

printf '%-62s %12s %12s\n' "what" "instructions" "at most"
for name in $("$program"); do
    total=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="${measured[$name]-measure_$name}" \
        "$program" "$name" 2>&1 | awk '/Collected/ { print $NF }')
    count=$(awk -v t="$total" -v n=$repetitions 'BEGIN { printf "%.1f", t / n }')
    limit=${limits[$name]-}
    verdict=""
    if [ -n "$limit" ] && ! awk -v c="$count" -v l="$limit" 'BEGIN { exit !(c > 0 && c <= l) }'; then
        verdict="  above the limit"
        status=1
    fi
    printf '%-62s %12s %12s%s\n' "${about[$name]}" "$count" "$limit" "$verdict"
done
exit $status
