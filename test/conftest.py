"""What several test files share: the reference solutions."""

from types import ModuleType

import pytest
from hypothesis import settings

from rigid_body_sim.report.reference import load

# The first call of a kernel compiles it, and a tolerance must hold for the same examples everywhere.
settings.register_profile("rigid_body_sim", deadline=None, derandomize=True)
# For test/fuzz, `make fuzz`: its tests run so many times their usual number of cases.
settings.register_profile("nightly", settings.get_profile("rigid_body_sim"), max_examples=30_000)
settings.load_profile("rigid_body_sim")


@pytest.fixture(scope="module", params=load.names())
def problem_name(request) -> str:
    """The name of each reference problem in turn."""
    return request.param


@pytest.fixture(scope="module")
def load_problem():
    """A function: reference problem by name, with floats and arrays."""
    return load.load


@pytest.fixture(scope="module")
def printed_digits():
    """A function: reference problem by name, with its numbers as the decimal strings of 35 digits in the file."""
    return load.stored(load.TRAJECTORIES)["problems"].__getitem__


@pytest.fixture(scope="module")
def make_reference() -> ModuleType:
    """The script that makes the reference solutions."""
    from bench.reference import make_reference

    return make_reference


@pytest.fixture
def chromium() -> str:
    """Path of a Chromium, the only thing here that pip cannot install."""
    from .report import browser

    if (program := browser.find()) is None:
        pytest.skip("no Chromium found: set CHROME to one, or install chromium")
    return program
