"""Mass properties of a link in a URDF file: the inertial origin and its rotation, and one bad file for each rule."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim.physics import inertia, rotation
from rigid_body_sim.scene import urdf

pytestmark = pytest.mark.no_numba

TENSOR = '<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.5"/>'
INERTIAL = f'<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/><mass value="2.5"/>{TENSOR}</inertial>'


def robot(*links):
    """A URDF with links of that content, named a, b, ..."""
    inside = "".join(f'<link name="{name}">{link}</link>' for name, link in zip("abc", links, strict=False))
    return f'<?xml version="1.0"?><robot name="r">{inside}</robot>'


@pytest.fixture
def read(tmp_path):
    """A function: what is read from a file with this text."""

    def read(text, link=""):
        path = tmp_path / "robot.urdf"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return urdf.read(path, link)

    return read


def test_inertial_is_turned_and_moved_into_the_link(read):
    found = read(robot(INERTIAL))
    roll, pitch, yaw = 0.4, -0.5, 0.6
    x = np.array(((1, 0, 0), (0, math.cos(roll), -math.sin(roll)), (0, math.sin(roll), math.cos(roll))))
    y = np.array(((math.cos(pitch), 0, math.sin(pitch)), (0, 1, 0), (-math.sin(pitch), 0, math.cos(pitch))))
    z = np.array(((math.cos(yaw), -math.sin(yaw), 0), (math.sin(yaw), math.cos(yaw), 0), (0, 0, 1)))
    R = z @ y @ x  # about the fixed axes x, y, z in turn, as URDF says
    own = inertia.as_matrix((0.3, 0.4, 0.5, 0.01, -0.02, 0.03))
    assert found.mass == 2.5
    assert_array_equal(found.center_of_mass, (0.1, -0.2, 0.3))
    assert_allclose(found.inertia, R @ own @ R.T, rtol=0, atol=1e-15)  # measured 1.1e-16
    assert_allclose(
        R, rotation.to_matrix(rotation.from_roll_pitch_yaw(roll, pitch, yaw)), rtol=0, atol=1e-15
    )  # 1.1e-16


def test_without_an_origin_the_numbers_are_kept_to_the_bit(read):
    found = read(robot(INERTIAL.replace('<origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/>', "")))
    assert_array_equal(found.center_of_mass, (0, 0, 0))
    assert_array_equal(found.inertia, inertia.as_matrix((0.3, 0.4, 0.5, 0.01, -0.02, 0.03)))


def test_link_is_found_by_name_or_because_it_alone_has_mass(read):
    light = INERTIAL.replace("2.5", "1.5")
    assert read(robot(INERTIAL, light), "b").mass == 1.5
    assert read(robot("", INERTIAL, "<visual/>")).mass == 2.5


def test_byte_order_mark_is_no_text(read):
    assert read(b"\xef\xbb\xbf" + robot(INERTIAL).encode()).mass == 2.5


BOMB = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"/>'
FETCH = '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/hostname">]><robot>&a;</robot>'
BAD = {  # text, link, and what the message must say
    "entity bomb": (BOMB, "", "has a DOCTYPE, which URDF does not need; remove it"),
    "file as an entity": (FETCH, "", "has a DOCTYPE"),
    "undeclared entity": ("<robot>&a;</robot>", "", "is not XML: undefined entity"),
    "UTF-16": (robot(INERTIAL).encode("utf-16"), "", "is not UTF-8 text"),
    "not XML": ("solid cube", "", "is not XML: syntax error"),
    "empty": ("", "", "is not XML"),
    "world": ("<sdf/>", "", "begins with <sdf>; a URDF begins with <robot>"),
    "no links": ("<robot/>", "", "has 0 links with <inertial>; name one: none"),
    "two links": (robot(INERTIAL, INERTIAL), "", "has 2 links with <inertial>; name one: a, b"),
    "unknown link": (robot(INERTIAL), "wing", "has no link 'wing'; its links are a"),
    "massless link": (robot("", INERTIAL), "a", "link 'a' has no <inertial>; those that have one: b"),
    "no mass": (robot(f"<inertial>{TENSOR}</inertial>"), "", "link 'a': <inertial> has no <mass>"),
    "no inertia": (robot('<inertial><mass value="1"/></inertial>'), "", "has no <inertia>; it needs"),
    "no entry": (robot(INERTIAL.replace('iyy="0.4"', "")), "", "<inertia> has no attribute iyy"),
    "no value": (robot(INERTIAL.replace('value="2.5"', "")), "", "<mass> has no attribute value"),
    "xacro": (robot(INERTIAL.replace("2.5", "${m}")), "", r"mass value = '\$\{m\}' is not a finite number"),
    "not a number": (robot(INERTIAL.replace("0.3\" ixy", "nan\" ixy")), "", "inertia ixx = 'nan' is not a finite"),
    "two coordinates": (robot(INERTIAL.replace("0.1 -0.2 0.3", "0.1 -0.2")), "", "xyz = '0.1 -0.2' is not three"),
    "bad angle": (robot(INERTIAL.replace("0.6", "east")), "", "origin rpy = 'east' is not a finite number"),
    "negative mass": (robot(INERTIAL.replace("2.5", "-1")), "", "mass -1 kg is not a finite number greater than zero"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "link", "message"), BAD.values(), ids=BAD)
def test_bad_file_is_refused_by_a_sentence_with_its_path(read, tmp_path, text, link, message):
    with pytest.raises(ValueError, match=message) as caught:
        read(text, link)
    assert str(caught.value).startswith(f"file {tmp_path / 'robot.urdf'}: ")


def test_deep_nesting_does_no_harm(read):
    with pytest.raises(ValueError, match="has 0 links"):
        read("<robot>" + 100_000 * "<a>" + 100_000 * "</a>" + "</robot>")


def test_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(OSError, match=r"nowhere\.urdf"):
        urdf.read(tmp_path / "nowhere.urdf")
