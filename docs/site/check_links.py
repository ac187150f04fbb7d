#!/usr/bin/env python3
"""Fails where a link or image of a folder of HTML leads to no file of it, or to no place in the file, and
where there are no pages.

usage: check_links.py FOLDER
"""
import glob
import html.parser
import os
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.places = [], set()
        with open(path, encoding="utf-8") as file:
            self.feed(file.read())

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.places |= {given[name] for name in ("id", "name") if given.get(name)}
        self.links += [given[name] for name in ("href", "src", "data") if given.get(name)]


def main():
    folder = sys.argv[1]
    pages = {os.path.basename(path): Page(path) for path in glob.glob(os.path.join(folder, "*.html"))}
    if not pages:
        sys.exit(f"{folder} has no pages")
    broken = set()
    for name, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc or link.startswith("javascript"):
                continue
            target = urllib.parse.unquote(parts.path) or name
            place = urllib.parse.unquote(parts.fragment)
            if not os.path.exists(os.path.join(folder, target)):
                broken.add(f"{name}: no file {link}")
            elif place and target in pages and place not in pages[target].places:
                broken.add(f"{name}: no place {link}")
    print("\n".join(sorted(broken)) or f"{len(pages)} pages, all links lead somewhere")
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main())
