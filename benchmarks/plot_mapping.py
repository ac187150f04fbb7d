#!/usr/bin/env python3
"""Plots what mapping_quality wrote (CSV) as SVG. Needs matplotlib.

plot_mapping.py stages  mapping.csv ... -o stages.svg     the profile: nanoseconds a point of each stage, by scene
plot_mapping.py density density.csv ... -o density.svg    seconds, and memory beyond the points, against points
"""
import argparse
import csv
import pathlib
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "globalmatch"  # the same file for the same data
from matplotlib import pyplot  # noqa: E402


def rows_of(files):
    for file in files:
        with open(file, newline="") as stream:
            yield from csv.DictReader(stream)


def stages_of(row):
    """Seconds by name, from "name seconds; name seconds; "."""
    return {name: float(value) for name, value in (s.strip().rsplit(" ", 1) for s in row["stages"].split(";") if s.strip())}


def plot_stages(files):
    seconds, points = defaultdict(lambda: defaultdict(float)), defaultdict(float)
    for row in rows_of(files):
        points[row["scene"]] += float(row["points"])
        for stage, value in stages_of(row).items():
            seconds[stage][row["scene"]] += value
    scenes = list(points)
    left = [0.0] * len(scenes)
    for stage in sorted(seconds, key=lambda s: -sum(seconds[s].values())):
        widths = [1e9 * seconds[stage][scene] / points[scene] for scene in scenes]
        pyplot.barh(scenes, widths, left=left, label=stage)
        left = [a + b for a, b in zip(left, widths)]
    pyplot.gca().invert_yaxis()
    pyplot.xlabel("ns a point")
    pyplot.legend(fontsize="small")


def plot_density(files):
    rows = sorted(rows_of(files), key=lambda row: float(row["points"]))
    points = [float(row["points"]) for row in rows]
    figure, (time, memory) = pyplot.subplots(2, 1, sharex=True)
    time.loglog(points, [float(row["seconds"]) for row in rows], marker="o")
    time.set_ylabel("seconds")
    memory.semilogx(points, [float(row["megabytes"]) * 1048576 / float(row["points"]) for row in rows], marker="o")
    memory.set_ylim(bottom=0)
    memory.set_ylabel("bytes a point")
    memory.set_xlabel("points of the scan")
    figure.align_ylabels()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=["stages", "density"])
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    {"stages": plot_stages, "density": plot_density}[arguments.kind](arguments.files)
    pyplot.tight_layout()
    pyplot.savefig(arguments.output, metadata={"Date": None})


if __name__ == "__main__":
    main()
