"""What a command line and its files give a node: the same as load_scene reads, or the same refusal. No ROS in here."""

import os

import pytest

from rigid_body_sim import Scene, load_scene
from rigid_body_sim.ros import arguments
from rigid_body_sim.scene import schema

NODE = "rigid_body_node"
HEAD = "/**:\n  ros__parameters:\n"


def node_scene(*args):
    """The scene of a node that is started with these arguments after --ros-args."""
    parameters = arguments.read(["--ros-args", *map(str, args)], NODE).parameters
    return Scene({name: value for name, value in parameters.items() if not schema.belongs_to_ros(name)})


@pytest.fixture
def written(tmp_path):
    """A function: the path of a file of these bytes, or this text."""

    def write(data, name="file.yaml"):
        path = tmp_path / name
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return path

    return write


def below(*lines):
    return HEAD + "".join(f"    {line}\n" for line in lines)


BODY = "{mass: 2.0, inertia: [0.1, 0.2, 0.25, 0.0, 0.0, 0.0]}"
READ = {  # a file, and values that both readers find in it
    "two nodes": (
        f"/rigid_body_node:\n  ros__parameters:\n    body: {BODY}\n/controller:\n  ros__parameters:\n    gain: 3.0\n",
        {"body.mass": 2.0, "body.inertia": (0.1, 0.2, 0.25, 0.0, 0.0, 0.0)},
    ),
    "the other one first": (
        "controller: {ros__parameters: {rate: }}\nrigid_body_node: {ros__parameters: {rate: 5, publish_rate: 0}}\n",
        {"rate": 5.0},
    ),
    "without a slash": ("rigid_body_node:\n  ros__parameters: {body.mass: 2.0}\n", {"body.mass": 2.0}),
    "any node of one name": ("/*:\n  ros__parameters: {body.mass: 2.0}\n", {"body.mass": 2.0}),
    "in any namespace": ("/**/rigid_body_node:\n  ros__parameters: {body.mass: 2.0}\n", {"body.mass": 2.0}),
    "later section over earlier": (
        "/**:\n  ros__parameters: {body.mass: 2.0, gravity: [0, 0, -1]}\n/rigid_body_node:\n"
        "  ros__parameters: {body: {mass: 3.0}}\n",
        {"body.mass": 3.0, "gravity": (0.0, 0.0, -1.0)},
    ),
    "later section over earlier, whichever is the special one": (
        "/rigid_body_node:\n  ros__parameters: {body.mass: 2.0}\n/**:\n  ros__parameters: {body.mass: 3.0}\n",
        {"body.mass": 3.0},
    ),
    "angles over a quaternion": (
        "/**:\n  ros__parameters: {initial: {orientation: {w: 0, x: 1, y: 0, z: 0}}}\n/rigid_body_node:\n"
        "  ros__parameters: {initial.rpy: [0, 0, 0]}\n",
        {"initial.orientation.w": 1.0, "initial.orientation.x": 0.0},
    ),
    "integers and floats mixed": (below("gravity: [0, 0, -9.81]"), {"gravity": (0.0, 0.0, -9.81)}),
    "integers": (below("gravity: [0, 0, -10]", "body.mass: 2"), {"gravity": (0.0, 0.0, -10.0), "body.mass": 2.0}),
    "nested and dotted": (
        below("body: {mass: 2.0}", "body.frame_id: hull"),
        {"body.mass": 2.0, "body.frame_id": "hull"},
    ),
    "exponent without a point": (below("body.mass: 1e3"), {"body.mass": 1000.0}),
    "exponent with a sign": (below("body.mass: +2.5E-1"), {"body.mass": 0.25}),
    "point at an end": (below("body.mass: 2.", "rate: .5", "publish_rate: 0"), {"body.mass": 2.0, "rate": 0.5}),
    "octal": (below("body.mass: 010"), {"body.mass": 8.0}),
    "hexadecimal": (below("body.mass: 0x10"), {"body.mass": 16.0}),
    "large integer": (
        below("body.inertia: [100000000000000000000, 1e20, 1e20, 0, 0, 0]"),
        {"body.inertia": (*[1e20] * 3, 0.0, 0.0, 0.0)},
    ),
    **{
        f"truth value {text}": (below(f"lockstep: {text}"), {"lockstep": truth})
        for text, truth in {"true": True, "True": True, "yes": True, "on": True, "no": False, "OFF": False}.items()
    },
    "text that could be something else": (
        below("world_frame_id: 'yes'", 'body.frame_id: "1.0"', "frames.no.axes: world", "frames.1.axes: body"),
        {"world_frame_id": "yes", "body.frame_id": "1.0", "frames.no.axes": "world", "frames.1.axes": "body"},
    ),
    "date": (below("world_frame_id: 2024-01-01"), {"world_frame_id": "2024-01-01"}),
    "time": (below("world_frame_id: 1:30"), {"world_frame_id": "1:30"}),
    "tag": (below("world_frame_id: !!str 5", "body.mass: !!float 5"), {"world_frame_id": "5", "body.mass": 5.0}),
    "anchor that nothing refers to": (below("body.mass: &m 2.0"), {"body.mass": 2.0}),
    "empty array": (below("outputs: []", "body.dimensions: []"), {"outputs": (), "body.dimensions": ()}),
    "names": (below("outputs: [odom, imu]"), {"outputs": ("odom", "imu")}),
    "empty group": (below("body: {}"), {"body.mass": 1.0}),
    "no parameters": ("/**:\n  ros__parameters:\n", {"body.mass": 1.0}),
    "empty parameters": ("/**:\n  ros__parameters: {}\n", {"body.mass": 1.0}),
    "ROS's own beside": (
        below("use_sim_time: false", "qos_overrides: {/pose: {publisher: {depth: 5}}}", "body.mass: 2"),
        {"body.mass": 2.0},
    ),
    "byte order mark": (b"\xef\xbb\xbf" + below("body.mass: 2.0").encode(), {"body.mass": 2.0}),
    "lines as of Windows": (below("body.mass: 2.0").replace("\n", "\r\n"), {"body.mass": 2.0}),
    "marks of a document": (f"%YAML 1.1\n---\n{below('body.mass: 2.0')}...\n", {"body.mass": 2.0}),
    "letters of all the world": (below("world_frame_id: größe"), {"world_frame_id": "größe"}),
}

