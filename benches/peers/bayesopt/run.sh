#!/bin/sh
# Every job of every peer, one after another on one machine; writes results.csv.
# PYTHON names an interpreter with scikit-learn and BoTorch (pip install botorch scikit-learn).
set -e
cd "$(dirname "$0")"
case=../../../fixtures/references/sklearn
export OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 RAYON_NUM_THREADS=1
(cd ours && cargo build --quiet --release)
(cd egobox && cargo build --quiet --release)
{
    echo "job,peer,wall_ms_min,cpu_ms_min,quality"
    ours/target/release/ours $case
    egobox/target/release/egobox-peer $case/train.csv $case/probe.csv > egobox/target/output.txt
    "${PYTHON:-python3}" peers.py $case egobox/target/output.txt
} > results.csv
