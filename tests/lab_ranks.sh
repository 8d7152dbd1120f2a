#!/usr/bin/env bash
# The laboratory by several ranks under mpirun: the files of one process to the last bit, also where a rank or
# mpirun is killed in the middle; what ranks fail of is said in one line.
#
#     lab_ranks.sh LAB RUN_WITH FOLDER SANITIZED
set -euo pipefail
lab=$1 run_with=$2 folder=$3 sanitized=$4
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 # in containers

if ! command -v mpirun >/dev/null; then
    echo "skipped: no mpirun"
    exit
fi
if ! grep -q MPI_Init <(nm -D "$lab"); then
    echo "skipped: the laboratory is built without MPI"
    exit
fi

rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"

failures=0
fail() {
    echo "$*" >&2
    failures=1
}
# Quietly: what mpirun itself says of a failure is left out.
mpi=(mpirun --quiet --oversubscribe --bind-to none)
same() {
    local one=$1 other=$2 name
    shift 2
    for name in "$@"; do cmp "$one/$name" "$other/$name" || fail "$other/$name"; done
}
# fails STATUS LINE COMMAND..: one line on standard error.
fails() {
    local expected=$1 line=$2 status=0
    shift 2
    "$@" >/dev/null 2>stderr || status=$?
    if [ $status -ne "$expected" ] || [ "$(wc -l <stderr)" -ne 1 ] || ! grep -Eq "$line" stderr; then
        fail "status $status, not $expected with '$line': $*: $(cat stderr)"
    fi
}

# Everything that the laboratory writes, and prints; passes are no multiple of ranks, and rows of tiles neither.
everything=(--size 14 --samples 10 --algorithm ups --radius-alpha 1 --optimal 3 --mistake merge_area --snapshots
    --scene caustic --scene cornell)
"$lab" "${everything[@]}" --threads 2 --output one --dump one.jsonl >one.txt
"${mpi[@]}" -n 4 "$lab" "${everything[@]}" --threads 1 --output four --dump four.jsonl >four.txt
images=()
for scene in caustic cornell; do
    images+=($scene{.exr,.png,-optimal.exr,-pyramid.png,-mistake.png,-passes-1.exr,-passes-4.exr})
done
same one four "${images[@]}" scenes.png
cmp one.txt four.txt || fail "what is printed differs"
cmp one.jsonl four.jsonl || fail "dumps differ"

# Killed in the middle. With --checkpoint 0 there is one after each round of passes.
render=(--size 16 --samples 120 --no-checks --optimal 4 --threads 1 --checkpoint)
results=(cornell.exr cornell-optimal.exr cornell-pyramid.png cornell.checkpoint)
"$lab" "${render[@]}" 1000 --output whole
# signal_in_the_middle SIGNAL FOLDER WHICH: 0 is mpirun, 1 to 4 are the ranks; its status is mpirun's.
signal_in_the_middle() {
    "${mpi[@]}" -n 4 "$lab" "${render[@]}" 0 --output "$2" 2>stderr &
    local mpirun=$! processes status=0
    until [ -e "$2/cornell.checkpoint" ] || ! kill -0 $mpirun; do sleep 0.01; done
    processes=($mpirun $(cat "/proc/$mpirun/task/$mpirun/children"))
    kill "-$1" "${processes[$3]}"
    wait $mpirun || status=$?
    for process in "${processes[@]}"; do
        while kill -0 "$process" 2>/dev/null; do sleep 0.01; done
    done
    return $status
}
# killed_in_the_middle FOLDER WHICH
killed_in_the_middle() {
    local status=0
    signal_in_the_middle KILL "$@" || status=$?
    [ $status -eq 137 ] || fail "status $status where process $2 was killed"
    [ ! -e "$1/cornell.exr" ] || fail "process $2 was not killed in the middle"
}
killed_in_the_middle rank_killed 3
"${mpi[@]}" -n 4 "$lab" "${render[@]}" 0 --output rank_killed
same whole rank_killed "${results[@]}"
killed_in_the_middle mpirun_killed 0
# By any number of ranks.
"${mpi[@]}" -n 3 "$lab" "${render[@]}" 1000 --output mpirun_killed
same whole mpirun_killed "${results[@]}"

# A rank that is interrupted ends the others in order.
status=0
signal_in_the_middle TERM interrupted 2 || status=$?
[ $status -eq 130 ] || fail "status $status after an interruption"
grep -Eq "^interrupted: cornell: the image has [0-9]+ of 120 passes$" stderr || fail "$(cat stderr)"
[ -e interrupted/cornell.exr ] || fail "no image after an interruption"
"${mpi[@]}" -n 2 "$lab" "${render[@]}" 1000 --output interrupted
same whole interrupted "${results[@]}"

# What is wrong for all ranks is said once; and what for one, with its number.
fails 2 "^lab: 'whole/cornell.checkpoint' is of --optimal 4, not --optimal 2$" \
    "${mpi[@]}" -n 3 "$lab" "${render[@]/4/2}" 0 --output whole
printf X | dd of=whole/cornell.checkpoint bs=1 seek=9000 conv=notrunc status=none
fails 2 "^lab: 'whole/cornell.checkpoint' is damaged from byte [0-9]+ on: .*image" \
    "${mpi[@]}" -n 3 "$lab" "${render[@]}" 0 --output whole
small=(--samples 1 --no-checks --threads 1 --output small)
fails 2 "^lab: rank 1 of 2: its options are not those of rank 0$" \
    "${mpi[@]}" -n 1 "$lab" "${small[@]}" --size 8 : -n 1 "$lab" "${small[@]}" --size 9
if [ "$sanitized" != ON ]; then
    fails 2 "^lab: rank 1 of 2: " \
        "${mpi[@]}" -n 1 "$lab" "${small[@]}" --size 256 : -n 1 "$run_with" --memory 350000000 "$lab" "${small[@]}" --size 256
fi
exit $failures
