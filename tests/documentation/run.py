#!/usr/bin/env python3
"""Runs what README.md and docs/ show: C++ blocks are compiled, programs among them and commands are run.

usage: tests/documentation/run.py [--programs build/release] [--jobs N] [PAGE...]

Blocks with the tags cpp and sh, and those without a tag, which are commands; those with other tags are named
as not run. Each page has a folder of its own, where its blocks run in their order, beside the scans and maps
of `make_inputs`. A C++ block with `main` is a program; one without is compiled alone. What a block with the
tag output holds was printed by the block before, spaces and line ends aside. Comments of one line before a
block say more:

    <!-- not run: REASON -->       it is left out; the reason is printed
    <!-- needs: NAME -->           left out where this command, or library (see `libraries`), is missing
    <!-- saved as: FILE -->        a block of any tag is written to this file of the folder
    <!-- same as: FILE -->         the file of the project that the block repeats
    <!-- run with: ARGUMENTS -->   of the program
"""
import argparse
import concurrent.futures
import dataclasses
import glob
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

root = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))

# Names of `needs` for C++, and their packages of pkg-config.
libraries = {"PCL": "pcl_io", "Open3D": "Open3D"}


@dataclasses.dataclass
class Block:
    page: str
    line: int
    tag: str
    text: str
    marks: dict

    def name(self):
        return f"{self.page}:{self.line}"


class Failure(Exception):
    pass


def blocks_of(page):
    """Fenced blocks, with the comments before them. Throws Failure for a block that has no end."""
    blocks, marks, inside = [], {}, None
    for number, line in enumerate(open(os.path.join(root, page), encoding="utf-8"), 1):
        fence = re.match(r"\s*```(\w*)", line)
        mark = re.match(r"<!-- (not run|needs|saved as|same as|run with): (.*) -->$", line)
        if inside is not None:
            if fence:
                blocks.append(inside)
                inside, marks = None, {}
            else:
                inside.text += line
        elif fence:
            inside = Block(page, number, fence[1] or "sh", "", marks)
        elif mark:
            marks[mark[1]] = mark[2]
        elif line.strip():
            if "<!--" in line:
                raise Failure(f"{page}:{number}: not a mark of tests/documentation/run.py: {line.strip()}")
            marks = {}
    if inside is not None:
        raise Failure(f"{inside.name()}: this block has no end")
    return blocks


def run(command, folder, name, programs=None, **options):
    """Throws Failure with the output where the command fails."""
    environment = dict(os.environ, QT_QPA_PLATFORM="offscreen")  # CloudCompare, without a screen
    if programs:
        path = [os.path.join(programs, f) for f in ("examples", "benchmarks")]
        environment["PATH"] = os.pathsep.join(path + [environment["PATH"]])
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=900, env=environment, **options)
    if done.returncode != 0:
        raise Failure(f"{name}: status {done.returncode}\n{done.stdout}")
    return done.stdout


def flags_of(library, what):
    """What g++ needs for it, to compile (--cflags) or to link (--libs); None where pkg-config knows of none."""
    if not shutil.which("pkg-config"):
        return None
    found = subprocess.run(["pkg-config", what, libraries[library]], capture_output=True, text=True)
    if found.returncode != 0:
        return None
    flags = [flag for flag in found.stdout.split() if not flag.startswith("-std=")]
    return [re.sub("^-I", "-isystem", flag) for flag in flags]


def compile_block(block, folder, programs, flags):
    """Leaves the program, where the block is one, in the folder."""
    stem = block.marks.get("saved as", f"block_{block.line}.cpp").removesuffix(".cpp")
    with open(os.path.join(folder, stem + ".cpp"), "w", encoding="utf-8") as file:
        file.write(block.text)
    is_program = re.search(r"\bint main\(", block.text)
    command = ["c++", "-std=c++20", "-O1", "-Wall", "-Werror", "-pthread", "-DGLOBALMATCH_COMPILED",
               f"-I{root}/include", "-isystem/usr/include/eigen3", *flags,
               f"-idirafter{root}/tests/documentation/stand_ins", stem + ".cpp", "-o", stem]
    if is_program:
        command += [f"{programs}/libglobalmatch_compiled_surveys.a", f"{programs}/libglobalmatch_compiled.a"]
        if "needs" in block.marks:
            command += flags_of(block.marks["needs"], "--libs")
    else:
        command.append("-c")
    run(command, folder, block.name())
    if not is_program:
        return "C++ blocks compiled", ""
    arguments = shlex.split(block.marks.get("run with", ""))
    return "C++ programs run", run(["./" + stem, *arguments], folder, block.name())


