"""Which stems of two maps astroalign takes for the same, as if they were stars.

usage: astroalign_stems.py STEMS SECONDS_AND_PAIRS
Reads the tolerance [m], the number of source stems, and x and y of all stems, a number or two a line. Writes
the seconds that astroalign took, and a line with the numbers of a source and a target stem for each pair.
"""

import sys
import time

import astroalign
import numpy


def main():
    with open(sys.argv[1]) as file:
        tolerance, sources = float(file.readline()), int(file.readline())
        stems = numpy.loadtxt(file, ndmin=2)
    stems *= astroalign.PIXEL_TOL / tolerance  # its tolerance is one of pixels
    source, target = stems[:sources], stems[sources:]
    start = time.perf_counter()
    try:
        _, pairs = astroalign.find_transform(source, target, max_control_points=len(stems))
    except (ValueError, IndexError, astroalign.MaxIterError):  # IndexError: no triangles are alike
        pairs = ([], [])
    seconds = time.perf_counter() - start
    with open(sys.argv[2], "w") as file:
        file.write(f"{seconds}\n")
        for s, t in zip(*pairs):
            at = [int(numpy.argmin(((a - b) ** 2).sum(axis=1))) for a, b in ((source, s), (target, t))]
            file.write(f"{at[0]} {at[1]}\n")


main()