REFUSED = {  # a file, and what both readers say of it
    "member without parameters": (below("frames: {arm: {}}"), "parameter frames.arm has nothing in it; give its"),
    "group twice": (
        below("body: {mass: 2.0}", "rate: 9.0", "body: {inertia: [1, 1, 1, 0, 0, 0]}"),
        "key 'body' is given twice, in lines 3 and 5; give it once",
    ),
    "name twice": (below("body.mass: 2.0", "body.mass: 2.0"), "key 'body.mass' is given twice, in lines 3 and 4"),
    "section twice": (
        "/**: {ros__parameters: {rate: 9.0}}\n/**: {ros__parameters: {}}\n",
        "key '/**' is given twice, in lines 1 and 2",
    ),
    "section twice by another name": (
        "a: {ros__parameters: {rate: 9.0}}\n/a: {ros__parameters: {}}\n",
        "section /a is given twice; give it once",
    ),
    "twice in another node's section": (
        below("rate: 9.0") + "other: {ros__parameters: {a: 1, a: 2}}\n",
        "key 'a' is given twice, in lines 4 and 4",
    ),
    "nested and dotted": (
        below("body.mass: 1.0", "body: {mass: 2.0}"),
        "parameter body.mass is given twice; give it once",
    ),
    "alias": (below("body.inertia: &a [1, 1, 1, 0, 0, 0]", "gravity: *a"), "has an alias (*name); write the value out"),
    "merge": (below("body: {<<: {mass: 2.0}}"), "parameter body.<<.mass is not known"),
    "no value": (below("body.mass:"), "parameter body.mass has no value; write one, or leave the name out"),
    "null": (below("body.mass: null"), "parameter body.mass has no value"),
    "tilde": (below("body.mass: ~"), "parameter body.mass has no value"),
    "group without anything": (below("body:", "rate: 9.0"), "parameter body has no value"),
    "map for a number": (below("body.mass: {}"), "parameter body.mass = {}: {} is not a number"),
    "infinite": (below("body.mass: .inf"), "parameter body.mass = inf: is not finite"),
    "not a number": (below("gravity: [0, 0, .nan]"), "parameter gravity = [0, 0, nan]: is not finite"),
    "infinite by another name": (below("body.mass: inf"), "'inf' is not a number"),
    "underscore": (below("body.mass: 1_000"), "'1_000' is not a number"),
    "octal by another name": (below("body.mass: 0o10"), "'0o10' is not a number"),
    "binary": (below("body.mass: 0b1"), "'0b1' is not a number"),
    "time for a number": (below("body.mass: 1:30"), "'1:30' is not a number"),
    "text for a truth value": (below("lockstep: y"), "parameter lockstep = 'y': is not of type bool"),
    "truth value for a text": (below("world_frame_id: no"), "parameter world_frame_id = False: is not of type string"),
    "list of lists": (below("gravity: [[0, 0, 1]]"), "[0, 0, 1] is not a number"),
    "empty": (
        "",
        "holds nothing; a parameter file has sections for nodes, such as '/**:', with 'ros__parameters:' below",
    ),
    "comments alone": ("# body.mass: 2.0\n", "holds nothing"),
    "list": ("- body.mass: 2.0\n", "holds [{'body.mass': 2.0}]; a parameter file has sections"),
    "text": ("body.mass=2.0\n", "holds 'body.mass=2.0'; a parameter file has sections"),
    "no section": (
        "body: {mass: 2.0}\n",
        "'mass' in the section /body is not below 'ros__parameters:'; a parameter file",
    ),
    "no section, dotted": ("body.mass: 2.0\n", "'body.mass' stands at the top, and is no section; a parameter file"),
    "no section, only what is below": (
        "ros__parameters: {rate: 9.0}\n",
        "'ros__parameters' stands at the top, and is no section",
    ),
    "section that is empty": ("/**:\n", "'/**' stands at the top, and is empty; a parameter file has"),
    **{
        f"misspelt as {name}": (f"/**:\n  {name}:\n    rate: 9.0\n", f"(did you mean that by '{name}'?)")
        for name in ("ros_parameters", "ros__parameter", "ros__params", "ROS__parameters", "ros___parameters")
    },
    "beside": (
        "/**:\n  ros__parameters: {}\n  rate: 1.0\n",
        "'rate' stands beside 'ros__parameters:', and not below it",
    ),
    "parameters in a list": (
        "/**:\n  ros__parameters: [1, 2]\n",
        "'ros__parameters:' holds [1, 2]; it needs names with",
    ),
    "two documents": (f"{below('rate: 9.0')}---\n{below('rate: 8.0')}", "but found another document"),
    "tab": ("/**:\n\tros__parameters: {}\n", "found character '\\t' that cannot start any token"),
    "bracket that is open": ("/**: [1, 2\n", "is not YAML: while parsing a flow sequence"),
    "not UTF-8": (below("body.frame_id: gr\xf6\xdfe").encode("latin-1"), "is no text in UTF-8 (byte 0xf6 is none)"),
    "UTF-16": (below("rate: 9.0").encode("utf-16"), "is no text in UTF-8 (byte 0xff is none); save it as UTF-8"),
    "zero bytes": (b"\0\0\0\0", "special characters are not allowed"),
    "unknown name": (below("body.mas: 2.0"), "parameter body.mas is not known; did you mean body.mass?"),
    "python": (below("rate: !!python/object/apply:os.getcwd []"), "could not determine a constructor"),
    "key that is a list": (below("? [1, 2]", ": 3"), "key [1, 2] is no name"),
    "deep": ("a: " + 5000 * "[" + 5000 * "]", "is nested too deeply"),
}


