"""Put the main picture and table of a report into the README: `python -m bench.readme FOLDER`."""

import json
import re
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from rigid_body_sim.command_line import Parser
from rigid_body_sim.report import page
from rigid_body_sim.report.section import Table

STEM = "error_overview"
BEGIN, END = "<!-- report: begin -->", "<!-- report: end -->"


def part(folder: Path) -> str:
    """The table of a report and the sentence that says where and when it was made."""
    rows = json.loads((folder / f"{STEM}.json").read_text(encoding="utf-8"))
    facts = json.loads((folder / page.FACTS).read_text(encoding="utf-8"))
    table = page.markdown_table(Table(STEM, list(rows[0]), [list(row.values()) for row in rows]))
    quick = " --quick" if "--quick" in facts["command"] else ""  # the rest is where files lie on that machine
    return f"{table}\n\nMade by `rigid_body_report{quick}` on {facts['date']}, {facts['machine']}."


def main(args: Sequence[str] | None = None) -> int:
    """Write the part into README.md, and the picture into docs/images."""
    parser = Parser("readme", "Puts the main picture and table of a report into README.md and docs/images.")
    parser.add_argument("folder", type=Path, help="of the report")
    parser.add_argument("root", type=Path, nargs="?", default=Path(), help="of the project (default: this folder)")
    options = parser.parse_args(args)
    folder, root = options.folder, options.root
    readme = root / "README.md"
    new = f"{BEGIN}\n{part(folder)}\n{END}"
    readme.write_text(
        re.sub(f"(?s){BEGIN}.*{END}", lambda _: new, readme.read_text(encoding="utf-8")), encoding="utf-8"
    )
    shutil.copy(folder / f"{STEM}.png", root / "docs/images/report.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
