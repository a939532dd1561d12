"""Medians of what `global.py` wrote on stdin: a table of functions by peers, number of seeds behind."""

import statistics
import sys

runs = {}
for line in sys.stdin:
    function, peer, _, distance, spent = line.strip().split(",")
    runs.setdefault(function, {}).setdefault(peer, []).append((float(distance), float(spent)))
peers = ["gp-bayesopt", "egobox", "optuna-gp", "tpe"]
print("| function | " + " | ".join(peers) + " | |")
print("|---|" + "--:|" * len(peers) + "---|")
for function, by_peer in runs.items():
    cells, medians = [], {}
    for peer in peers:
        found = by_peer.get(peer)
        if not found:
            cells.append("")
            continue
        medians[peer] = statistics.median(distance for distance, _ in found)
        spent = statistics.median(spent for _, spent in found)
        cells.append(f"{medians[peer]:.2e} ({len(found)}; {spent:.1f} s)")
    others = [median for peer, median in medians.items() if peer != peers[0]]
    ours = medians.get(peers[0], float("inf"))
    verdict = "met" if others and ours <= min(others) else "**missed**"
    print(f"| {function} | " + " | ".join(cells) + f" | {verdict} |")
