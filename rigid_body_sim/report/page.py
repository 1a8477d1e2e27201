"""The report's page: one HTML file that needs nothing else, and the same as Markdown."""

import csv
import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from .section import Block, Heading, Paragraph, Picture, Table

TITLE = "rigid_body_sim: the report"
FACTS = "made.json"  # machine, versions, seed and command line
Chapters = Sequence[tuple[str, Sequence[Block]]]  # title and blocks


def write(folder: Path, facts: Mapping[str, str], headlines: Sequence[str], chapters: Chapters) -> None:
    """Write report.html, report.md the facts, and every table as CSV and JSON into the folder of the pictures."""
    (folder / "report.html").write_text(_html(folder, facts, headlines, chapters), encoding="utf-8")
    (folder / "report.md").write_text(_markdown(facts, headlines, chapters), encoding="utf-8")
    (folder / FACTS).write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    for _, blocks in chapters:
        for block in blocks:
            if isinstance(block, Table):
                _write_table(folder, block)


def _write_table(folder: Path, table: Table) -> None:
    with (folder / f"{table.stem}.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([table.columns, *table.rows])
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    (folder / f"{table.stem}.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def shown(value: str | float | int | None) -> str:
    """A cell of a table as text."""
    if value is None:
        return "–"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


# HTML -----------------------------------------------------------------------------------------------------------------


def _html(folder: Path, facts: Mapping[str, str], headlines: Sequence[str], chapters: Chapters) -> str:
    style, script = (resources.files(__package__).joinpath(file).read_text(encoding="utf-8") for file in _PARTS)
    contents = "".join(f'<li><a href="#part{i}">{html.escape(title)}</a></li>' for i, (title, _) in enumerate(chapters))
    body = "".join(_chapter(folder, i, *chapter) for i, chapter in enumerate(chapters))
    lines = "".join(f"<li>{_inline(line)}</li>" for line in headlines)
    rows = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd>" for name, value in facts.items())
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{TITLE}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">'
        f"<style>{style}</style></head><body><main><h1>{TITLE}</h1>"
        f'<ul class="headlines">{lines}</ul><nav><ul>{contents}</ul></nav>{body}'
        f"<section><h2>How it was made</h2><dl>{rows}</dl></section></main><script>{script}</script></body></html>\n"
    )


def _chapter(folder: Path, number: int, title: str, blocks: Sequence[Block]) -> str:
    inner = "".join(_block(folder, block) for block in blocks)
    return f'<section id="part{number}"><h2>{html.escape(title)}</h2>{inner}</section>'


_PARTS = ("page.css", "page.js")


def _inline(text: str) -> str:
    """Text with `names` in backticks set as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def _block(folder: Path, block: Block) -> str:
    if isinstance(block, Heading):
        return f"<h3>{html.escape(block.text)}</h3>"
    if isinstance(block, Paragraph):
        return f"<p>{_inline(block.text)}</p>"
    if isinstance(block, Picture):
        return f"<figure>{_svg(folder, block)}<figcaption>{_inline(block.caption)}</figcaption></figure>"
    return _table(block)


def _svg(folder: Path, picture: Picture) -> str:
    """The picture itself, with its own names for its parts: several of them share the page."""
    text = (folder / f"{picture.stem}.svg").read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'( id="|href="#|url\(#)', rf"\g<1>{picture.stem}-", text)
    label = html.escape(picture.caption, quote=True)
    return text.replace("<svg", f'<svg role="img" aria-label="{label}"', 1)


def _table(table: Table) -> str:
    head = "".join(f'<th><button type="button">{html.escape(column)}</button></th>' for column in table.columns)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    inner = f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    caption = f'{_inline(table.caption)} <span class="files">{table.stem}.csv, .json</span>'
    if table.folded:
        return f"<details><summary>{caption}</summary>{inner}</details>"
    return f'<p class="caption">{caption}</p>{inner}'


def _cell(value: str | float | int | None) -> str:
    if isinstance(value, str):
        return f"<td>{_inline(value)}</td>"
    return f'<td class="number" data-value="{"" if value is None else value}">{shown(value)}</td>'


# Markdown -------------------------------------------------------------------------------------------------------------


def _markdown(facts: Mapping[str, str], headlines: Sequence[str], chapters: Chapters) -> str:
    parts = [f"# {TITLE}", "\n".join(f"- {line}" for line in headlines)]
    for title, blocks in chapters:
        parts += [f"## {title}", *map(_block_markdown, blocks)]
    parts += ["## How it was made", "\n".join(f"- {name}: {value}" for name, value in facts.items())]
    return "\n\n".join(part for part in parts if part) + "\n"


def _block_markdown(block: Block) -> str:
    if isinstance(block, Heading):
        return f"### {block.text}"
    if isinstance(block, Paragraph):
        return block.text
    if isinstance(block, Picture):
        return f"![{block.caption}]({block.stem}.svg)"
    files = f"[{block.stem}.csv]({block.stem}.csv)"
    return f"{block.caption} {files}" if block.folded else f"{block.caption} {files}\n\n{markdown_table(block)}"


def markdown_table(table: Table) -> str:
    """A table in Markdown, without its caption."""
    lines = [table.columns, ["---"] * len(table.columns), *([shown(cell) for cell in row] for row in table.rows)]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