def check_output(block, printed):
    """`printed` is None where the block before was not run."""
    if not block.text.strip():
        raise Failure(f"{block.name()}: an output without text")
    if printed is None:
        return "not run", "the block before was not"
    if " ".join(block.text.split()) not in " ".join(printed.split()):
        raise Failure(f"{block.name()}: not what was printed, which is\n{printed}")
    return "outputs compared", ""


def check_same(block):
    with open(os.path.join(root, block.marks["same as"]), encoding="utf-8") as file:
        if file.read() != block.text:
            raise Failure(f"{block.name()}: differs from {block.marks['same as']}")


def run_block(block, folder, programs, printed):
    """What became of it, in words, and what it printed, or why it was not run."""
    if "not run" in block.marks:
        return "not run", block.marks["not run"]
    if block.tag == "output":
        return check_output(block, printed)
    if "same as" in block.marks:
        check_same(block)
    if "saved as" in block.marks:
        with open(os.path.join(folder, block.marks["saved as"]), "w", encoding="utf-8") as file:
            file.write(block.text)
    needed, flags = block.marks.get("needs"), []
    if block.tag == "cpp":
        if needed:
            flags = flags_of(needed, "--cflags")
        if flags is None:
            return "not run", f"{needed} is not installed"
        return compile_block(block, folder, programs, flags)
    if block.tag == "sh":
        if needed and not shutil.which(needed):
            return "not run", f"{needed} is not installed"
        command = ["bash", "-euo", "pipefail", "-c", block.text]
        return "blocks of commands run", run(command, folder, block.name(), programs)
    if block.marks.keys() & {"same as", "saved as"}:
        return "files compared or written", ""
    return "not run", f"it has the tag {block.tag}"


def make_inputs(folder, programs):
    """What pages may name: scans with their truth, in a folder and by themselves, and their stem maps."""
    def here(command):
        run(["bash", "-euo", "pipefail", "-c", command], folder, command, programs)

    here("simulate_plot scans --stations 5 --angular-step 0.25 --seed 3")
    here("ln -s scans folder_of_scans; ln -s scans SCANS")
    here("cp scans/scan_2.ply source.ply; cp scans/scan_1.ply target.ply")
    here("for k in 1 2; do map_stems scans/scan_$k.ply --out stems_$k.csv; done")
    for name in ("examples", "include", "src"):
        os.symlink(os.path.join(root, name), os.path.join(folder, name))
    os.mkdir(os.path.join(folder, "build"))
    os.symlink(programs, os.path.join(folder, "build", "release"))


def run_page(page, inputs, programs):
    """[(block, what became of it, why not)]; a failure ends the page."""
    done, printed = [], None
    with tempfile.TemporaryDirectory() as parent:
        folder = os.path.join(parent, "page")
        shutil.copytree(inputs, folder, symlinks=True)
        for block in blocks_of(page):
            try:
                what, text = run_block(block, folder, programs, printed)
            except (Failure, subprocess.TimeoutExpired) as failure:
                return done + [(block, "failed", str(failure))]
            printed = None if what == "not run" else text
            done.append((block, what, text if what == "not run" else None))
    return done


def report(results):
    counts = {}
    for block, what, why in results:
        counts[what] = counts.get(what, 0) + 1
        if why:
            print(f"{block.name()}: {what}: {why}" if what == "not run" else why)
    print(", ".join(f"{count} {what}" for what, count in sorted(counts.items())))
    return 1 if "failed" in counts or not results else 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", default=os.path.join(root, "build", "release"))
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", 1)))
    parser.add_argument("pages", nargs="*")
    given = parser.parse_args()
    programs = os.path.realpath(given.programs)
    pages = [os.path.relpath(os.path.realpath(p), root) for p in given.pages]
    if not pages:
        pages = ["README.md"] + sorted(glob.glob("docs/**/*.md", root_dir=root, recursive=True))
    with tempfile.TemporaryDirectory() as inputs:
        make_inputs(inputs, programs)
        with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
            of_pages = list(pool.map(lambda page: run_page(page, inputs, programs), pages))
    return report([result for results in of_pages for result in results])


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failure as failure:
        sys.exit(str(failure))
