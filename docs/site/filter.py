#!/usr/bin/env python3
"""Filter of Doxygen: makes of a page or header what Doxygen 1.9 reads, and prints it.

Pages: headings get labels, by which links between pages lead to them; images and files that are no page are
named without their folder, as they are copied beside the pages; comments for tests/documentation go.
Headers: the comment at the top describes the file.
"""
import os
import re
import sys

root = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))


def label(page, anchor=""):
    """Unique and without characters that Doxygen minds."""
    name = re.sub(r"\W", "_", os.path.relpath(page, root).removesuffix(".md").lower())
    return "page_" + name + ("__" + re.sub(r"\W", "_", anchor) if anchor else "")


def anchor_of(heading):  # as GitHub makes them
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def is_beside(file, page):
    folder = os.path.dirname(page)
    return folder != root and os.path.dirname(file) == folder


def link(match, page):
    text, target = match[2], match[3]
    if re.match(r"\w+:", target):
        return match[0]
    path, _, anchor = target.partition("#")
    file = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
    if match[1] or not file.endswith(".md"):
        return f"{match[1]}[{text}]({os.path.basename(file)})"
    if os.path.basename(page) == "README.md" and is_beside(file, page):  # below it in the tree of pages
        return f'@subpage {label(file)} "{text}"'
    return f"[{text}](@ref {label(file, anchor)})"


def page_lines(page):
    fenced, labels = False, set()
    for number, line in enumerate(open(page, encoding="utf-8")):
        if line.startswith("```"):
            fenced = not fenced
            yield re.sub(r"```(text|csv|output)\b", "```{.txt}", line).replace("```sh", "```{.sh}")
            continue
        heading = re.match(r"(#+) (.*)$", line)
        if fenced:
            yield line
        elif heading:
            own = label(page, "" if number == 0 else anchor_of(heading[2]))
            while own in labels:  # links lead to the first heading of that name
                own += "_"
            labels.add(own)
            yield f"{line.rstrip()} {{#{own}}}\n"
        elif not line.startswith("<!--"):
            yield re.sub(r"(!?)\[([^\]]*)\]\(([^()\s]+)\)", lambda m: link(m, page), line)


def header_lines(header):
    lines = open(header, encoding="utf-8").read().split("\n")
    end = next(i for i, line in enumerate(lines) if not line.startswith("//"))
    comment = " ".join(line.removeprefix("//").strip() for line in lines[:end])
    described = [f"/** @file {os.path.basename(header)} @brief {comment} */"] + [""] * (end - 1)
    yield "\n".join(described + lines[end:])  # as many lines: warnings have their numbers


def main():
    path = os.path.realpath(sys.argv[1])
    sys.stdout.writelines(page_lines(path) if path.endswith(".md") else header_lines(path))


if __name__ == "__main__":
    main()
