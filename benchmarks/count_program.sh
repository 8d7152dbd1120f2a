#!/usr/bin/env bash
# Instructions of a whole renderer with three numbers per vertex and with two: count_program.sh whole_program. Fails if
# two numbers make more than 0.2 % more of them.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/callgrind.sh"
program=${1:?usage: count_program.sh PROGRAM}
mapfile -t counts < <(instructions_of "$program" -- "image<(anonymous namespace)::three_numbers>" \
    "image<(anonymous namespace)::two_numbers>")
awk -v three="${counts[0]}" -v two="${counts[1]}" 'BEGIN {
    is_met = two > 0 && two <= 1.002 * three
    printf "| a bidirectional path tracer, whole | million instructions | ratio |\n| --- | --- | --- |\n"
    printf "| three numbers per vertex | %.2f | |\n", three / 1e6
    printf "| two numbers per vertex (mis) | %.2f | %.3f%s, at most 1.002 |\n", two / 1e6, two / three, is_met ? "" : " MISSED"
    exit !is_met
}'
