#!/usr/bin/env python3
"""Plots what matching_complexity, matching_windows and decision_rates wrote (CSV) as SVG. Needs matplotlib.

plot_matching.py time    complexity.csv ... -o time.svg     median time against stems, by matcher and layout
plot_matching.py memory  complexity.csv ... -o memory.svg   peak memory against stems
plot_matching.py success complexity.csv ... -x overlap -o success.svg   share registered rightly against a column
plot_matching.py curve   windows.csv ...    -o curve.svg    the same against stems that both windows show
plot_matching.py calibration window_probabilities.csv -o calibration.svg    share that is right against the probability that was reported
"""
import argparse
import csv
import pathlib
import statistics
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "globalmatch"  # the same file for the same data
from matplotlib import pyplot  # noqa: E402


def rows_of(files):
    for file in files:
        with open(file, newline="") as stream:
            for row in csv.DictReader(stream):
                yield pathlib.Path(file).stem, row


def against_stems(arguments, column, summary):
    values = defaultdict(list)
    for _, row in rows_of(arguments.files):
        values[row["matcher"], row["layout"], int(row["stems"])].append(float(row[column]))
    for matcher, layout in sorted({key[:2] for key in values}):
        stems = sorted(key[2] for key in values if key[:2] == (matcher, layout))
        pyplot.loglog(stems, [summary(values[matcher, layout, n]) for n in stems], marker="o", label=f"{matcher}, {layout}")
    pyplot.xlabel("stems in each map")


def plot_time(arguments):
    against_stems(arguments, "seconds", statistics.median)
    pyplot.ylabel("median time [s]")


def plot_memory(arguments):
    against_stems(arguments, "peak_mb", max)
    pyplot.ylabel("peak memory of the process [MB]")


def plot_success(arguments):
    outcomes = defaultdict(list)
    for _, row in rows_of(arguments.files):
        outcomes[row["matcher"], row["layout"], float(row[arguments.x])].append(row["right"] == "1")
    for matcher, layout in sorted({key[:2] for key in outcomes}):
        xs = sorted(key[2] for key in outcomes if key[:2] == (matcher, layout))
        pyplot.plot(xs, [100 * statistics.mean(outcomes[matcher, layout, x]) for x in xs], marker="o", label=f"{matcher}, {layout}")
    pyplot.xlabel(arguments.x.replace("_", " "))
    pyplot.ylabel("registered rightly [%]")


def plot_curve(arguments):
    min_pairs = 20  # pairs behind a point of the curve
    default_limit = 1e-3  # on the number of false alarms
    counts = defaultdict(lambda: [0, 0])
    for name, row in rows_of(arguments.files):
        if float(row.get("limit", default_limit)) != default_limit:
            continue
        count = counts[name, row["trees"], float(row["noise"]), int(row["common"])]
        count[0] += int(row["pairs"])
        count[1] += int(row["registered_right"])
    noises = sorted({key[2] for key in counts})
    names = sorted({key[0] for key in counts})
    sizes = sorted({key[1] for key in counts})
    figure, axes = pyplot.subplots(1, len(noises), sharey=True, squeeze=False, figsize=(5 * len(noises), 4.5))
    for ax, noise in zip(axes[0], noises):
        for name, trees in sorted({key[:2] for key in counts}):
            xs = sorted(key[3] for key, count in counts.items() if key[:3] == (name, trees, noise) and count[0] >= min_pairs)
            ys = [100 * counts[name, trees, noise, x][1] / counts[name, trees, noise, x][0] for x in xs]
            ax.plot(xs, ys, marker=".", color=f"C{names.index(name)}", linestyle=["-", "--", ":"][sizes.index(trees) % 3],
                    label=f"{name}, {trees} trees")
        ax.set_title(f"noise {100 * noise:g} cm")
        ax.set_xlim(0, 30)
        ax.set_xlabel("stems that both maps show")
        ax.grid(alpha=0.3)
    axes[0, 0].set_ylabel("registered rightly [%]")


def plot_calibration(arguments):
    bins = 20
    pairs = sorted((float(row["probability"]), row["best_right"] == "1") for _, row in rows_of(arguments.files))
    reported, was = [], []
    for b in range(bins):
        own = pairs[b * len(pairs) // bins:(b + 1) * len(pairs) // bins]
        reported.append(statistics.mean(p for p, _ in own))
        was.append(statistics.mean(right for _, right in own))
    pyplot.plot([0, 1], [0, 1], color="gray", linewidth=1, label="calibrated")
    pyplot.plot(reported, was, marker="o", label=f"bins of {len(pairs) // bins} pairs")
    pyplot.xlabel("probability that the best hypothesis is right")
    pyplot.ylabel("share that is right")


def main():
    plots = {"time": plot_time, "memory": plot_memory, "success": plot_success, "curve": plot_curve, "calibration": plot_calibration}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plot", choices=plots)
    parser.add_argument("files", nargs="+")
    parser.add_argument("-x", default="overlap", help="column for success")
    parser.add_argument("-o", required=True, help="SVG file")
    arguments = parser.parse_args()
    pyplot.figure(figsize=(7, 5))
    plots[arguments.plot](arguments)
    pyplot.grid(alpha=0.3)
    pyplot.legend(fontsize="x-small")
    pyplot.savefig(arguments.o, bbox_inches="tight", metadata={"Date": None})


if __name__ == "__main__":
    main()
