"""Follows the links of the book in target/book and of the pages outside of it.

Every page of docs/ is a chapter. A link within the project leads to a file, and to a heading of it if it
names one. Chapters link to nothing outside of docs/, since that is not in the book.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
BOOK = ROOT / "target" / "book"
OUTSIDE = ["README.md", "CHANGELOG.md", "fam-py/README.md", "blender/README.md"]


class Page(HTMLParser):
    """The links of a page and what they can lead to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id":
                self.ids.add(value or "")
            elif name in ("href", "src") and tag in ("a", "img"):
                self.links.append(value or "")


def of_markdown(path: Path) -> tuple[list[str], set[str]]:
    """The links of a page that is not in the book, and the names of its headings."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    names = {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in headings}
    return re.findall(r"\]\(([^)\s]+)\)", text), names


def main() -> int:
    chapters = {path.stem for path in DOCS.glob("*.md")} - {"SUMMARY"}
    pages = {path: Page(path) for path in BOOK.rglob("*.html")}
    faults = [
        f"docs/{name}.md is not in docs/SUMMARY.md"
        for name in sorted(chapters)
        if BOOK / f"{name}.html" not in pages
    ]
    followed = 0

    def follow(source: Path, link: str, own: set[str]) -> None:
        nonlocal followed
        parts = urlsplit(link)
        if parts.scheme or parts.netloc:
            return
        followed += 1
        target = (source.parent / unquote(parts.path)).resolve() if parts.path else source
        is_of_book = source.is_relative_to(BOOK)
        if not is_of_book and target.parent == DOCS and target.stem in chapters:
            target = BOOK / f"{target.stem}.html"
        ids = own if target == source else pages[target].ids if target in pages else None
        if not target.exists() or (is_of_book and not target.is_relative_to(BOOK)):
            faults.append(f"{source.relative_to(ROOT)}: {link} leads nowhere")
        elif parts.fragment and ids is not None and unquote(parts.fragment) not in ids:
            faults.append(f"{source.relative_to(ROOT)}: {link} leads to no heading")

    # The same chapters once more, on one page for printing.
    del pages[BOOK / "print.html"]
    for path, page in pages.items():
        for link in page.links:
            follow(path, link, page.ids)
    for path in map(ROOT.joinpath, OUTSIDE):
        links, names = of_markdown(path)
        for link in links:
            follow(path, link, names)
    print(f"{followed} links in {len(pages) + len(OUTSIDE)} pages, {len(faults)} lead nowhere")
    print(*faults, sep="\n", file=sys.stderr)
    return 1 if faults else 0


sys.exit(main())
