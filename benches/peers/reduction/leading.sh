#!/bin/sh
# Times the thirty leading singular values against numpy's full decomposition, in turns.
# Usage: benches/peers/reduction/leading.sh PYTHON, where PYTHON has numpy, pydmd and minisom.
# Each turn runs numpy and this crate one after the other, with one thread and with the
# threads that numpy takes by itself: `turn threads who job shape runs wall-minimum
# wall-median processor-minimum` a line, times in milliseconds.
set -eu
here=$(dirname "$0")
cargo build --quiet --release --package fdi-benches --example reduction_peers
ours=${CARGO_TARGET_DIR:-target}/release/examples/reduction_peers
"$1" -c 'import sys, numpy
print("# python", sys.version.split()[0], "numpy", numpy.__version__)'
echo "# $(rustc --version)"
grep -m 1 'model name' /proc/cpuinfo | sed 's/^model name.*: /# /'
echo "# $(nproc) cores"
for turn in 1 2 3 4 5; do
    OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 "$1" "$here/peers.py" leading | sed "s/^/$turn 1 /"
    "$ours" leading | sed "s/^/$turn 1 reduction /"
    "$1" "$here/peers.py" leading | sed "s/^/$turn default /"
    "$ours" leading | sed "s/^/$turn default reduction /"
done
