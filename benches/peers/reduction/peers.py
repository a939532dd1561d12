"""Timings of numpy, PyDMD and MiniSom on the cases of `benches/src/reduce.rs`.

One warm-up (none for MiniSom, which takes seconds), then as many runs as said,
time of this thread on the processor in milliseconds, so that what else runs on
the machine counts little: `peer job shape runs minimum median` a line.
"""

import sys
import time
import warnings

import numpy as np
from minisom import MiniSom
from pydmd import DMD

warnings.filterwarnings("ignore")


def waves(m, n):
    i, j = np.arange(m)[:, None], np.arange(n)[None, :]
    x, t = i / m, j / n
    total = np.zeros((m, n))
    for k in range(1, 13):
        total += 0.7**k * np.sin(2 * np.pi * (k * x + 0.37 * k * t)) * np.exp(-0.3 * k * t)
    return np.asfortranarray(total + 1e-3 * np.sin(12.9898 * i + 78.233 * j + 0.001 * i * j))


def samples(m, n):
    i, f = np.arange(m)[:, None], np.arange(n)[None, :]
    return np.sin(12.9898 * i + 78.233 * f + 0.013 * i * f) + np.cos(0.001 * i * (f + 1))


def clock(peer, job, shape, runs, work, warm=True):
    if warm:
        work()
    spent = []
    for _ in range(runs):
        start = time.thread_time()
        work()
        spent.append((time.thread_time() - start) * 1e3)
    print(peer, job, shape, runs, f"{min(spent):.3f}", f"{np.median(spent):.3f}", flush=True)


def numpy_batch(data, epochs=100):
    grid = np.array([(i, j) for i in range(6) for j in range(5)], float)
    far = ((grid[:, None] - grid[None]) ** 2).sum(-1)
    weights, squares = data[:30].copy(), (data * data).sum(1)
    for epoch in range(epochs):
        sigma = 1.5 / (1 + epoch / (epochs / 2))
        near = (squares[:, None] - 2 * data @ weights.T + (weights * weights).sum(1)).argmin(1)
        share = np.exp(-far / (2 * sigma * sigma))[near]
        weights = (share.T @ data) / share.sum(0)[:, None]
    return weights


def minisom(data, batch):
    som = MiniSom(6, 5, 31, sigma=1.5, learning_rate=0.5, random_seed=1)
    som.random_weights_init(data)
    if batch:
        som.train_batch_offline(data, 100)
    else:
        som.train(data, 100, use_epochs=True, random_order=True)


def gram(x, rank):
    values, vectors = np.linalg.eigh(x.T @ x)
    right = vectors[:, : -rank - 1 : -1]
    singular = np.sqrt(values[: -rank - 1 : -1])
    return x @ right / singular, singular, right.T


def both_clocks(job, shape, runs, work):
    """Least and median wall time and least time of the whole process, ms."""
    work()
    wall, spent = [], []
    for _ in range(runs):
        start, begun = time.perf_counter(), time.process_time()
        work()
        wall.append((time.perf_counter() - start) * 1e3)
        spent.append((time.process_time() - begun) * 1e3)
    print("numpy", job, shape, runs, f"{min(wall):.3f}", f"{np.median(wall):.3f}", f"{min(spent):.3f}", flush=True)


def main(which):
    if which == "leading":
        for m, runs in ((5000, 9), (20000, 5)):
            x, shape = waves(m, 100), f"{m}x100"
            both_clocks("thin-svd", shape, runs, lambda: np.linalg.svd(x, full_matrices=False))
            both_clocks("gram-30", shape, runs, lambda: gram(x, 30))
    elif which == "svd":
        for m, runs in ((5000, 15), (20000, 7)):
            x, shape = waves(m, 100), f"{m}x100"
            clock("numpy", "thin-svd", shape, runs, lambda: np.linalg.svd(x, full_matrices=False))
            clock("PyDMD", "exact-dmd-30", shape, runs, lambda: DMD(svd_rank=30, exact=True).fit(x))
            clock("PyDMD", "projected-dmd-30", shape, runs, lambda: DMD(svd_rank=30).fit(x))
    else:
        data = samples(5000, 31)
        clock("numpy", "som-batch-100-epochs", "5000x31", 5, lambda: numpy_batch(data))
        clock("MiniSom", "som-batch-100-epochs", "5000x31", 1, lambda: minisom(data, True), False)
        clock("MiniSom", "som-online-100-epochs", "5000x31", 2, lambda: minisom(data, False), False)


if __name__ == "__main__":
    main(sys.argv[1])
