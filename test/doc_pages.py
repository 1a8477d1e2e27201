"""The pages of the documentation, and the blocks of code in them."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
TUTORIALS = sorted(ROOT.glob("docs/tutorials/*.md"))
FRAGMENT = "# Fragment: "  # how a block begins that runs nowhere; what follows says why, or of what it is one
_BLOCK = re.compile(r"^```(.*)\n((?:(?!```).*\n)*?)```$", re.M)
# Beside a block whose comment would be in the way of who copies it.
_NOT_RUN = "<!-- not run by a test: "


class Block(NamedTuple):
    """A fenced block: its language and its text, and whether it says that it runs nowhere."""

    language: str
    text: str
    fragment: bool

    @property
    def file(self):
        """The name of the file that a reader is to make of it, which its first line has; else None."""
        named = re.match(r"# ([\w.]+\.(?:py|yaml))\n", self.text)
        return named and named[1]


def blocks(page):
    """All blocks of a page, in their order."""
    text = page.read_text(encoding="utf-8")
    for found in _BLOCK.finditer(text):
        before = text[: found.start()].rstrip().rpartition("\n")[2]
        yield Block(found[1], found[2], found[2].startswith(FRAGMENT) or before.startswith(_NOT_RUN))


def named(page):
    """The page from the root of the repository, as the name of a test."""
    return str(page.relative_to(ROOT))
