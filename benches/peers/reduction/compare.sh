#!/bin/sh
# Times the reduction crate and its peers one after the other, each on one thread.
# Usage: benches/peers/reduction/compare.sh PYTHON, where PYTHON has numpy, pydmd
# and minisom. Peers run before and after the crate, so that a drift of the
# machine's speed shows.
set -eu
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 MKL_NUM_THREADS=1
here=$(dirname "$0")
cargo build --quiet --release --package fdi-benches --example reduction_peers
"$1" -c 'import sys, numpy, importlib.metadata as m
print("# python", sys.version.split()[0], "numpy", numpy.__version__, "pydmd", m.version("pydmd"), "minisom", m.version("minisom"))'
echo "# $(rustc --version)"
grep -m 1 'model name' /proc/cpuinfo | sed 's/^model name.*: /# /'
"$1" "$here/peers.py" svd
"${CARGO_TARGET_DIR:-target}/release/examples/reduction_peers" | sed 's/^/reduction /'
"$1" "$here/peers.py" svd | sed 's/^/again-/'
"$1" "$here/peers.py" som
