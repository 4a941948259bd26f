"""Check the links of a built site: every page, anchor and picture that a page of it names must be there.

    python tools/check_links.py site

Addresses outside the site are listed by --outside and never fetched: a check that needs the network is no check.
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The anchors that a page has and the addresses that it names."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.addresses: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect ids, and what links, pictures, scripts and styles point to."""
        for name, value in attrs:
            if value is None:
                continue
            if name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value)
            elif name in ("href", "src"):
                self.addresses.append(value)


def faults(site: Path) -> tuple[list[str], set[str]]:
    """Return one line per broken link, and the addresses outside the site."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    broken: list[str] = []
    outside: set[str] = set()
    for path, page in pages.items():
        if path.name == "404.html":  # its links are absolute, from wherever it is served
            continue
        for address in page.addresses:
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                outside.add(address)
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if target.is_dir():
                target = target / "index.html"
            if not target.exists():
                broken.append(f"{path.relative_to(site)}: {address}: no such page or file")
            elif (
                parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors | {"__top"}
            ):
                broken.append(f"{path.relative_to(site)}: {address}: no such anchor")
    return broken, outside


def main(arguments: list[str]) -> int:
    """Print what is broken; exit status 1 if anything is."""
    site = Path(arguments[0] if arguments else "site").resolve()
    broken, outside = faults(site)
    for line in broken:
        print(line, file=sys.stderr)
    if "--outside" in arguments:
        print(*sorted(outside), sep="\n")
    print(f"links: {len(broken)} broken; {len(outside)} addresses outside the site, not fetched")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
