"""Test functions on shifted boxes, the same as in `ours/src/bin/global.rs`.

Each seed moves every interval by up to a tenth of its width, so that no optimum lies at a
centre. Optima are from Surjanovic and Bingham, Virtual Library of Simulation Experiments (2013).
"""

import math

MASK = (1 << 64) - 1


def splitmix(state):
    """A number of [0, 1) from a counter (Steele, Lea, Flood 2014)."""
    z = (state * 0x9E3779B97F4A7C15 + 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return ((z ^ (z >> 31)) >> 11) / float(1 << 53)


def branin(x):
    a = x[1] - 5.1 / (4 * math.pi**2) * x[0] ** 2 + 5 / math.pi * x[0] - 6
    return a * a + 10 * (1 - 1 / (8 * math.pi)) * math.cos(x[0]) + 10


ALPHA = [1.0, 1.2, 3.0, 3.2]
A = [
    [10, 3, 17, 3.5, 1.7, 8],
    [0.05, 10, 17, 0.1, 8, 14],
    [3, 3.5, 1.7, 10, 17, 8],
    [17, 8, 0.05, 10, 0.1, 14],
]
P = [
    [1312, 1696, 5569, 124, 8283, 5886],
    [2329, 4135, 8307, 3736, 1004, 9991],
    [2348, 1451, 3522, 2883, 3047, 6650],
    [4047, 8828, 8732, 5743, 1091, 381],
]


def hartmann6(x):
    total = 0.0
    for alpha, a, p in zip(ALPHA, A, P):
        total -= alpha * math.exp(-sum(a[j] * (x[j] - 1e-4 * p[j]) ** 2 for j in range(6)))
    return total


def ackley(x):
    d = len(x)
    root = math.sqrt(sum(v * v for v in x) / d)
    waves = sum(math.cos(2 * math.pi * v) for v in x) / d
    return -20 * math.exp(-0.2 * root) - math.exp(waves) + 20 + math.e


def rosenbrock(x):
    return sum(100 * (b - a * a) ** 2 + (1 - a) ** 2 for a, b in zip(x, x[1:]))


def levy(x):
    w = [1 + (v - 1) / 4 for v in x]
    total = math.sin(math.pi * w[0]) ** 2
    for v in w[:-1]:
        total += (v - 1) ** 2 * (1 + 10 * math.sin(math.pi * v + 1) ** 2)
    return total + (w[-1] - 1) ** 2 * (1 + math.sin(2 * math.pi * w[-1]) ** 2)


def styblinski(x):
    return 0.5 * sum(v**4 - 16 * v * v + 5 * v for v in x)


# name, function, box, least value, evaluations
FUNCTIONS = [
    ("branin", branin, [(-5.0, 10.0), (0.0, 15.0)], 0.39788735772973816, 50),
    ("hartmann6", hartmann6, [(0.0, 1.0)] * 6, -3.322368011415515, 100),
    ("ackley5", ackley, [(-32.768, 32.768)] * 5, 0.0, 100),
    ("ackley10", ackley, [(-32.768, 32.768)] * 10, 0.0, 150),
    ("rosenbrock4", rosenbrock, [(-5.0, 10.0)] * 4, 0.0, 100),
    ("rosenbrock10", rosenbrock, [(-5.0, 10.0)] * 10, 0.0, 150),
    ("levy5", levy, [(-10.0, 10.0)] * 5, 0.0, 100),
    ("levy10", levy, [(-10.0, 10.0)] * 10, 0.0, 150),
    ("styblinski20", styblinski, [(-5.0, 5.0)] * 20, -39.16616570377142 * 20, 200),
]


def shifted(index, seed):
    """Box of a function for a seed."""
    box = FUNCTIONS[index][2]
    moves = [0.2 * splitmix((index * 1000 + seed) * 64 + i) - 0.1 for i in range(len(box))]
    return [(l + m * (u - l), u + m * (u - l)) for (l, u), m in zip(box, moves)]
