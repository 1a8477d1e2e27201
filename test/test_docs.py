"""The documentation says what the code does: tables made from it, names that exist, links that lead somewhere."""

import re
from pathlib import Path

import pytest

from rigid_body_sim import __version__
from rigid_body_sim.tools import doc_tables

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])


@pytest.mark.parametrize("file", doc_tables.TABLES)
def test_table_is_what_the_code_gives(file):
    name, table = doc_tables.TABLES[file]
    page = (ROOT / "docs" / file).read_text(encoding="utf-8")
    assert page == doc_tables.with_table(page, name, table()), "run `make docs`"


def test_writing_the_tables_replaces_an_outdated_one(tmp_path):
    for file, (name, _) in doc_tables.TABLES.items():
        (tmp_path / file).write_text(
            f"above\n<!-- {name}: begin -->\nold\n<!-- {name}: end -->\nbelow\n", encoding="utf-8"
        )
    assert doc_tables.main([str(tmp_path)]) == 0
    for file, (_, table) in doc_tables.TABLES.items():
        page = (tmp_path / file).read_text(encoding="utf-8")
        assert table() in page and "old" not in page
        assert page.startswith("above\n") and page.endswith("below\n")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_inside_the_project_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_readme_example_runs_as_printed(monkeypatch, capsys):
    (example,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    monkeypatch.chdir(ROOT)
    exec(example, {})
    assert capsys.readouterr().out.startswith("1.0 [")


def test_version_is_the_same_everywhere():
    assert f"<version>{__version__}</version>" in (ROOT / "package.xml").read_text(encoding="utf-8")
    assert f'version="{__version__}"' in (ROOT / "setup.py").read_text(encoding="utf-8")