@pytest.mark.parametrize(("data", "values"), READ.values(), ids=READ)
def test_node_and_library_read_the_same(written, data, values):
    path = written(data)
    scene = node_scene("--params-file", path)
    assert {name: scene[name] for name in values} == values
    assert load_scene(path).values == scene.values


@pytest.mark.parametrize(("data", "said"), REFUSED.values(), ids=REFUSED)
def test_node_and_library_refuse_the_same_in_the_same_words(written, data, said):
    path, texts = written(data), []
    for read in (load_scene, lambda path: node_scene("--params-file", path)):
        with pytest.raises(ValueError) as caught:
            read(path)
        texts.append(str(caught.value).removeprefix(f"{path}: "))
    assert texts[0] == texts[1]
    assert said in texts[0] and texts[0].isprintable()


# Whose parameters -----------------------------------------------------------------------------------------------------

NAMES = """
/rigid_body_node: {ros__parameters: {rate: 1.0}}
/a: {ros__parameters: {rate: 2.0}}
x: {rigid_body_node: {ros__parameters: {rate: 3.0}}, b: {ros__parameters: {rate: 4.0}}}
/y/*: {ros__parameters: {rate: 5.0}}
"""


@pytest.mark.parametrize(
    ("rules", "node", "rate"),
    [
        ((), "/rigid_body_node", 1.0),
        (("-r", "__node:=a"), "/a", 2.0),
        (("--remap", "__name:=a"), "/a", 2.0),
        (("-r", "__ns:=/x"), "/x/rigid_body_node", 3.0),
        (("-r", "__ns:=/x", "-r", "__node:=b"), "/x/b", 4.0),
        (("-r", "rigid_body_node:__node:=b", "-r", "b:__ns:=/x"), "/x/b", 4.0),
        (("-r", "__ns:=/y", "-r", "__ns:=/x"), "/y/rigid_body_node", 5.0),  # the first of two counts
        (("-r", "__ns:=/"), "/rigid_body_node", 1.0),
        (("-r", "other:__ns:=/x", "-r", "other:__node:=a", "-r", "wrench:=__ns"), "/rigid_body_node", 1.0),
        (("--", "-r", "__ns:=/x", "--ros-args", "-r", "__node:=a"), "/a", 2.0),  # what is between is not ROS's
    ],
)
def test_node_takes_the_sections_of_its_own_name(written, rules, node, rate):
    path = written(NAMES)
    args = ["-p", "publish_rate:=0.0", "--params-file", path, *rules]
    assert node_scene(*args)["rate"] == rate
    found = arguments.read(["--ros-args", *map(str, args)], NODE)
    assert arguments.full_name(found.ros, NODE) == node and not found.notes
    with pytest.raises(ValueError, match="publish_rate"):  # the other files do not give it
        load_scene(path, node)


