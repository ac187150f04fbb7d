#!/usr/bin/env python3
"""Draws the figures of an evaluation from the CSV files that evaluate_dataset wrote. Needs matplotlib.

plot_dataset.py DIR     writes DIR/figures/*.svg

times               histograms of running times: mapping, matching, both ([GM] Fig. "efficiency statistics")
growth              running time against stems, with fitted exponents
overlap             histogram of stem-based overlap, with the success in each bin
errors              pointwise errors of the pairs without the middle scan, cut at 10 m (refused: there)
degrees_of_freedom  horizontal and vertical errors with 4 and with 6 degrees of freedom
success             success against overlap and against common stems, with intervals of 95 % (Wilson);
                    of matching alone on maps that are cut off, too; a line of axes for each method
"""
import csv
import math
import pathlib
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("plot_dataset.py: matplotlib is missing (Debian: python3-matplotlib)")

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "globalmatch"  # the same file for the same data
from matplotlib import pyplot  # noqa: E402

SUCCESS = 0.5  # [m] pointwise error of a registration that is right, [GM] 5.1.2
CUT = 10  # [m] larger errors are drawn there, as in [GM]
COLOURS = {"right": "tab:green", "refused": "tab:gray", "wrong": "tab:red"}


def colour_of(i):
    """Twenty colours, so that no two of the series are alike."""
    return matplotlib.colormaps["tab20"]((2 * i + i // 10) % 20)


def marker_of(i):
    return "osv^D"[i % 5]


def rows_of(file):
    if not file.exists():
        return []
    with open(file, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def outcome_of(pair):
    if pair["right"] == "1":
        return "right"
    return "wrong" if pair["outcome"] == "registered" else "refused"


def outcome_of_run(run):
    if run["right"] == "1":
        return "right"
    return "wrong" if run["found"] == "1" else "refused"


def wilson(right, count):
    z = 1.959963984540054
    p = right / count
    center = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count))
    return max(0, center - half), min(1, center + half)


def exponent(points):
    """Slope and intercept of log(y) over log(x); nothing where x varies by less than a factor of two."""
    logs = [(math.log(x), math.log(y)) for x, y in points if x > 0 and y > 0]
    n = len(logs)
    if n < 3 or max(u for u, _ in logs) - min(u for u, _ in logs) < math.log(2):
        return None
    mean_u, mean_v = sum(u for u, _ in logs) / n, sum(v for _, v in logs) / n
    slope = sum((u - mean_u) * (v - mean_v) for u, v in logs) / sum((u - mean_u) ** 2 for u, _ in logs)
    return slope, mean_v - slope * mean_u


def stems_of(row):
    return math.sqrt(float(row["source_stems"]) * float(row["target_stems"]))


def draw_times(scans, pairs, _):
    mapping = [float(s["mapping_seconds"]) for s in scans]
    matching = [float(p["matching_seconds"]) for p in pairs]
    both = [float(p["mapping_seconds"]) + float(p["matching_seconds"]) for p in pairs]
    stages = [("mapping a scan", mapping), ("matching a pair", matching), ("mapping both, matching", both)]
    stages = [(name, seconds) for name, seconds in stages if seconds]
    _, axes = pyplot.subplots(1, len(stages), figsize=(4.2 * len(stages), 3.4), squeeze=False)
    for ax, (name, seconds) in zip(axes[0], stages):
        ax.hist(seconds, bins=20, color="tab:blue", edgecolor="white")
        ax.axvline(sum(seconds) / len(seconds), color="black", linestyle="--", linewidth=1)
        ax.set_title(f"{name}: mean {sum(seconds) / len(seconds):.3g} s", fontsize="medium")
        ax.set_xlabel("seconds")
        ax.set_ylabel("runs")
    pyplot.tight_layout()


def draw_growth(scans, pairs, runs):
    series = {"mapping a scan": [(float(s["stems"]), float(s["mapping_seconds"])) for s in scans],
              "matching a pair": [(stems_of(p), float(p["matching_seconds"])) for p in pairs]}
    for run in runs:  # maps that are cut off count in no exponent, as in tables.md
        if not run["range"]:
            series.setdefault(f"{run['method']}, alone", []).append((stems_of(run), float(run["seconds"])))
    pyplot.figure(figsize=(7.5, 5))
    for i, (name, points) in enumerate(series.items()):
        points = sorted((x, y) for x, y in points if x > 0 and y > 0)
        if not points:
            continue
        fit = exponent(points)
        label = name + (f": exponent {fit[0]:.2f}" if fit else "")
        pyplot.scatter(*zip(*points), s=14, alpha=0.6, color=colour_of(i), marker=marker_of(i), label=label)
        if fit:
            ends = [points[0][0], points[-1][0]]
            pyplot.plot(ends, [math.exp(fit[1]) * x ** fit[0] for x in ends], color=colour_of(i), linewidth=1)
    pyplot.xscale("log")
    pyplot.yscale("log")
    pyplot.xlabel("stems (of a pair: geometric mean)")
    pyplot.ylabel("seconds")
    pyplot.grid(alpha=0.3, which="both")
    pyplot.legend(fontsize="small", loc="center left", bbox_to_anchor=(1, 0.5))


def draw_overlap(_, pairs, __):
    bins = [i / 10 for i in range(11)]
    _, ax = pyplot.subplots(figsize=(7, 4.2))
    overlap = lambda p: min(0.999, float(p["overlap"]))  # noqa: E731
    by_outcome = [[overlap(p) for p in pairs if outcome_of(p) == name] for name in COLOURS]
    ax.hist(by_outcome, bins=bins, stacked=True, color=list(COLOURS.values()), edgecolor="white",
            label=list(COLOURS))
    ax.set_ylabel("pairs")
    ax.set_xlabel("stems in both maps / stems in the smaller map")
    ax.set_xlim(0, 1)
    rate = ax.twinx()
    for low, high in zip(bins, bins[1:]):
        own = [p for p in pairs if low <= overlap(p) < high]
        if own:
            right = sum(outcome_of(p) == "right" for p in own)
            rate.plot((low + high) / 2, 100 * right / len(own), "ko", markersize=4)
            rate.annotate(f"{right}/{len(own)}", ((low + high) / 2, 100 * right / len(own)), ha="center",
                          fontsize="x-small", textcoords="offset points", xytext=(0, 5))
    rate.set_ylim(0, 112)
    rate.set_yticks(range(0, 101, 20))
    rate.set_ylabel("right [%] (dots)")
    ax.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1), ncol=3, frameon=False)


