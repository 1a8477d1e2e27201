"""Any file where a scene, a URDF or a mesh is expected: read, or refused in one sentence that begins with its path."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Scene, Simulation, SimulationError, load_scene
from rigid_body_sim.ros import arguments
from rigid_body_sim.scene import mesh_file, parameter_file, schema, urdf

from .fuzzing import damaged, fuzz, often, sentence

pytestmark = pytest.mark.filterwarnings("error")  # a warning is a line on stderr that nobody asked for

CONFIG = sorted((Path(__file__).parents[2] / "config").glob("*.yaml"))
NUMBERS = [
    "0",
    "1",
    "-1",
    "2.5",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-310",
    ".inf",
    "-.inf",
    ".nan",
    "0x10",
    "010",
    "1_000",
]
NUMBERS += [
    "9" * 400,
    "9" * 5000,
    "1e999",
    "1e-999",
    "1:30",
    "+.5",
    "-",
    "true",
    "no",
    "~",
    "''",
    "2024-01-01",
    "ⅷ",
    "٣",
]


@pytest.fixture
def written(tmp_path):
    """A function: the path of a file with those bytes, the same one each time."""

    def write(data, suffix):
        path = tmp_path / f"file.{suffix}"
        path.write_bytes(data)
        return path

    return write


def refused(path, read):
    """What ``read`` gives, or None when it refuses the file as it should."""
    try:
        return read(path)
    except ValueError as reason:
        assert str(path) in sentence(reason)
        return None


# Scenes ---------------------------------------------------------------------------------------------------------------

NAMES = [
    *schema.BY_NAME,
    "body",
    "frames..axes",
    "frames.a.b",
    "use_sim_time",
    "bodymass",
    "a" * 3000,
    "x\\u001b[2J",
    "é",
]
SMALL = ["body.mass", "rate", "publish_rate", "gravity", "body.inertia", "frames.a.axes", "tethers.b.anchor", "outputs"]
SMALL += ["initial.rpy", "initial.orientation", "frames.a.rpy", *(f"initial.orientation.{part}" for part in "wxyz")]
TAGS = [
    "",
    "",
    "",
    "!!str ",
    "!!int ",
    "!!float ",
    "!!bool ",
    "!!null ",
    "!!set ",
    "!!omap ",
    "!!binary ",
    "!!timestamp ",
]
TAGS += ["!!python/name:os.system ", "!a ", "&a ", "!!map ", "!!seq ", "!!merge "]


def scalar(chance):
    if often(chance):
        return chance.choice(NUMBERS)
    texts = (
        "box",
        "world",
        "taylor",
        "'a b'",
        '"\\x1b[2J\\n"',
        "*a",
        "&a 1",
        "<<",
        "=",
        "|\n  a",
        "? 1",
        "@",
        "%",
        "[",
        "}",
    )
    return chance.choice(texts)


def value(chance, depth=0):
    how = chance.randrange(8)
    tag = chance.choice(TAGS)
    if how < 4 or depth > 3:
        return tag + scalar(chance)
    entries = [value(chance, depth + 1) for _ in range(chance.choice((0, 1, 3, 3, 4, 6, 6, 9)))]
    if how < 7:
        return f"{tag}[{', '.join(entries)}]"
    return tag + "{" + ", ".join(f"{chance.choice(NAMES)}: {entry}" for entry in entries) + "}"


def scene_text(chance):
    """A file of lines that might be in a scene, or one of the package's with some bytes changed."""
    if chance.random() < 0.3:
        return damaged(chance, chance.choice(CONFIG).read_bytes())
    head = (
        "/**:\n  ros__parameters:\n" if often(chance) else chance.choice(("", "a:\n  ros__parameters:\n", "- \n", "\t"))
    )
    names = [chance.choice(SMALL if often(chance) else NAMES) for _ in range(chance.randint(1, 6))]
    lines = "".join(f"    {name}: {value(chance)}\n" for name in names)
    data = (head + lines).encode(errors="surrogatepass")
    return data if often(chance) else damaged(chance, data)


def check_scene(path, taken):
    """A scene file makes a simulation whose state is finite after two steps, or says why not; a node reads the same."""
    scene = refused(path, load_scene)
    check_node(path, scene)
    if scene is None:
        return
    try:
        sim = Simulation.from_scene(scene)
    except ValueError as reason:
        sentence(reason)
        return
    try:
        if max(map(abs, scene["initial.angular_velocity"])) < 1e6 * scene["rate"]:
            sim.step(2)
    except SimulationError as reason:
        sentence(reason, 10_000)
    assert np.isfinite(sim.save().state).all()
    taken.append(path)


