#!/usr/bin/env bash
# Bytes of machine code of each call, by scheme: count_bytes.sh call_instructions
set -euo pipefail
program=${1:?usage: count_bytes.sh PROGRAM}
calls=(upkeep step dirac connection next_event camera_connection light_hit merge)
declare -A scheme=(
    ["three numbers per vertex"]="three<1, float>"
    ["mis, any techniques"]="two_number_weights<mis::balance_heuristic, mis::any_techniques, float>"
    ["mis, connected surfaces"]="two_number_weights<mis::balance_heuristic, mis::connected_surfaces, float>"
)
symbols=$(nm -S -C "$program")
printf '| bytes of code'
printf ' | %s' "${calls[@]//_/ }"
printf ' |\n|%s\n' "$(printf ' --- |%.0s' x "${calls[@]}")"
for name in "three numbers per vertex" "mis, any techniques" "mis, connected surfaces"; do
    printf '| %s' "$name"
    for call in "${calls[@]}"; do
        size=$(grep -F "(anonymous namespace)::$call<(anonymous namespace)::${scheme[$name]}" <<<"$symbols" |
            awk '{ print $2; exit }')
        printf ' | %d' "0x${size:?no symbol of $call}"
    done
    echo ' |'
done