def draw_errors(_, pairs, runs):
    others = [p for p in pairs if p["with_middle"] == "0"]
    whole = [r for r in runs if r["with_middle"] == "0" and r["size"] == "all" and not r["range"]]
    plots = list(dict.fromkeys(p["plot"] for p in others))
    if not plots:
        return False
    methods = list(dict.fromkeys(r["method"] for r in whole))
    columns = min(3, len(plots))
    lines = math.ceil(len(plots) / columns)
    size = (4.6 * columns, 2.9 * lines + 0.6)
    figure, axes = pyplot.subplots(lines, columns, figsize=size, squeeze=False, sharey=True)
    for ax in axes.flat[len(plots):]:
        ax.axis("off")
    for ax, plot in zip(axes.flat, plots):
        own = [p for p in others if p["plot"] == plot]
        keys = [(p["source"], p["target"]) for p in own]
        # What a method, ours too, gave no transform for counts as a failure.
        cut = lambda text: min(CUT, float(text)) if text else CUT  # noqa: E731
        ours = [cut(p["coarse_e_p"]) if p["outcome"] == "registered" else CUT for p in own]
        ax.plot(range(len(own)), ours, "o-", color="black", label="ours", markersize=4)
        for i, method in enumerate(methods):
            found = {(r["source"], r["target"]): cut(r["e_p"]) for r in whole
                     if r["plot"] == plot and r["method"] == method}
            points = [(k, found[key]) for k, key in enumerate(keys) if key in found]
            if points:
                ax.plot(*zip(*points), marker=".", linewidth=0.8, color=colour_of(i), label=method)
        ax.set_yscale("log")
        ax.axhline(SUCCESS, color="gray", linestyle="--", linewidth=0.8, label="right below (0.5 m)")
        ax.set_xlabel("pair: source-target", fontsize="small")
        ax.set_title(plot, fontsize="medium")
        step = max(1, len(keys) // 12)
        ax.set_xticks(range(0, len(keys), step))
        short = lambda name: name if len(name) <= 4 else name.rsplit("_", 1)[-1][:6]  # noqa: E731
        labels = [f"{short(s)}-{short(t)}" for s, t in keys[::step]]
        ax.set_xticklabels(labels, rotation=90, fontsize="x-small")
        ax.grid(alpha=0.3)
    for line in axes:
        line[0].set_ylabel("coarse e_p [m]")
    named = [ax.get_legend_handles_labels() for ax in axes.flat[:len(plots)]]
    handles, labels = max(named, key=lambda of: len(of[1]))  # not every method bears every plot
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.35 / figure.get_figheight()))
    figure.legend(handles, labels, loc="upper center", ncol=len(labels), fontsize="small")
    return True