def test_file_for_others_is_noted_with_their_names_and_ours(written):
    path = written("/controller: {ros__parameters: {gain: 3.0}}\n/x/rigid_body_node: {ros__parameters: {rate: 3.0}}\n")
    found = arguments.read(["--ros-args", "--params-file", str(path)], NODE)
    assert found.parameters == {}
    assert found.notes == [
        f"{path} has nothing for this node, /rigid_body_node: it has parameters for /controller, /x/rigid_body_node"
    ]
    with pytest.raises(ValueError, match="has no section for /rigid_body_node; it has /controller, /x/rigid_body_node"):
        load_scene(path)
    with pytest.raises(ValueError, match="has no section for /satellite; it has /controller, /x/rigid_body_node"):
        load_scene(path, "/satellite")


def test_library_takes_no_section_of_another_node_unless_it_is_named(written):
    """As the node, which says that there is nothing for it."""
    path = written("/x/satellite: {ros__parameters: {body.mass: 3.0}}\n")
    with pytest.raises(ValueError, match="no section for /rigid_body_node; it has /x/satellite: name the node that is"):
        load_scene(path)
    assert load_scene(path, "x/satellite")["body.mass"] == 3.0


# Several sources ------------------------------------------------------------------------------------------------------


def test_later_file_is_over_the_earlier_and_the_command_line_over_all(written):
    first = written("/rigid_body_node: {ros__parameters: {body.mass: 2.0, gravity: [0, 0, -1], rate: 100}}\n", "1.yaml")
    second = written("/**: {ros__parameters: {body: {mass: 3}, start_paused: true}}\n", "2.yaml")
    scene = node_scene("-p", "rate:=200", "--params-file", first, "--params-file", second)
    assert (scene["body.mass"], scene["gravity"], scene["rate"]) == (3.0, (0.0, 0.0, -1.0), 200.0)
    assert scene["start_paused"]
    assert node_scene("--params-file", second, "--params-file", first)["body.mass"] == 2.0


