"""Put the main picture and table of a report into the README: `python -m bench.readme FOLDER`."""

import json
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rigid_body_sim.command_line import Parser
from rigid_body_sim.report import error_section, frontier, page
from rigid_body_sim.report.section import Table

STEM = "error_overview"
BEGIN, END = "<!-- report: begin -->", "<!-- report: end -->"


def part(folder: Path) -> str:
    """The table of a report and the sentence that says where and when it was made."""
    rows = json.loads((folder / f"{STEM}.json").read_text(encoding="utf-8"))
    facts = json.loads((folder / page.FACTS).read_text(encoding="utf-8"))
    table = page.markdown_table(Table(STEM, list(rows[0]), [list(row.values()) for row in rows]))
    quick = " --quick" if "--quick" in facts["command"] else ""  # the rest is where files lie on that machine
    made = f"Made by `rigid_body_report{quick}` on {facts['date']}, {facts['machine']}."
    return "\n\n".join(filter(None, (table, cheaper(rows), made)))


def cheaper(rows: Sequence[Mapping[str, Any]]) -> str:
    """On how many of the table's problems another library costs less; nothing if none was measured."""
    if not any(row[error_section.BEST_LIBRARY] for row in rows):
        return ""
    less, near = (
        sum(row[column] is not None and row[column] < 1.0 - frontier.TIE for row in rows)
        for column in (error_section.TIMES, error_section.TIMES_NEAR)
    )
    return (
        f"Another library costs less than `taylor` and `auto` on {less} of {len(rows)} problems at an error of "
        f"{frontier.AT:.0e}, and on {near} near round-off ({frontier.NEAR:g} times their least error, "
        f"{frontier.NEAR_AT_BEST:.0e} at least). Compiling, which it does for a problem and a tolerance, is apart."
    )


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