def draw_degrees_of_freedom(_, pairs, __):
    figure, axes = pyplot.subplots(1, 2, figsize=(9, 4), sharey=True)
    is_drawn = False
    for ax, dof in zip(axes, ("4", "6")):
        right = [p for p in pairs if p[f"dof{dof}_right"] == "1"]
        columns = [f"dof{dof}_{column}" for column in ("e_p", "horizontal", "vertical")]
        values = [[100 * float(p[column]) for p in right] for column in columns]
        if right:
            is_drawn = True
            ax.boxplot(values, showmeans=True, meanprops={"marker": "^"}, flierprops={"markersize": 3})
            ax.set_yscale("log")
        ax.set_xticks([1, 2, 3])
        ax.set_xticklabels(["3-D", "horizontal", "vertical"])
        ax.set_title(f"{dof} degrees of freedom: {len(right)} of {len(pairs)} pairs right", fontsize="medium")
        ax.grid(alpha=0.3, axis="y")
    axes[0].set_ylabel("pointwise error, coarse [cm]")
    figure.text(0.5, 0.0, "box: quartiles; line: median; triangle: mean; dots: beyond 1.5 times the box",
                ha="center", fontsize="small")
    return is_drawn


OVERLAPS = [i / 10 for i in range(10)] + [math.inf]
COMMON = [0, 3, 4, 5, 6, 7, 8, 10, 12, 15, 20, 30, 50, 100, 200, math.inf]


def curve(ax, values, edges):
    """Shares of what is right and wrong in bins, with their intervals: pairs of a value and an outcome."""
    for name, style in (("right", "o-"), ("wrong", "x:")):
        xs, shares, around = [], [], [[], []]
        for low, high in zip(edges, edges[1:]):
            own = [(x, outcome) for x, outcome in values if low <= x < high]
            if not own:
                continue
            share = sum(outcome == name for _, outcome in own) / len(own)
            least, most = wilson(sum(outcome == name for _, outcome in own), len(own))
            xs.append(sum(x for x, _ in own) / len(own))
            shares.append(100 * share)
            around[0].append(max(0, 100 * (share - least)))
            around[1].append(max(0, 100 * (most - share)))
        ax.errorbar(xs, shares, yerr=around, fmt=style, color=COLOURS[name], capsize=2, markersize=4,
                    linewidth=1, elinewidth=0.7, label=f"{name}, 95 % intervals")


def draw_success(_, pairs, runs):
    """Ours on all pairs, and each method on the maps as they are and cut off at ranges."""
    series = {"ours, scans": (pairs, outcome_of)}
    for method in dict.fromkeys(r["method"] for r in runs):
        own = [r for r in runs if r["method"] == method and r["size"] == "all"]
        series[f"{method}, maps"] = (own, outcome_of_run)
    series = {label: of for label, of in series.items() if of[0]}
    shape = {"squeeze": False, "sharey": True, "sharex": "col"}
    figure, axes = pyplot.subplots(len(series), 2, figsize=(10, 1.9 * len(series) + 0.8), **shape)
    for (left, right), (label, (own, outcome)) in zip(axes, series.items()):
        common = [(float(p["common"]), outcome(p)) for p in own]
        smaller = [max(1, min(float(p["source_stems"]), float(p["target_stems"]))) for p in own]
        overlap = [(n / of, result) for (n, result), of in zip(common, smaller)]
        curve(left, overlap, OVERLAPS)
        curve(right, common, COMMON)
        left.set_title(f"{label}: {len(own)} pairs", fontsize="small", loc="left")
        left.set_ylabel("pairs [%]")
        for ax in (left, right):
            ax.set_ylim(-3, 103)
            ax.set_yticks(range(0, 101, 25))
            ax.grid(alpha=0.3)
    left, right = axes[-1]
    left.set_xlabel("overlap: stems in both maps / stems in the smaller map")
    left.set_xlim(0, 1.03)
    right.set_xlabel("stems in both maps")
    right.set_xscale("symlog", linthresh=10)
    right.set_xlim(left=0)
    ticks = [t for t in (0, 2, 4, 6, 8, 10, 20, 50, 100, 200, 500) if t <= right.get_xlim()[1]]
    right.set_xticks(ticks)
    right.set_xticklabels(ticks)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.35 / figure.get_figheight()))
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncol=2, fontsize="small", frameon=False)


FIGURES = {"times": draw_times, "growth": draw_growth, "overlap": draw_overlap, "errors": draw_errors,
           "degrees_of_freedom": draw_degrees_of_freedom, "success": draw_success}


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    data = [rows_of(folder / f"{name}.csv") for name in ("scans", "pairs", "matching")]
    if not data[0]:
        sys.exit(f"plot_dataset.py: {folder} holds no scans.csv of evaluate_dataset --out-dir {folder}")
    (folder / "figures").mkdir(exist_ok=True)
    for name, draw in FIGURES.items():
        if data[1] or name in ("times", "growth"):
            file = folder / "figures" / f"{name}.svg"
            if draw(*data) is not False:
                pyplot.savefig(file, bbox_inches="tight", metadata={"Date": None})
            else:
                file.unlink(missing_ok=True)
            pyplot.close("all")


if __name__ == "__main__":
    main()