def test_attitude_of_a_later_source_takes_the_place_of_an_earlier_one(written):
    quaternion = written(below("initial.orientation: {w: 0, x: 0, y: 1, z: 0}"))
    assert node_scene("--params-file", quaternion, "-p", "initial.rpy:=[0, 0, 0]")["initial.orientation.w"] == 1.0
    turned = node_scene("--params-file", quaternion, "-p", "initial.orientation.w:=1")
    assert [turned[f"initial.orientation.{part}"] for part in "wxyz"] == [1.0, 0.0, 1.0, 0.0]


def test_files_that_a_file_names_begin_at_its_folder_and_those_of_the_command_line_here(tmp_path, monkeypatch):
    moments = 'ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"'
    link = f'<link name="a"><inertial><mass value="{{}}"/><inertia {moments}/></inertial></link>'
    robot = f'<robot name="r">{link}</robot>'
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/hull.urdf").write_text(robot.format(2.5))
    (tmp_path / "hull.urdf").write_text(robot.format(7.0))
    path = tmp_path / "scenes/scene.yaml"
    path.write_text(below("body.urdf_file: hull.urdf"))
    monkeypatch.chdir(tmp_path)
    for name in (path, "scenes/scene.yaml"):
        assert load_scene(name)["body.mass"] == node_scene("--params-file", name)["body.mass"] == 2.5
    assert node_scene("-p", "body.urdf_file:=hull.urdf")["body.mass"] == 7.0


# The command line -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("body.mass:=2", "body.mass", 2.0),
        ("body.mass:=1e3", "body.mass", 1000.0),
        ("gravity:=[0, 0, -9.81]", "gravity", (0.0, 0.0, -9.81)),
        ("rigid_body_node:body.mass:=2", "body.mass", 2.0),
        ("body:={mass: 2.0}", "body.mass", 2.0),
        ("outputs:=[odom]", "outputs", ("odom",)),
        ("outputs:=[]", "outputs", ()),
        ("lockstep:=yes", "lockstep", True),
        ("world_frame_id:='yes'", "world_frame_id", "yes"),
        ("world_frame_id:=a:=b", "world_frame_id", "a:=b"),
    ],
)
def test_assignment_is_read_as_a_line_of_a_file_is(text, name, value):
    for flag in ("-p", "--param"):
        assert node_scene(flag, text)[name] == value


