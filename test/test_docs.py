"""The documentation says what the code does: tables made from it, names that exist, links that lead somewhere."""

import json
import re
from importlib.util import find_spec

import pytest
import yaml

import rigid_body_sim
from bench import doc_tables
from rigid_body_sim import Scene, __version__
from rigid_body_sim.scene.fleet import load_any

from . import doc_pages
from .bags import making
from .doc_pages import PAGES, ROOT, TUTORIALS
from .resim import runs

LANGUAGES = {"python", "bash", "console", "yaml", "json"}


@pytest.mark.parametrize(("file", "name", "table"), doc_tables.TABLES)
def test_table_is_what_the_code_gives(file, name, table):
    page = (ROOT / "docs" / file).read_text(encoding="utf-8")
    assert page == doc_tables.with_table(page, name, table()), "run `make docs`"


def test_writing_the_tables_replaces_an_outdated_one(tmp_path):
    pages = {file: "above\n" for file, *_ in doc_tables.TABLES}
    for file, name, _ in doc_tables.TABLES:
        pages[file] += f"<!-- {name}: begin -->\noutdated\n<!-- {name}: end -->\nbelow\n"
    for file, text in pages.items():
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text(text, encoding="utf-8")
    assert doc_tables.main([str(tmp_path)]) == 0
    for file, _, table in doc_tables.TABLES:
        page = (tmp_path / file).read_text(encoding="utf-8")
        assert table() in page and "outdated" not in page
        assert page.startswith("above\n") and page.endswith("below\n")


@pytest.mark.parametrize("page", PAGES, ids=doc_pages.named)
def test_links_inside_the_project_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("package", ["values", "mass", "effects", "integrators", "envs", "theory"])
def test_reference_has_every_module(package):
    page = (ROOT / "docs" / "reference" / "api" / f"{package}.rst").read_text(encoding="utf-8")
    names = {path.stem for path in (ROOT / "rigid_body_sim" / package).glob("*.py")} - {"__init__"}
    assert set(re.findall(rf"^.. automodule:: rigid_body_sim\.{package}\.(\w+)$", page, re.M)) == names


def test_reference_has_every_public_name():
    page = (ROOT / "docs" / "reference" / "api" / "public.rst").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^.. auto\w+:: (\w+)$", page, re.M)) == sorted(rigid_body_sim.__all__)


def blocks(*languages, pages=PAGES):
    """Texts of the blocks of some languages, as parameters."""
    found = [(page, block.text) for page in pages for block in doc_pages.blocks(page) if block.language in languages]
    return [pytest.param(text, id=f"{doc_pages.named(page)}-{i}") for i, (page, text) in enumerate(found)]


@pytest.mark.parametrize("page", PAGES, ids=doc_pages.named)
def test_every_block_is_of_a_language_that_a_test_knows(page):
    """What is not a fragment is run: here, or by test/ros/test_pages.py."""
    assert {block.language for block in doc_pages.blocks(page)} <= LANGUAGES
    fences = [line for line in page.read_text("utf-8").splitlines() if line.lstrip().startswith("```")]
    assert len(fences) == 2 * len(list(doc_pages.blocks(page)))


@pytest.fixture
def user_folder(tmp_path, monkeypatch):
    """Where a reader tries what is printed: the scenes are there, and a bag that the node recorded."""
    (tmp_path / "config").symlink_to(ROOT / "config")
    scene = Scene(runs.SCENE)
    sends = runs.sends(scene, 0.5, frames=("base_link", "world", ""))
    making.make(tmp_path / "run1", runs.with_journal(scene, sends, 0.5))
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("text", blocks("python", pages=[page for page in PAGES if page not in TUTORIALS]))
def test_python_runs_as_printed_or_says_that_it_is_a_fragment(text, user_folder, capsys):
    code = compile(text, "block", "exec")
    if not text.startswith(doc_pages.FRAGMENT):
        exec(code, {})
        assert re.match(r"1\.0 \[|0 \(|Trajectory\(|0\.395827057 s", capsys.readouterr().out)


@pytest.mark.parametrize("text", blocks("yaml"))
def test_yaml_of_the_node_is_a_scene_and_other_yaml_says_whose_it_is(text, tmp_path):
    (tmp_path / "scene.yaml").write_text(text)
    if "ros__parameters" in text:
        load_any(tmp_path / "scene.yaml")
    else:
        assert text.startswith("# ") and yaml.safe_load(text)


@pytest.mark.parametrize("text", blocks("json"))
def test_json_can_be_read_line_by_line(text):
    assert all(json.loads(line) for line in text.splitlines())


@pytest.mark.parametrize("text", blocks("bash", "console"))
def test_commands_name_programs_targets_and_files_that_exist(text):
    programs = {f"rigid_body_{last}" for last in ("node", "demo", "report", "resim", "view", "plot")}
    programs |= {"pointing_controller", "actuator_controller"}
    setup, targets = (ROOT / "setup.py").read_text(), (ROOT / "Makefile").read_text()
    assert all(f'"{program} = ' in setup for program in programs)
    assert set(re.findall(r"\b(?:rigid_body_[a-z]+|[a-z]+_controller)\b", text)) <= programs | {"rigid_body_sim"}
    assert all(f"\n{target}: " in targets for target in re.findall(r"^make ([a-z-]+)", text, re.M))
    assert all((ROOT / file).exists() for file in re.findall(r"\bconfig/[\w./]*\w", text))
    assert all(find_spec(module) for module in re.findall(r"python -m (\S+)", text))


def test_version_is_the_same_everywhere():
    assert f"<version>{__version__}</version>" in (ROOT / "package.xml").read_text(encoding="utf-8")
    assert f'version="{__version__}"' in (ROOT / "setup.py").read_text(encoding="utf-8")
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"] == __version__
