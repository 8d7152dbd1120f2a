#!/usr/bin/env bash
# Instructions of the weight of one connection against the length of the path: count_lengths.sh length_instructions
# [FOLDER FOR lengths.csv]. Fails if those of two numbers per vertex are not the same at every length.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/callgrind.sh"
program=${1:?usage: count_lengths.sh PROGRAM [FOLDER]} csv=${2:+$2/lengths.csv}
repetitions=100
lengths=(4 8 16 32)
declare -A about=(
    [by_two_numbers]="two numbers per vertex (mis)" [by_three_numbers]="three numbers per vertex"
    [by_loop]="loop over both walks" [by_products]="products of all densities"
)
ways=(by_two_numbers by_three_numbers by_loop by_products)

names=()
for type in float double; do
    for way in "${ways[@]}"; do
        for n in "${lengths[@]}"; do names+=("$way<$n, $type>"); done
    done
done
mapfile -t counts < <(instructions_of "$program" -- "${names[@]}")
[ -z "$csv" ] || echo "vertices,$(IFS=, && echo "${ways[*]}")" >"$csv"
printf '| instructions of a connection of a path of as many vertices'
printf ' | %s' "${lengths[@]}"
printf ' |\n|%s\n' "$(printf ' --- |%.0s' x "${lengths[@]}")"
i=0
for type in float double; do
    for way in "${ways[@]}"; do
        printf '| %s, %s' "${about[$way]}" $type
        for _ in "${lengths[@]}"; do
            printf ' | %s' "$((counts[i++] / repetitions + 1))"
        done
        echo ' |'
    done
done
if [ -n "$csv" ]; then
    for k in "${!lengths[@]}"; do
        printf '%s' "${lengths[$k]}"
        for way in "${!ways[@]}"; do printf ',%s' "$((counts[way * ${#lengths[@]} + k] / repetitions + 1))"; done
        echo
    done >>"$csv"
fi
for type in 0 1; do
    for k in "${!lengths[@]}"; do
        first=$((type * ${#ways[@]} * ${#lengths[@]}))
        [ "${counts[first + k]}" -eq "${counts[first]}" ] || { echo "two numbers per vertex are not flat: MISSED"; exit 1; }
    done
done