BAD = {
    "equals sign": (["-p", "body.mass=3.0"], "-p body.mass=3.0: has '=' where ':=' is needed; write -p body.mass:=3.0"),
    "colon": (
        ["-p", "body.mass:3.0"],
        "-p body.mass:3.0: assigns nothing; write -p NAME:=VALUE, such as -p body.mass:=2.0",
    ),
    "nothing": (["-p", "body.mass"], "assigns nothing"),
    "no name": (["-p", ":=3.0"], "assigns nothing"),
    "no value": (["-p", "body.mass:="], "-p body.mass:=: parameter body.mass has no value; write one"),
    "not YAML": (["-p", "gravity:=[0, 0"], "-p gravity:=[0, 0: is not YAML: "),
    "twice": (
        ["-p", "body.mass:=2.0", "-p", "body.mass:=3.0"],
        "-p body.mass:=3.0: parameter body.mass is given twice, first as 2.0; give it once",
    ),
    "twice the same": (["-p", "rate:=9", "--param", "rate:=9"], "parameter rate is given twice, first as 9"),
    "alone": (["-p"], "-p has nothing behind it; give -p NAME:=VALUE"),
    "file alone": (["--params-file"], "--params-file has nothing behind it; give --params-file FILE"),
    "unknown name": (["-p", "body.mas:=2.0"], "parameter body.mas is not known; did you mean body.mass?"),
    "missing file": (
        ["--params-file", "nowhere.yaml"],
        "--params-file nowhere.yaml: cannot be read (No such file or directory); give",
    ),
    "folder": (["--params-file", "/"], "--params-file /: cannot be read (Is a directory)"),
    "through a file": (["--params-file", "/dev/null/x"], "cannot be read (Not a directory)"),
    "empty device": (["--params-file", "/dev/null"], "/dev/null: holds nothing"),
    "endless device": (["--params-file", "/dev/zero"], "/dev/zero: has more than 1000000 characters"),
}


@pytest.mark.parametrize(("args", "said"), BAD.values(), ids=BAD)
def test_bad_argument_is_one_sentence(args, said):
    with pytest.raises(ValueError) as caught:
        node_scene(*args)
    assert said in str(caught.value) and str(caught.value).isprintable()


def test_file_that_may_not_be_read_is_one_sentence(written, monkeypatch):
    """Root may read all: the refusal of the system is put in its place."""

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)
    with pytest.raises(ValueError, match=r"--params-file x\.yaml: cannot be read \(Permission denied\); give a"):
        node_scene("--params-file", "x.yaml")


def test_name_that_cannot_be_printed_is_shown_with_escapes(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff\n.yaml")
    for text, said in (
        (None, "cannot be read"),
        ("", "holds nothing"),
        ("/**: {ros__parameters: {rate: }}", "has no val"),
    ):
        if text is not None:
            path.write_text(text)
        with pytest.raises(ValueError, match=said) as caught:
            node_scene("--params-file", path)
        assert "\\udcff\\n.yaml" in str(caught.value) and str(caught.value).isprintable()
    path.write_text("other: {ros__parameters: {}}")
    (note,) = arguments.read(["--ros-args", "--params-file", str(path)], NODE).notes
    assert note.isprintable()
    for text in ("a\x1b=3", "a\x1b:=[", "a\x1b:="):
        with pytest.raises(ValueError, match=r"-p 'a\\x1b") as caught:
            node_scene("-p", text)
        assert str(caught.value).isprintable()


def test_assignment_for_another_node_is_noted():
    found = arguments.read(["--ros-args", "-p", "other:rate:=5.0"], NODE)
    assert found.parameters == {}
    assert found.notes == ["-p other:rate:=5.0 is for the node /other, and this one is /rigid_body_node"]


def test_rclpy_gets_what_is_not_a_parameter(written):
    rest = ["-r", "wrench:=force", "--log-level", "debug", "-e", "/a", "-r"]  # the last is rcl's to refuse
    args = ["own", "--ros-args", "-p", "rate:=5", *rest[:5], "--params-file", written(HEAD), "--", "--help"]
    found = arguments.read([*map(str, args), "--ros-args", *rest[5:]], NODE)
    assert found.ros == ["--ros-args", *rest]
    assert found.parameters == {"rate": 5}
    assert arguments.read([], NODE) == arguments.Arguments()
