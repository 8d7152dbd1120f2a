#!/usr/bin/env bash
# Instructions of weights of two techniques, of many, and of complete paths: count_weights.sh weight_instructions. Fails if one
# costs more than it may, which is said for GCC 12 and the release preset's flags.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/callgrind.sh"
program=${1:?usage: count_weights.sh PROGRAM}
repetitions=1000
status=0

rows=( # function, at most, what it is
    "power_by_hand<float>|-|a² / (a² + b²), float: overflows"
    "power<float>|16|mis::power, float"
    "balance<float>|16|mis::balance, float"
    "power_by_hand<double>|-|a² / (a² + b²), double"
    "power<double>|16|mis::power, double"
    "balance<double>|16|mis::balance, double"
    "many<4, mis::balance|-|mis::balance, all weights of 4 techniques, float"
    "many<64, mis::balance|-|of 64"
    "many<4, mis::power|-|mis::power, of 4"
    "many<64, mis::power|-|of 64"
    "many<4, mis::maximum|-|mis::maximum, of 4"
    "many<64, mis::maximum|-|of 64"
    "complete_path<mis::area_vertex<float> >|2500|all 15 weights of a path of 8, area densities"
    "complete_path<mis::measured_vertex<float> >|2800|all 15 weights of a path of 8, measured geometry"
)
mapfile -t counts < <(instructions_of "$program" -- "${rows[@]%%|*}")
printf '| instructions | | at most |\n| --- | --- | --- |\n'
for i in "${!rows[@]}"; do
    IFS='|' read -r _ most about <<<"${rows[$i]}"
    count=$((counts[i] / repetitions))
    verdict=""
    if [ "$most" != - ] && ! [ "$count" -gt 0 -a "$count" -le "$most" ]; then
        verdict=" MISSED"
        status=1
    fi
    printf '| %s | %s%s | %s |\n' "$about" "$count" "$verdict" "$most"
done
exit $status