def check_node(path, scene):
    """A node that is given the file takes what load_scene takes, or nothing when that finds nothing for it."""
    try:
        given = arguments.read(["--ros-args", "--params-file", str(path)], "rigid_body_node")
        values = Scene({n: v for n, v in given.parameters.items() if not schema.belongs_to_ros(n)}).values
    except ValueError as reason:
        sentence(reason)
        assert scene is None
        return
    assert scene is None if given.notes else scene.values == values


def test_scenes(record_property, written):
    taken = []
    fuzz(record_property, lambda data: check_scene(written(data, "yaml"), taken), scene_text, 120)
    assert taken, "every file was refused: nothing was tried behind the reader"


HEAD = "/**:\n  ros__parameters:\n"
BOMBS = {  # a file, and what is said of it
    "a billion laughs": (
        "a: &a [x, x]\n" + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
        "has an alias",
    ),
    "merge of itself": (HEAD + "    a: &a {<<: *a}\n", "has an alias"),
    "deep lists": (HEAD + "    gravity: " + "[" * 100_000, "nested too deeply"),
    "deep maps": (HEAD + "    " + "{a: " * 50_000, "nested too deeply"),
    "deep blocks": ("\n".join(" " * i + "a:" for i in range(1300)), "nested too deeply"),
    "an endless file": (HEAD + "    rate: 1.0 # " + "x" * 2_000_000, "has more than 1000000 characters"),
    "many keys": (HEAD + "".join(f"    k{i}: 1\n" for i in range(5000)), "parameter k0 is not known"),
    "one key many times": (HEAD + "    rate: 1\n" * 5000, "key 'rate' is given twice"),
    "many topics": (HEAD + f"    wrench.topics: [{', '.join('a' for _ in range(5000))}]", "'a' is given twice"),
    "an integer of 900 000 digits": (HEAD + f"    rate: {'9' * 900_000}", "cannot be read as a number|is too large"),
    "a hexadecimal integer of 900 000 digits": (HEAD + f"    rate: 0x{'f' * 900_000}", "number of thousands of digits"),
    "a name of 900 000 letters": (HEAD + f"    ? {'n' * 900_000}\n    : 1", r"n\.\.\. \(900002 characters\)"),
    "an integer without digits": (HEAD + "    rate: !!int ''", "cannot be read as a number"),
    "a truth value that is none": (HEAD + "    lockstep: !!bool maybe", "'maybe' is no truth value"),
    "a character that cannot be printed": (HEAD + "    rate: 1.0\n\u0382'\n", r"column 1: \\u0382' "),
    "a tag of 900 000 letters": (HEAD + f"    rate: !!{'t' * 900_000} 1", r"t\.\.\. \(900... characters\)"),
    "a time that is none": (HEAD + "    rate: !!timestamp soon", "could not determine a constructor"),
    "a set for an array": (HEAD + "    gravity: !!set {1.0, 2.0, 3.0}", "could not determine a constructor"),
    "bytes for an array": (HEAD + "    gravity: !!binary AAAA", "could not determine a constructor"),
}


@pytest.mark.parametrize(("text", "said"), BOMBS.values(), ids=BOMBS)
def test_scene_that_would_take_all_time_or_memory(written, text, said):
    """Each in well under a second; what they would take else is minutes, or gigabytes."""
    path = written(text.encode(), "yaml")
    with pytest.raises(ValueError, match=said) as caught:
        load_scene(path)
    assert sentence(caught.value).startswith(f"{path}: ")


def test_many_frames_are_read_in_linear_time(written):
    """5000 frames: 0.8 s. With a count over all names for each name it took minutes."""
    lines = "".join(f"    frames.f{i}.axes: world\n" for i in range(5000))
    assert len(load_scene(written((HEAD + lines).encode(), "yaml")).frames) == 5000


@pytest.mark.parametrize(
    ("text", "name", "read"),
    [
        ("1:30", "world_frame_id", "1:30"),
        ("2024-01-01", "world_frame_id", "2024-01-01"),
        ("1_000", "world_frame_id", "1_000"),
        ("010", "rate", 8.0),
        ("0x10", "rate", 16.0),
    ],
)
def test_plain_text_is_read_as_ros_reads_it(written, text, name, read):
    assert load_scene(written(f"{HEAD}    {name}: {text}\n    publish_rate: 0.0\n".encode(), "yaml"))[name] == read


