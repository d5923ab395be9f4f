"""Every link of the built pages leads to a page and a place that are there, and nothing is fetched.

python .ci/check_site.py build/docs
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: What a browser fetches to show a page, and the attribute that names it.
FETCHED = {"script": "src", "img": "src", "iframe": "src", "link": "href", "source": "src"}


class Page(HTMLParser):
    """The places of a page, its links, and what it fetches."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Called for each tag."""
        given = {name: value or "" for name, value in attrs}
        self.places |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if FETCHED.get(tag) in given:
            self.fetched.append(given[FETCHED[tag]])


def problems(site: Path) -> Iterator[str]:
    """What is wrong, one line each."""
    # A mechanism that moves carries its own program; its page has no links.
    paths = [path for path in sorted(site.rglob("*.html")) if path.parent.name != "moving"]
    pages = {path: Page(path) for path in paths}
    if not pages:
        yield f"{site}: no pages"
    for path, page in pages.items():
        here = path.relative_to(site)
        for url in (*page.links, *page.fetched):
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                if url in page.fetched and parts.scheme != "data":
                    yield f"{here}: fetches {url}"
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                yield f"{here}: {url}: there is no such file"
            elif parts.fragment and unquote(parts.fragment) not in pages[target].places:
                yield f"{here}: {url}: there is no such place"


if __name__ == "__main__":
    found = sorted(set(problems(Path(sys.argv[1]).resolve())))
    print("".join(f"{line}\n" for line in found), end="")
    sys.exit(bool(found))
