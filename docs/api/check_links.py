"""Every link of the pages in a folder leads to a file, and to an anchor where it names one.

usage: check_links.py DIR
"""

import re
import sys
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(path.read_text(errors="replace"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("href", "src") and value and not re.match(r"[a-z]+:", value):
                self.links.append(unescape(value))
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def main(folder):
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    defects, count = [], 0
    for path, page in pages.items():
        for link in page.links:
            count += 1
            place, _, anchor = unquote(link).partition("#")
            target = (path.parent / place.partition("?")[0]).resolve() if place else path
            if not target.exists():
                defects.append(f"{path.relative_to(folder)}: {link}: no such file")
            elif anchor == "nested-classes":  # of private classes: Doxygen 1.9.4 hides these, but not the link
                continue
            elif anchor and target in pages and anchor not in pages[target].anchors:
                defects.append(f"{path.relative_to(folder)}: {link}: no such anchor")
    if defects or count < 1000:
        print("\n".join(defects) or f"{folder}: expected more than 1000 links, got {count}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
