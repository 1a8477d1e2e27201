"""Write the tables in docs/ that follow from the code: parameters, shapes and integrators from their own tables."""

import re
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from rigid_body_sim import integrators
from rigid_body_sim.command_line import Parser
from rigid_body_sim.mass.shapes import SHAPES
from rigid_body_sim.scene import schema
from rigid_body_sim.tools import actuator_laws, control
from rigid_body_sim.values.parameter import TYPES, Parameter


def parameters_table(table: Iterable[Parameter] = schema.TABLE) -> str:
    """Markdown table of parameters, by default of all that the schema has for the node, in their order."""
    lines = ["| name | type | default | unit | dynamic | allowed | meaning |", "|---|---|---|---|---|---|---|"]
    for p in table:
        shown = "must be given" if p.required else f"`{_shown(p.default)}`"
        dynamic = "yes" if p.dynamic else ""
        rule = integrators.RULE if p.name == "integrator.name" else p.rule
        lines.append(f"| `{p.name}` | {TYPES[p.type]} | {shown} | {p.unit} | {dynamic} | {rule} | {p.text} |")
    return "\n".join(lines)


def _shown(default: object) -> object:
    """A default as a parameter file has it."""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        return list(default)
    return "''" if default == "" else default


def shapes_table() -> str:
    """Markdown table of all shapes and the meaning of their dimensions."""
    lines = ["| `body.shape` | `body.dimensions` [m] | what it is |", "|---|---|---|"]
    for shape in SHAPES.values():
        solid = "" if shape.volume else " No volume: give its mass."
        lines.append(f"| `{shape.name}` | {', '.join(shape.dimensions) or 'none'} | {shape.text}{solid} |")
    return "\n".join(lines)


def integrators_table() -> str:
    """Markdown table of all integrators, in the registry's order."""
    lines = ["| name | order | kind | what it is |", "|---|---|---|---|"]
    for integrator in integrators.REGISTRY.values():
        order = "chosen in each step" if integrator.order is None else integrator.order
        kind = "explicit" if integrator.explicit else "implicit"
        lines.append(f"| `{integrator.name}` | {order} | {kind} | {integrator.text} |")
    return "\n".join(lines)


INTERFACE = "reference/interface.md"
TABLES: tuple[tuple[str, str, Callable[[], str]], ...] = (  # page, name of the table in it, and what makes it
    (INTERFACE, "parameters", parameters_table),
    (INTERFACE, "controller", partial(parameters_table, control.PARAMETERS)),
    *(
        (INTERFACE, f"{name} controller", partial(parameters_table, (actuator_laws.PLANT, *kind.parameters)))
        for name, kind in actuator_laws.KINDS.items()
    ),
    ("reference/conventions.md", "shapes", shapes_table),
    ("how-to/choosing_an_integrator.md", "integrators", integrators_table),
)


def with_table(page: str, name: str, table: str) -> str:
    """``page`` with the lines between ``<!-- name: begin -->`` and ``<!-- name: end -->`` replaced by ``table``."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    return re.sub(f"(?s){begin}.*{end}", lambda _: f"{begin}\n{table}\n{end}", page)


def main(args: Sequence[str] | None = None) -> int:
    """Write all tables into the pages in a folder."""
    parser = Parser("doc_tables", "Writes the tables that follow from the code into the pages of the documentation.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path("docs"), help="of the pages (default %(default)s)")
    folder = parser.parse_args(args).folder
    for file, name, table in TABLES:
        page = folder / file
        page.write_text(with_table(page.read_text(encoding="utf-8"), name, table()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