def test_device_that_never_ends_is_refused():
    with pytest.raises(ValueError, match="has more than 1000000 characters"):
        load_scene("/dev/zero")


# URDF -----------------------------------------------------------------------------------------------------------------

ROBOT = (
    b'<?xml version="1.0"?><robot name="r"><link name="a"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/>'
    b'<mass value="2.5"/><inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.5"/></inertial></link>'
    b'<link name="b"/></robot>'
)
PIECES = [
    b"2.5",
    b"0.3",
    b"0.1 -0.2 0.3",
    b"link",
    b"inertial",
    b"<",
    b"/>",
    b'"',
    b"robot",
    b"mass",
    b"origin",
    b'1.0"',
]
INSTEAD = [b"1e308", b"-1", b"nan", b"inf", b"1e-320", b"", b"1e308 1e308 1e308", b"&a;", b"&#0;", b"&#x10ffff;", b"\0"]
INSTEAD += [
    b"<!DOCTYPE r>",
    b"<!-- ",
    b"<![CDATA[",
    b"<?x ",
    b'1.0" encoding="utf-16"',
    b'1.0" encoding="latin-1"',
    b'1.0" encoding="cp1252"',
    b'1.0" encoding="hex"',
    b"\xff\xfe",
    b"0x10",
    b"9" * 500,
]


def urdf_text(chance):
    data = ROBOT
    for _ in range(chance.randint(1, 3)):
        data = data.replace(chance.choice(PIECES), chance.choice(INSTEAD), chance.choice((1, 1, 2, -1)))
    return data if often(chance) else damaged(chance, data)


def check_body_of(parameter, path, taken):
    """The scene with that file has a body, or says why not."""
    scene = refused(path, lambda path: Scene({parameter: str(path)}))
    if scene is not None:
        assert np.isfinite(scene.body().inertia_entries).all() and math.isfinite(scene["body.mass"])
        taken.append(path)


def test_urdfs(record_property, written):
    taken = []

    def check(data):
        check_body_of("body.urdf_file", written(data, "urdf"), taken)

    fuzz(record_property, check, urdf_text, 600)
    assert taken, "every file was refused"


def nested(depth):
    return b"<robot>" + b"<link>" * depth + b"</link>" * depth + b"</robot>"


LAUGHS = b"".join(b'<!ENTITY %c "&%c;&%c;">' % (b, a, a) for a, b in zip(b"abcdefghi", b"bcdefghij", strict=True))
EVIL = {
    "a billion laughs": (b'<!DOCTYPE r [<!ENTITY a "x">' + LAUGHS + b"]><robot>&j;</robot>", "has a DOCTYPE"),
    "a file from elsewhere": (
        b'<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot>&a;</robot>',
        "has a DOCTYPE",
    ),
    "laughs in UTF-16": ('<!DOCTYPE r [<!ENTITY a "x">]><robot>&a;</robot>'.encode("utf-16"), "has a DOCTYPE"),
    "in UTF-16 without a mark": ('<!DOCTYPE r [<!ENTITY a "x">]><robot/>'.encode("utf-16-le"), "has a DOCTYPE"),
    "an entity declared elsewhere": (b'<!DOCTYPE r SYSTEM "r.dtd"><robot><link name="&a;"/></robot>', "has a DOCTYPE"),
    "an entity in an attribute": (b'<!DOCTYPE r><robot name="&a;"/>', "is not XML: undefined entity"),
    "an encoding of no name": (
        b'<?xml version="1.0" encoding="hex"?><robot name="\xff"/>',
        "is not UTF-8 text, nor XML",
    ),
    "an encoding of many bytes": (
        '<?xml version="1.0" encoding="gbk"?><robot name="机"/>'.encode("gbk"),
        "is not UTF-8",
    ),
    "deep": (nested(200_000), "has 1 links? with|has 0 links with"),
    "deep and without an end": (b"<robot>" + b"<link>" * 500_000, "is not XML"),
    "no inertial": (b'<robot><link name="a"/></robot>', "has 0 links with <inertial>"),
    "a link twice": (ROBOT.replace(b'name="b"', b'name="a"'), "has two links of the name 'a'"),
    "many attributes": (b"<robot " + b" ".join(b'a%d="1"' % i for i in range(100_000)) + b"/>", "has 0 links"),
}


