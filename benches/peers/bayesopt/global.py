"""Peers of global optimisation at their default settings, one line of CSV a run.

Usage: global.py PEER FIRST_SEED SEEDS [FUNCTION...]; PEER is tpe, optuna-gp, egobox, or
gp-bayesopt, which is `ours/src/bin/ask.rs` over a pipe.
Columns: function, peer, seed, distance of the best value to the least, processor seconds.
pip install egobox optuna scipy torch; cargo build --release in ours; medians of what was run: summary.py.
"""

import pathlib
import resource
import subprocess
import sys
import warnings

import numpy as np
from functions import FUNCTIONS, shifted

warnings.filterwarnings("ignore")


def optuna_best(sampler, box, function, budget):
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(sampler=sampler)
    study.optimize(
        lambda t: function([t.suggest_float(f"x{i}", l, u) for i, (l, u) in enumerate(box)]),
        n_trials=budget,
    )
    return study.best_value


def tpe(box, function, budget, seed):
    import optuna

    return optuna_best(optuna.samplers.TPESampler(seed=seed), box, function, budget)


def optuna_gp(box, function, budget, seed):
    import optuna
    import torch

    torch.set_num_threads(1)
    return optuna_best(optuna.samplers.GPSampler(seed=seed), box, function, budget)


def egobox(box, function, budget, seed):
    import egobox as egx

    values = []

    def rows(x):
        y = np.array([[function(list(row))] for row in x])
        values.extend(y[:, 0])
        return y

    first = min(max(5, len(box) + 1), budget - 1)
    egor = egx.Egor([list(side) for side in box], n_doe=first, seed=seed)
    egor.minimize(rows, max_iters=budget - first)
    return min(values[:budget])


def gp_bayesopt(box, function, budget, seed):
    program = pathlib.Path(__file__).parent / "ours/target/release/ask"
    limits = [repr(limit) for side in box for limit in side]
    pipe = subprocess.PIPE
    best = float("inf")
    arguments = [program, str(budget), str(seed), *limits]
    with subprocess.Popen(arguments, stdin=pipe, stdout=pipe, text=True, bufsize=1) as study:
        for line in study.stdout:
            value = function([float(v) for v in line.split()])
            best = min(best, value)
            print(repr(value), file=study.stdin, flush=True)
    return best


def processor_s():
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in usage)


PEERS = {"gp-bayesopt": gp_bayesopt, "tpe": tpe, "optuna-gp": optuna_gp, "egobox": egobox}


def main():
    peer, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    wanted = sys.argv[4:]
    for seed in range(first, first + count):
        for index, (name, function, _, least, budget) in enumerate(FUNCTIONS):
            if wanted and name not in wanted:
                continue
            start = processor_s()
            best = PEERS[peer](shifted(index, seed), function, budget, seed)
            spent = processor_s() - start
            print(f"{name},{peer},{seed},{best - least:.6e},{spent:.2f}", flush=True)


main()
