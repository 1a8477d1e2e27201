"""A copy of the package with the file that a page of the documentation tells to add, and what is run in it."""

import os
import re
import shutil
import subprocess
import sys

from .doc_pages import ROOT


def copy_with(folder, page, file, entries):
    """Copy package and tests into ``folder`` and add ``file``, as the page has it.

    ``entries`` are what the page tells to change in the registry beside it: texts, and what takes the place of each.
    """
    for part in ("rigid_body_sim", "test", "config"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    text = (ROOT / "docs" / "how-to" / page).read_text(encoding="utf-8")
    (block,) = re.findall(rf"```python\n# Fragment: {re.escape(file)}.*?\n(.*?)```", text, re.DOTALL)
    (folder / file).write_text(block, encoding="utf-8")
    registry = (folder / file).with_name("__init__.py")
    text = registry.read_text(encoding="utf-8")
    for before, after in entries:
        assert text.count(before) == 1, f"{before!r} stands {text.count(before)} times in {registry}"
        text = text.replace(before, after)
    registry.write_text(text, encoding="utf-8")


def run(folder, *command):
    """Run Python there, without numba: nothing of the copy is compiled."""
    environment = {**os.environ, "RIGID_BODY_SIM_NO_NUMBA": "1"}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def passed(folder, tests, which):
    """How many of the ``tests`` that ``which`` selects there pass; all must."""
    done = run(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", tests, "-k", which)
    assert done.returncode == 0, done.stdout + done.stderr
    return int(re.search(r"(\d+) passed", done.stdout)[1])
