#!/usr/bin/env bash
# Prints the instructions that one weight costs in each way of computing it: count_instructions.sh weight_instructions
# Callgrind counts instructions, which do not depend on how busy the machine is.
set -euo pipefail
program=${1:?usage: count_instructions.sh PROGRAM}
repetitions=1000

declare -A about=(
    [power_by_hand]="two techniques, power 2, by hand (overflows in float)"
    [power]="two techniques, mis::power"
    [connection_loop]="connection weight, loop over 4 + 4 vertices, balance"
    [complete_path_areas]="all 15 weights of a path of 8, area densities"
    [complete_path]="all 15 weights of a path of 8, measured geometry"
)

printf '%-58s %12s\n' "what" "instructions"
for name in $("$program"); do
    total=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="measure_$name" \
        "$program" "$name" 2>&1 | awk '/Collected/ { print $NF }')
    printf '%-58s %12.1f\n' "${about[$name]}" "$(awk -v t="$total" -v n=$repetitions 'BEGIN { print t / n }')"
done
