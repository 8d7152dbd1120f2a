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
# start_and_stop FOLDER: starts four ranks and stops them when there is a checkpoint, and no image. Where all passes
# are through before that is seen, it begins anew. Sets mpirun and ranks.
start_and_stop() {
    for ((attempt = 0; attempt < 20; ++attempt)); do
        rm -rf "$1"
        "${mpi[@]}" -n 4 "$lab" "${render[@]}" 0 --output "$1" 2>stderr &
        mpirun=$!
        until [ -e "$1/cornell.checkpoint" ] || ! kill -0 $mpirun 2>/dev/null; do sleep 0.01; done
        read -ra ranks <"/proc/$mpirun/task/$mpirun/children" || true
        if kill -STOP "${ranks[@]}" 2>/dev/null && [ ! -e "$1/cornell.exr" ]; then return; fi
        kill -KILL $mpirun "${ranks[@]}" 2>/dev/null || true
        await_end || true
    done
    echo "'$1' was never seen in the middle: $(cat stderr)" >&2
    exit 1
}
# await_end: of mpirun and its ranks; its status is mpirun's.
await_end() {
    local status=0 process
    wait $mpirun || status=$?
    for process in "${ranks[@]}"; do
        while [ -e "/proc/$process/exe" ]; do sleep 0.01; done # not so where it is but to be waited for
    done
    return $status
}
# killed_in_the_middle FOLDER PROCESS..: those are killed, and the others go on until they notice.
killed_in_the_middle() {
    local status=0
    kill -KILL "${@:2}"
    kill -CONT "${ranks[@]}" 2>/dev/null || true
    await_end || status=$?
    [ $status -eq 137 ] || fail "status $status where $1 was killed"
    [ ! -e "$1/cornell.exr" ] || fail "$1 has an image"
}
start_and_stop rank_killed
killed_in_the_middle rank_killed "${ranks[2]}"
"${mpi[@]}" -n 4 "$lab" "${render[@]}" 0 --output rank_killed
same whole rank_killed "${results[@]}"
# As where a machine fails.
start_and_stop all_killed
killed_in_the_middle all_killed $mpirun "${ranks[@]}"
# By any number of ranks.
"${mpi[@]}" -n 3 "$lab" "${render[@]}" 1000 --output all_killed
same whole all_killed "${results[@]}"

# A rank that is interrupted ends the others in order.
status=0
start_and_stop interrupted
kill -TERM "${ranks[1]}"
kill -CONT "${ranks[@]}"
await_end || status=$?
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
