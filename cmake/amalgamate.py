"""Writes all of globalmatch as one header, for who cannot take a folder: python3 cmake/amalgamate.py OUT.hpp

Headers are put where they are first included, each once. The compiled mode is not for it."""

import pathlib
import re
import sys

INCLUDES = pathlib.Path(__file__).resolve().parent.parent / "include"
OWN = re.compile(r'^\s*#\s*include "(globalmatch/[^"]+)"')


def insert(name, seen, lines):
    if name in seen:
        return
    seen.add(name)
    for line in (INCLUDES / name).read_text(encoding="utf-8").splitlines():
        if own := OWN.match(line):
            insert(own.group(1), seen, lines)
        elif line.strip() != "#pragma once":
            lines.append(line)


def main():
    lines, seen = [], set()
    insert("globalmatch/globalmatch.hpp", seen, lines)
    licence = (INCLUDES.parent / "LICENSE").read_text(encoding="utf-8").splitlines()
    head = ["// globalmatch in one header, made by cmake/amalgamate.py.", "//"]
    head += [f"// {line}".rstrip() for line in licence]
    head += ["#pragma once", "", "#ifdef GLOBALMATCH_COMPILED"]
    head += ['#error "the compiled mode needs the headers as they are; this file has all code"', "#endif", ""]
    out = pathlib.Path(sys.argv[1])
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(head + lines) + "\n", encoding="utf-8")


if len(sys.argv) != 2:
    sys.exit(__doc__)
main()
