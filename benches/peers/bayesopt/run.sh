#!/bin/sh
# Every job of every peer, one after another on one machine; writes results.csv and machine.txt.
# This crate runs before and after the peers, so that no one has the quiet half of the run to itself.
# PYTHON names an interpreter with scikit-learn and BoTorch (pip install botorch scikit-learn).
set -e
cd "$(dirname "$0")"
case=../../../fixtures/references/sklearn
python="${PYTHON:-python3}"
export OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 RAYON_NUM_THREADS=1
(cd ours && cargo build --quiet --release)
(cd egobox && cargo build --quiet --release)
load() { cut -d ' ' -f 1 /proc/loadavg; }
before=$(load)
{
    echo "job,peer,wall_ms_min,cpu_ms_min,quality"
    ours/target/release/ours $case
    egobox/target/release/egobox-peer $case/train.csv $case/probe.csv > egobox/target/output.txt
    "$python" peers.py $case egobox/target/output.txt
    ours/target/release/ours $case
} > results.csv
{
    sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1
    echo "load average of one minute on $(nproc --all) cores before $before, after $(load)"
    rustc --version
    "$python" -c 'import sys; print("python", sys.version.split()[0])'
    "$python" -m pip list --format=freeze 2> /dev/null | grep -E '^(scikit-learn|torch|gpytorch|botorch|numpy|scipy)=='
} > machine.txt
