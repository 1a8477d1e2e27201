"""Mass properties of a link in a URDF file: the inertial origin and its rotation, and one bad file for each rule."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim.scene import urdf
from rigid_body_sim.values import inertia, rotation

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


QUATERNION = 'quat_xyzw="0 0 0.7071067811865476 0.7071067811865476"'
TURNED = (0.4, 0.3, 0.5, -0.01, -0.03, -0.02)  # the tensor of INERTIAL by a quarter about z: x is then y, y is −x


def quaternion(text=QUATERNION, version='version="1.1"'):
    """A URDF of that version, with the attribute in place of rpy."""
    return robot(INERTIAL.replace('rpy="0.4 -0.5 0.6"', text)).replace('name="r"', f'name="r" {version}')


@pytest.mark.parametrize("version", ["1.1", "1.2", " 1.1 "])
@pytest.mark.parametrize("length", [1.0, 0.5, -1.0, 1e3, 1e-5, 1e200])
def test_quaternion_of_any_length_turns_the_tensor(read, version, length):
    text = f'quat_xyzw=" 0  0 {length!r}\n{length!r}"'
    found = read(quaternion(text, f'version="{version}"'))
    assert_allclose(found.inertia, inertia.as_matrix(TURNED), rtol=0, atol=1e-15)  # measured 2.2e-16
    assert_array_equal(found.center_of_mass, (0.1, -0.2, 0.3))


def test_quaternion_says_the_same_as_the_angles(read):
    w, x, y, z = rotation.from_roll_pitch_yaw(0.4, -0.5, 0.6).tolist()
    found = read(quaternion(f'quat_xyzw="{x!r} {y!r} {z!r} {w!r}"'))
    assert_allclose(found.inertia, read(robot(INERTIAL)).inertia, rtol=0, atol=1e-15)  # measured 0


@pytest.mark.parametrize("version", ["1.0", "1.1", "1.2"])
def test_version_does_not_change_what_all_versions_have(read, version):
    text = robot(INERTIAL)
    assert_array_equal(read(text.replace("<robot", f'<robot version="{version}"')).inertia, read(text).inertia)


def test_comments_and_attributes_of_other_namespaces_are_no_fault(read):
    text = INERTIAL.replace("<inertial>", '<inertial xmlns:k="urn:k" k:id="7"><!-- 2.5 kg -->\n')
    text = text.replace("<mass ", '<mass k:unit="kg" xml:space="default" ').replace(
        "/></inertial>", "/>\t<?k?></inertial>"
    )
    assert_array_equal(read(robot(text)).inertia, read(robot(INERTIAL)).inertia)


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


def latin(text):
    return text.replace("1.0", '1.0" encoding="ISO-8859-1').replace('name="r"', 'name="Hülle"').encode("latin-1")


TEXT = robot(INERTIAL)
GAZEBO = '<gazebo reference="a"><link name="a"><inertial/></link><sensor><mass value="x"/></sensor></gazebo>'
DIALECTS = {  # files that say what TEXT says
    "expanded xacro": TEXT.replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"'),
    "default namespace": TEXT.replace("<robot", '<robot xmlns="http://www.ros.org"'),
    "prefix not declared": TEXT.replace("</robot>", "<controller:joint/></robot>"),
    "no name": TEXT.replace('name="r"', ""),
    "comments and instructions": TEXT.replace("<robot", "<!-- & < --><?xml-model href='urdf.rng'?>\n<robot"),
    "extensions": TEXT.replace("</robot>", GAZEBO + "</robot>"),
    "other elements first": TEXT.replace("<inertial>", '<visual><origin rpy="1 2 3"/></visual>some text<inertial>'),
    "DOCTYPE": TEXT.replace("<robot", "<!DOCTYPE robot>\n<robot"),
    "latin-1": latin(TEXT),
    "UTF-16": TEXT.replace("1.0", '1.0" encoding="UTF-16').encode("utf-16"),
    "UTF-16 without a declaration": TEXT[21:].encode("utf-16"),
    "UTF-16 without a mark": TEXT[21:].encode("utf-16-be"),
    "UTF-8 that declares UTF-16": TEXT.replace("1.0", '1.0" encoding="UTF-16').encode(),
    "newlines": TEXT.replace(" -0.2 ", "\n\t -0.2&#10;").replace('="2.5"', '\n =\n " 2.5 "'),
    "other numbers": TEXT.replace("2.5", "+25.E-1").replace('"0.3"', '"3e-1"').replace('"0.4"', '".4"'),
    "whole matrix": TEXT.replace("<inertia ", '<inertia iyx="1e-2" izx="-0.020" izy="0.03" '),
    "link of no mass": TEXT.replace(
        "<link", '<link name="w"><inertial><mass value="0"/><inertia/></inertial></link><link'
    ),
}


@pytest.mark.parametrize("text", DIALECTS.values(), ids=DIALECTS)
def test_dialects_that_other_readers_take_say_the_same(read, text):
    expected, found = read(TEXT), read(text)
    assert found.mass == expected.mass
    assert_array_equal(found.center_of_mass, expected.center_of_mass)
    assert_array_equal(found.inertia, expected.inertia)


def printed(ixx, iyy, izz, ixy="0", ixz="0", iyz="0"):
    """A URDF with a tensor of those texts."""
    entries = f'ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="{ixy}" ixz="{ixz}" iyz="{iyz}"'
    return robot(f'<inertial><mass value="1"/><inertia {entries}/></inertial>')


ROUNDED = {  # entries of plates and rods as exporters print them, and the moments that are nearest, in their proportion
    "plate": (("0.020", "0.083", "0.104"), (0.061 / 3, 0.25 / 3, 0.311 / 3)),
    "plate with exponents": (("2.0e-2", "+8.3E-2", "10.4e-2"), (0.061 / 3, 0.25 / 3, 0.311 / 3)),
    "rod along x": (("1e-5", "0.0833", "0.0834"), (1e-5 + 3e-5 / 7, 0.0833 + 3e-4 / 7, 0.0834 - 3e-4 / 7)),
}


@pytest.mark.parametrize(("texts", "moments"), ROUNDED.values(), ids=ROUNDED)
def test_moments_that_rounding_made_impossible_move_within_their_digits(read, texts, moments):
    found = read(printed(*texts)).body()
    assert_allclose(found.inertia, np.diag(moments), rtol=0, atol=1e-16)  # measured 1.4e-17
    assert max(moments) == pytest.approx(sum(moments) - max(moments), rel=1e-15)  # measured 2.2e-16


def test_rod_at_an_angle_has_a_moment_about_its_axis_of_less_than_a_digit(read):
    """1 kg, 1 m at 45°: as printed, its smallest moment is 0 to 1e-4; the middle is taken, the rest hardly moves."""
    found = read(printed("0.0417", "0.0417", "0.0833", ixy="-0.0417")).body()
    low, middle, high = np.linalg.eigvalsh(found.inertia)
    assert low == pytest.approx(6.25e-5, rel=1e-9)  # 5e-5, and a quarter of the 5e-5 that then miss the inequality
    assert high <= (low + middle) * (1 + 1e-15)
    assert_allclose(
        found.inertia, inertia.as_matrix((0.0417, 0.0417, 0.0833, -0.0417, 0, 0)), rtol=0, atol=5e-5
    )  # measured 4.4e-5


NO_BODIES = {
    "integers": ("1", "1", "3"),
    "one digit": ("0.1", "0.1", "0.3"),
    "two digits too many": ("0.020", "0.083", "0.106"),
    "a typo": ("0.02083", "0.08333", "0.14017"),
}


@pytest.mark.parametrize("texts", NO_BODIES.values(), ids=NO_BODIES)
def test_what_rounding_does_not_explain_is_refused(read, texts):
    with pytest.raises(
        ValueError, match=r"breaks the triangle .* the other two, here 0?\.?\d+ kg m²: give more digits"
    ):
        read(printed(*texts)).body()


@pytest.mark.parametrize("zero", ["0", "0.000", "0e99999999999", "-0.0"])
def test_moment_printed_as_zero_is_refused(read, zero):
    with pytest.raises(ValueError, match=r"not positive definite.* give a thin rod its radius"):
        read(printed(zero, "0.083", "0.083")).body()


BOMB = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"/>'
FETCH = '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/hostname">]><robot>&a;</robot>'
BAD = {  # text, link, and what the message must say
    "entity bomb": (BOMB, "", "has a DOCTYPE, which URDF does not need; remove it"),
    "file as an entity": (FETCH, "", "has a DOCTYPE"),
    "undeclared entity": ("<robot>&a;</robot>", "", "is not XML: undefined entity"),
    "undeclared latin-1": (robot(INERTIAL).replace('"r"', '"é"').encode("latin-1"), "", "is not UTF-8 text, nor XML"),
    "no such encoding": (b'<?xml version="1.0" encoding="moon"?><robot name="\xff"/>', "", "not UTF-8.*encoding: moon"),
    "DTD of elsewhere": ('<!DOCTYPE robot SYSTEM "robot.dtd"><robot/>', "", "has a DOCTYPE, which URDF does not need"),
    "undeclared entity below a DOCTYPE": ('<!DOCTYPE robot><robot name="&a;"/>', "", "is not XML: undefined entity"),
    "not XML": ("solid cube", "", "is not XML: syntax error"),
    "empty": ("", "", "is not XML"),
    "dollars": (robot(INERTIAL.replace("2.5", "$5")), "", r"mass value = '\$5' is not a finite number; write it in SI"),
    "world": ("<sdf/>", "", "begins with <sdf>; a URDF begins with <robot>"),
    "no links": ("<robot/>", "", r"has 0 links with <inertial> and a mass .*; a body is one$"),
    "two links": (robot(INERTIAL, INERTIAL), "", r"2 links with <.*one: a, b \(parameter body\.urdf_link\)$"),
    "link in a group": ('<robot><g><link name="a"/></g></robot>', "", "a <link> inside <g> is none; URDF has links"),
    "named link there": ('<robot><g><link name="a"/></g></robot>', "a", "no link .a.; its links are none; a <link>"),
    "mass of 0": (robot(INERTIAL.replace("2.5", "0.0")), "", "has 0 links with <inertial> and a mass greater"),
    "named mass of 0": (robot(INERTIAL.replace("2.5", "0")), "a", "link 'a': mass 0 kg is not a finite number greater"),
    "unknown link": (robot(INERTIAL), "wing", "has no link 'wing'; its links are a"),
    "massless link": (robot("", INERTIAL), "a", "link 'a' has no <inertial>; those that have one: b"),
    "no mass": (robot(f"<inertial>{TENSOR}</inertial>"), "", "link 'a': <inertial> has no <mass>"),
    "no inertia": (robot('<inertial><mass value="1"/></inertial>'), "", "has no <inertia>; it needs"),
    "no entry": (robot(INERTIAL.replace('iyy="0.4"', "")), "", "<inertia> has no attribute iyy"),
    "no value": (robot(INERTIAL.replace('value="2.5"', "")), "", "<mass> has no attribute value"),
    "not a number": (robot(INERTIAL.replace("0.3\" ixy", "nan\" ixy")), "", "inertia ixx = 'nan' is not a finite"),
    "comma": (robot(INERTIAL.replace("2.5", "2,5")), "", "mass value = '2,5' is not .*, with a point and no comma"),
    "commas": (robot(INERTIAL.replace("0.1 -0.2 0.3", "0.1, -0.2, 0.3")), "", "'0.1,' is not a finite .* no comma"),
    "commas alone": (robot(INERTIAL.replace("0.1 -0.2 0.3", "0.1,-0.2,0.3")), "", "is not three numbers with spaces"),
    "unit": (robot(INERTIAL.replace("2.5", "2.5 kg")), "", "'2.5 kg' is not a finite number; write it in SI units"),
    "underscore": (robot(INERTIAL.replace("2.5", "1_000")), "", "mass value = '1_000' is not a finite number"),
    "other digits": (robot(INERTIAL.replace("2.5", "٣")), "", "mass value = '٣' is not a finite number"),
    "too large": (robot(INERTIAL.replace("2.5", "1e999")), "", "mass value = '1e999' is not a finite number"),
    "two coordinates": (robot(INERTIAL.replace("0.1 -0.2 0.3", "0.1 -0.2")), "", "xyz = '0.1 -0.2' is not three"),
    "bad angle": (robot(INERTIAL.replace("0.6", "east")), "", "origin rpy = 'east' is not a finite number"),
    "negative mass": (robot(INERTIAL.replace("2.5", "-1")), "", "mass -1 kg is not a finite number greater than zero"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "link", "message"), BAD.values(), ids=BAD)
def test_bad_file_is_refused_by_a_sentence_with_its_path(read, tmp_path, text, link, message):
    with pytest.raises(ValueError, match=message) as caught:
        read(text, link)
    assert str(caught.value).startswith(f"file {tmp_path / 'robot.urdf'}: ")


UNKNOWN = {  # what is replaced in INERTIAL, by what, and what the message must say
    "unit of the mass": ("<mass", '<mass unit="lb"', "<mass> has an attribute 'unit'; URDF has attributes value there"),
    "misspelt angles": (
        "rpy=",
        "ryp=",
        "<origin> has an attribute 'ryp'; URDF has attributes xyz, rpy, quat_xyzw there",
    ),
    "capitals": ("xyz=", "XYZ=", "<origin> has an attribute 'XYZ'"),
    "other quaternion": ("rpy=", "quat=", "<origin> has an attribute 'quat'"),
    "other entry below": ("<inertia ", '<inertia iyx="0.02" ', "inertia iyx = '0.02' is not ixy, '0.01'; the matr"),
    "misspelt entry": ("<inertia ", '<inertia iXY="0.01" ', "<inertia> has an attribute 'iXY'; URDF has attributes"),
    "attribute of inertial": (
        "<inertial",
        '<inertial mass="1"',
        "<inertial> has an attribute 'mass'; URDF has no attr",
    ),
    "more elements": ("<mass", '<density value="1"/><mass', "<inertial> has <density>; URDF has <origin>, <mass> and"),
    "capital element": ("<origin", "<Origin", "<inertial> has <Origin>; URDF has <origin>"),
    "inertial in inertial": ("<mass", "<inertial/><mass", "<inertial> has <inertial>; URDF has"),
    "foreign element": ("<mass", '<k:mass xmlns:k="u" value="1"/><mass', "<inertial> has <.*mass>; URDF has"),
    "mass twice": ("<mass", '<mass value="1"/><mass', "<inertial> has <mass> more than once; give each element once"),
    "origin twice": ("<mass", "<origin/><mass", "<inertial> has <origin> more than once"),
    "element in an element": ('"2.5"/>', '"2.5"><unit/></mass>', "<mass> has <unit> inside; URDF has attributes there"),
    "text in inertial": ("<mass", "about <mass", "<inertial> has the text 'about' inside; URDF has no text there"),
    "text in mass": ('"2.5"/>', '"2.5">3</mass>', "<mass> has the text '3' inside; URDF has no text"),
    "inertial twice": ("</inertial>", "</inertial><inertial/>", "<inertial> stands there 2 times; a link has one"),
}


@pytest.mark.parametrize(("old", "new", "message"), UNKNOWN.values(), ids=UNKNOWN)
def test_nothing_under_inertial_is_left_out_in_silence(read, old, new, message):
    assert old in INERTIAL
    with pytest.raises(ValueError, match=f"link 'a': {message}"):
        read(robot(INERTIAL.replace(old, new)))


BAD_QUATERNIONS = {  # the attribute, that of the version, and what the message must say
    "1.0": (
        QUATERNION,
        'version="1.0"',
        r'quat_xyzw, which URDF 1\.0 does not know .* or write <robot version="1\.1">',
    ),
    "no version": (QUATERNION, "", r"quat_xyzw, which URDF 1\.0 does not know and its readers leave out; give rpy"),
    "angles too": (f'{QUATERNION} rpy="0 0 0"', 'version="1.1"', "has both rpy and quat_xyzw; give one of them"),
    "zero": (
        'quat_xyzw="0 0 0 0"',
        'version="1.1"',
        r"quat_xyzw = \[0\.0, 0\.0, 0\.0, 0\.0\] has no direction; give x, y",
    ),
    "three": ('quat_xyzw="0 0 1"', 'version="1.1"', "origin quat_xyzw = '0 0 1' is not four numbers with spaces"),
    "infinite": ('quat_xyzw="0 0 inf 1"', 'version="1.2"', "origin quat_xyzw = 'inf' is not a finite number"),
    "2.0": (QUATERNION, 'version="2.0"', r"has the URDF version '2\.0'; known are 1\.0, 1\.1, 1\.2"),
    "1": ("", 'version="1"', "has the URDF version '1'; known are"),
    "empty": ("", 'version=""', "has the URDF version ''; known are"),
}


@pytest.mark.parametrize(("attribute", "version", "message"), BAD_QUATERNIONS.values(), ids=BAD_QUATERNIONS)
def test_quaternion_or_version_that_cannot_be_honoured_is_refused(read, attribute, version, message):
    with pytest.raises(ValueError, match=message):
        read(quaternion(attribute, version))


XACRO = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="m" value="2"/><xacro:leg/></robot>'
UNEXPANDED = {  # a xacro file, and how its message begins
    "macros": (XACRO, "has <xacro:property>, so it is xacro and no URDF yet"),
    "namespace of another name": (
        XACRO.replace("xacro:", "x:").replace(":xacro", ":x"),
        "has <x:property>, so it is.*",
    ),
    "macro alone": ("<xacro:macro/>", "has <xacro:macro>, so it is xacro.*"),
    "namespace not declared": (TEXT.replace("<mass", "<xacro:insert/><mass"), "has <xacro:insert>, so it is xacro.*"),
    "name of a link": (TEXT.replace('"a"', '"${side}_leg"'), r"has a link '\$\{side\}_leg', so it is xacro.*"),
    "mass": (TEXT.replace("2.5", "${m}"), r"link 'a': mass value = '\$\{m\}' is not a finite number; it is xacro"),
    "moment": (
        TEXT.replace('"0.3"', '"${m * r**2}"'),
        "link 'a': inertia ixx = .* is not a finite number; it is xacro",
    ),
    "coordinates": (TEXT.replace("0.1 -0.2 0.3", "${a / 2} 0 $(arg z)"), "origin xyz = .* number; it is xacro"),
    "angles": (TEXT.replace("0.4 -0.5 0.6", "0 0 ${pi/2}"), "link 'a': origin rpy = '0 0 .* number; it is xacro"),
}


@pytest.mark.parametrize(("text", "message"), UNEXPANDED.values(), ids=UNEXPANDED)
def test_xacro_is_refused_with_the_command_that_expands_it(read, text, message):
    with pytest.raises(ValueError, match=f"{message}; expand it first: xacro in.urdf.xacro > out.urdf$"):
        read(text)


def test_link_that_is_there_in_full_is_read_beside_what_is_left_of_xacro(read):
    text = TEXT.replace("</robot>", '<xacro:sensors/><link name="${side}_leg"/></robot>')
    assert read(text, "a").mass == 2.5
    for link in ("", "b", "${side}_leg"):
        with pytest.raises(ValueError, match="has <xacro:sensors>, so it is xacro"):
            read(text, link)


def test_file_that_is_called_xacro_is_taken_when_it_is_a_urdf(tmp_path):
    path = tmp_path / "robot.urdf.xacro"
    path.write_text(TEXT, encoding="utf-8")
    assert urdf.read(path).mass == 2.5
    path.write_text("<robot/>", encoding="utf-8")
    with pytest.raises(ValueError, match=r"has 0 links .*; expand it first: xacro in.urdf.xacro > out.urdf$"):
        urdf.read(path)


@pytest.mark.parametrize("text", ["<{}/>", "<robot><link><inertial><{}/></inertial></link></robot>",
                                  '<?xml version="1.0" encoding="{}"?><robot name="é"/>'])  # fmt: skip
def test_long_names_are_not_repeated_whole(read, text):
    with pytest.raises(ValueError, match=r"file .*") as caught:
        read(text.format(10_000 * "n").encode("latin-1"))
    assert len(str(caught.value)) < 2000


def test_deep_nesting_does_no_harm(read):
    with pytest.raises(ValueError, match="has 0 links"):
        read("<robot>" + 100_000 * "<a>" + 100_000 * "</a>" + "</robot>")


def test_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(OSError, match=r"nowhere\.urdf"):
        urdf.read(tmp_path / "nowhere.urdf")


@pytest.mark.parametrize(
    ("scale", "told"),
    [
        ("", ""),
        (' scale="0.001 0.001 0.001"', " and body.mesh_scale: [0.001, 0.001, 0.001]"),
        (' scale="0.001"', " and body.mesh_scale: [0.001, 0.001, 0.001]"),
        (' scale="1 -1 1"', ", mirrored as its scale 1 -1 1 says"),
        (' scale="large"', ""),
    ],
)
def test_mesh_of_a_link_without_inertial_is_named(tmp_path, scale, told):
    """By the parameters that take it, with its scale."""
    file = tmp_path / "hull.urdf"
    mesh = f'<collision><geometry><mesh filename="package://hull/a.stl"{scale}/></geometry></collision>'
    file.write_text(f'<robot name="r"><link name="a">{mesh}</link></robot>')
    with pytest.raises(ValueError) as refused:
        urdf.read(file, "a")
    what = "those that have one: none; the mesh of its <collision> can stand in: body.mesh_file: package://hull/a.stl"
    assert str(refused.value).endswith(f"link 'a' has no <inertial>; {what}{told}")


def test_mesh_that_its_origin_moves_is_said_to_be(tmp_path):
    file = tmp_path / "hull.urdf"
    mesh = '<visual><origin xyz="1 0 0"/><geometry><mesh filename="a.stl"/></geometry></visual>'
    file.write_text(f'<robot name="r"><link name="a">{mesh}</link></robot>')
    with pytest.raises(
        ValueError, match=r"the mesh of its <visual>, placed as its <origin> says, can stand in: body\.mes"
    ):
        urdf.read(file, "a")
