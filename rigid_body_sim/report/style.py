"""How pictures look: fonts, colours and grid in one place, each as SVG and PNG. Imports matplotlib when used."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from .section import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito's colours: told apart with any colour vision.
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, RED, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip
GREY, LIGHT = "#777777", "#DDDDDD"
_STYLE = {
    "font.size": 11,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": LIGHT,
    "grid.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
PNG_DPI = 110


@contextmanager
def figure(width: float = 9.0, height: float = 6.0) -> Iterator["Figure"]:
    """A figure [inches] in the report's style, which holds inside the ``with``: save it there."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        yield Figure(figsize=(width, height), layout="constrained")


def save(drawn: "Figure", folder: Path, stem: str, caption: str) -> Picture:
    """Write the figure as ``stem``.svg and ``stem``.png, the same bytes for the same picture."""
    import matplotlib

    if (engine := drawn.get_layout_engine()) is not None:
        engine.execute(drawn)  # once for both files
        drawn.set_layout_engine("none")
    with matplotlib.rc_context({"svg.hashsalt": stem}):
        drawn.savefig(folder / f"{stem}.svg", metadata={"Date": None, "Creator": None})
    drawn.savefig(folder / f"{stem}.png", dpi=PNG_DPI, metadata={"Software": None})
    return Picture(stem, caption)
