"""The table in docs/explanation/theory.md covers every equation of the chapter; here are steps no other test shows."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim.theory import quaternion
from rigid_body_sim.values import inertia, rotation

pytestmark = pytest.mark.no_numba

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "docs" / "explanation" / "theory.md"
COUNTS = {"2.1": 4, "2.2": 5, "2.3": 5, "2.4": 12, "2.5": 6, "2.6": 1, "2.7": 27}  # equations in each section
EQUATIONS = [f"{section}.{k}" for section, count in COUNTS.items() for k in range(1, count + 1)]
ROW = re.compile(r"^\| \((2\.\d\.\d+)\) \| ([^|]+) \| ([^|]*) \| ([^|]*) \|$", re.MULTILINE)


def rows():
    """Equation, names of functions and name of a test of each row in the table of equations."""
    text = PAGE.read_text(encoding="utf-8")
    section = text[text.index("## Where each equation is") : text.index("## Corrections")]
    return [(n, re.findall(r"`([^`]+)`", names), test.strip(" `")) for n, _, names, test in ROW.findall(section)]


def test_every_equation_of_the_chapter_has_its_row():
    assert [number for number, _, _ in rows()] == EQUATIONS


@pytest.mark.parametrize(("number", "names", "test"), rows(), ids=[row[0] for row in rows()])
def test_what_the_table_names_exists(number, names, test):
    assert names or test, f"({number}) has neither a function nor a test"
    for name in names:
        module, _, attribute = name.rpartition(".")
        assert hasattr(importlib.import_module(f"rigid_body_sim.{module}"), attribute), name
    if test:
        file, function = test.split("::")
        assert f"\ndef {function}(" in (HERE.parent / file).read_text(encoding="utf-8"), test


def test_function_of_the_table_names_its_equation_or_is_shown_by_a_test():
    """The equation's number stands in the docstring of one of its functions, unless a test of its own shows it."""
    for number, names, test in rows():
        texts = []
        for name in names:
            module, _, attribute = name.rpartition(".")
            found = getattr(importlib.import_module(f"rigid_body_sim.{module}"), attribute)
            texts.append(getattr(getattr(found, "py_func", found), "__doc__", None) or "")
        assert test or any(re.search(rf"{number}(?!\d)", text) for text in texts), number


Q = rotation.normalize((0.9, 0.3, -0.2, 0.1))
A = np.array((1.0, 2.0, -0.5, 0.7))
ONE, I, J, K = np.eye(4)


def test_columns_of_the_rotation_matrix_2_2_1_are_the_body_axes():
    R = rotation.to_matrix(Q)
    for axis, column in zip(np.eye(3), R.T, strict=True):
        assert_allclose(column, rotation.rotate(Q, axis), rtol=0, atol=1e-15)  # measured 0


def test_products_of_a_position_2_4_6_and_2_4_7_make_its_inertia_2_4_8():
    x, y, z = r = np.array((0.3, -1.2, 0.8))
    assert r @ r == pytest.approx(x * x + y * y + z * z, rel=1e-15, abs=0)
    printed = ((x * x, x * y, z * x), (x * y, y * y, y * z), (z * x, y * z, z * z))
    assert_array_equal(np.outer(r, r), printed)
    found = inertia.of_point_masses([2.0], [r])
    assert_allclose(found, 2.0 * ((r @ r) * np.eye(3) - np.outer(r, r)), rtol=0, atol=1e-15)  # measured 0


def test_quaternion_is_its_sum_over_the_units_2_7_1_and_2_7_3():
    s, x, y, z = A
    total = s * ONE
    for component, unit in ((x, I), (y, J), (z, K)):
        total = quaternion.add(total, rotation.multiply((component, 0, 0, 0), unit))
    assert_array_equal(total, A)
    assert_array_equal(quaternion.subtract(total, A), np.zeros(4))


def test_quaternion_times_its_conjugate_2_7_8_is_its_squared_norm():
    squared = rotation.norm_squared(A)
    assert_allclose(rotation.multiply(A, rotation.conjugate(A)), squared * ONE, rtol=0, atol=1e-15)  # measured 0
    assert_allclose(quaternion.inverse(A), rotation.conjugate(A) / squared, rtol=0, atol=2e-16)  # measured 5.6e-17
    assert_allclose(rotation.multiply(A, rotation.conjugate(A) / squared), ONE, rtol=0, atol=1e-15)  # measured 1.1e-16