@pytest.mark.parametrize(("data", "said"), EVIL.values(), ids=EVIL)
def test_urdf_that_would_take_all_memory_or_read_other_files(written, data, said):
    path = written(data, "urdf")
    with pytest.raises(ValueError, match=said) as caught:
        urdf.read(path)
    assert sentence(caught.value).startswith(f"file {path}: ")


def test_urdf_longer_than_any_robot_is_refused(monkeypatch, written):
    monkeypatch.setattr(urdf, "MOST_BYTES", len(ROBOT) - 1)
    with pytest.raises(ValueError, match=r"has more than 2.. bytes; a URDF has a few million at most"):
        urdf.read(written(ROBOT, "urdf"))


# Meshes ---------------------------------------------------------------------------------------------------------------

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
FACET = struct.Struct("<12fH")


def binary_stl(count=4):
    facets = b"".join(FACET.pack(0, 0, 0, *CORNERS[face].ravel(), 0) for face in FACES)
    return bytes(80) + struct.pack("<I", count) + facets


def text_stl():
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in CORNERS[face])
        + "endloop\nendfacet\n"
        for face in FACES
    )
    return f"solid a\n{facets}endsolid a\n".encode()


def obj():
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    return (corners + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)).encode()


def off():
    corners = "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    return ("OFF\n4 4 0\n" + corners + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)).encode()


def ply():
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
    head += "property double z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + CORNERS.astype("<f8").tobytes() + b"".join(struct.pack("<B3i", 3, *face) for face in FACES)


MESHES = [(binary_stl(), "stl"), (text_stl(), "stl"), (obj(), "obj"), (off(), "off"), (ply(), "ply")]
WORDS = [
    b"nan",
    b"inf",
    b"1e308",
    b"1e39",
    b"-0",
    b"99",
    b"-1",
    b"0",
    b"1.5.2",
    b"4294967295",
    b"solid",
    b"endsolid",
    b"v ",
    b"f ",
    b"OFF",
    b"property list int double x\n",
    b"element vertex 4000000000\n",
]
WORDS += [
    b"mtllib /etc/passwd\nusemtl a\n",
    b"f 1/1/1 2//2 3/3\n",
    b"\n",
    b"vertex ",
    struct.pack("<f", math.nan),
    b"\xff" * 4,
]


def mesh_data(chance):
    data, suffix = chance.choice(MESHES)
    how = chance.randrange(4)
    if how == 0:
        return damaged(chance, data), suffix
    if how == 1:
        return damaged(chance, damaged(chance, data)), suffix
    if how == 2 and suffix == "stl":
        return binary_stl(chance.choice((0, 1, 3, 5, 2**31, 2**32 - 1))), suffix
    at = chance.randint(0, len(data))
    return data[:at] + chance.choice(WORDS) + data[at + chance.choice((0, 1, 3, 4)) :], suffix


def test_meshes(record_property, written):
    pytest.importorskip("trimesh")
    taken = []

    def check(case):
        check_body_of("body.mesh_file", written(*case), taken)

    fuzz(record_property, check, mesh_data, 300)
    assert taken, "every file was refused"


LIES = {
    "fewer facets than it says": binary_stl(5),
    "more facets than it says": binary_stl(3),
    "four billion facets": binary_stl(2**32 - 1),
    "cut in the middle of a facet": binary_stl()[:-20],
    "cut in the middle of the head": binary_stl()[:50],
    "a word for a number": text_stl().replace(b"vertex 1.0", b"vertex one", 1),
    "words after a whole solid": text_stl().replace(b"endsolid", b"vertex x y z\nendsolid"),
}


@pytest.mark.parametrize("data", LIES.values(), ids=LIES)
def test_stl_that_says_something_else_than_it_holds_is_refused(written, data):
    pytest.importorskip("trimesh")
    taken = []
    check_body_of("body.mesh_file", written(data, "stl"), taken)
    assert not taken


def test_mesh_larger_than_any_is_refused(monkeypatch, written):
    monkeypatch.setattr(mesh_file, "MOST_BYTES", 100)
    with pytest.raises(ValueError, match="has more than 100 bytes; give a coarser mesh"):
        mesh_file.read(written(binary_stl(), "stl"))


def test_limits_leave_room_for_what_people_have():
    assert max(path.stat().st_size for path in CONFIG) * 100 < parameter_file.MOST_CHARACTERS
