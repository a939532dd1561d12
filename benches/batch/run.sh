#!/usr/bin/env bash
# A batch of many recordings: throughput, peak memory, and a kill in the middle.
# Usage: benches/batch/run.sh FDI FOLDER [COUNT [DISTINCT]]
# The figures of docs/validation/batch.md are what this prints.
set -euo pipefail

fdi="$1" folder="$2" count="${3:-2000}" distinct="${4:-100}" jobs="${JOBS:-2}"
mkdir -p "$folder/recordings"
for ((i = 0; i < distinct; i++)); do
    [[ -e "$folder/recordings/$(printf 'r%05d.csv' "$i")" ]] && continue
    "$fdi" simulate --quiet --seed "$i" --noise-a 0.02 --adc-bits 12 \
        --faults "k1=0.0$((i % 5))$((i % 7)),k4=0.0$((i / 3 % 5))2" \
        --output "$folder/recordings/$(printf 'r%05d.csv' "$i")"
done
for ((i = distinct; i < count; i++)); do
    ln -f "$folder/recordings/$(printf 'r%05d.csv' $((i % distinct)))" "$folder/recordings/$(printf 'r%05d.csv' "$i")"
done

# Runs a batch in the background; its id is in $pid.
start() {
    "$fdi" diagnose --quiet --stable --jobs "$jobs" --output-format json --output "$1.json" \
        --resume "$1.jsonl" "$folder/recordings" &
    pid=$!
}
# answers of a file: its lines after the first, which names what they depend on
lines() { if [[ -s "$1" ]]; then echo $(($(wc -l <"$1") - 1)); else echo 0; fi; }
# Peak memory in MB and processor time in s so far; nothing when it has ended.
peak() { awk '/VmHWM/ { print int($2 / 1024) }' "/proc/$pid/status" 2>/dev/null || true; }
ticks() { awk '{ print ($14 + $15) / '"$(getconf CLK_TCK)"' }' "/proc/$pid/stat" 2>/dev/null || true; }

rm -f "$folder"/{whole,killed}.json*
start "$folder/whole"
tenths=0
while kill -0 "$pid" 2>/dev/null; do
    memory="$(peak)" time="$(ticks)" done_now="$(lines "$folder/whole.jsonl")"
    if [[ -n "$memory" && -n "$time" ]]; then
        last_memory="$memory" last_time="$time" last_done="$done_now"
        if ((done_now * 10 / count > tenths)); then
            tenths=$((done_now * 10 / count))
            echo "after $done_now recordings: peak $memory MB, $time s of processor time"
        fi
    fi
    sleep 0.2
done
wait "$pid"
echo "at the end: $last_done of $count recordings, peak $last_memory MB, $last_time s of processor time"
awk -v n="$last_done" -v s="$last_time" 'BEGIN { printf "%.1f recordings a second and core\n", n / s }'

start "$folder/killed"
while (($(lines "$folder/killed.jsonl") < count / 2)); do sleep 0.1; done
kill -KILL "$pid"
wait "$pid" 2>/dev/null || true
echo "killed after $(lines "$folder/killed.jsonl") recordings"
start "$folder/killed"
wait "$pid"
cmp "$folder/whole.jsonl" "$folder/killed.jsonl"
cmp "$folder/whole.json" "$folder/killed.json"
echo "resumed: both files are byte for byte those of the uninterrupted run"
