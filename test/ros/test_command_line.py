"""What a node is given outside ROS's arguments: answered, or refused with what was probably meant. No ROS in here."""

import pytest

from rigid_body_sim.ros import command_line

OURS = "a_node --ros-args "
KNOWN = [
    [],
    ["--ros-args"],
    ["--ros-args", "-r", "a:=b", "--params-file", "x.yaml"],
    ["--ros-args", "-r", "a:=b", "--", "--ros-args", "-p", "a:=1"],
    ["--ros-args", "--no-such", "x"],  # rcl's to refuse
    ["--"],
]
MEANT = {  # arguments, and what the sentence proposes
    ("x.yaml",): OURS + "--params-file x.yaml",
    ("config/my scene.yml",): OURS + "--params-file 'config/my scene.yml'",
    ("--params-file", "x.yaml"): OURS + "--params-file x.yaml",
    ("-p", "body.mass:=2.0"): OURS + "-p body.mass:=2.0",
    ("--param", "body.mass:=2.0"): OURS + "--param body.mass:=2.0",
    ("-r", "__ns:=/x"): OURS + "-r __ns:=/x",
    ("--log-level", "debug"): OURS + "--log-level debug",
    ("--disable-rosout-logs",): OURS + "--disable-rosout-logs",
    ("-e", "/enclave"): OURS + "-e /enclave",
    ("body.mass:=2.0",): OURS + "-p body.mass:=2.0",
    ("gravity:=[0, 0, -9.81]",): OURS + "-p 'gravity:=[0, 0, -9.81]'",
    ("__node:=b",): OURS + "-r __node:=b",
    ("/wrench:=/force",): OURS + "-r /wrench:=/force",
    ("x.yaml", "--ros-args", "-r", "a:=b"): OURS + "--params-file x.yaml",
    ("--ros-args", "-r", "a:=b", "--", "x.yaml"): OURS + "--params-file x.yaml",
    ("body.mass",): "argument body.mass is not known, and a_node takes none but ROS's, after --ros-args",
    ("",): "argument '' is not known",
    ("--", "x"): "argument x is not known",
    ("--helo",): "argument --helo is not known; --help tells what can be given",
    ("-x",): "argument -x is not known",
    ("--vers",): "argument --vers is not known",  # no abbreviations
}


def answer(args):
    command_line.answer("a_node", "Does nothing.", "--ros-args", args)


@pytest.mark.parametrize("args", KNOWN, ids=" ".join)
def test_what_is_ros_is_left_to_it(args):
    answer(args)


@pytest.mark.parametrize(("args", "said"), MEANT.items(), ids=map(" ".join, MEANT))
def test_anything_else_is_refused_with_what_was_meant(capsys, args, said):
    with pytest.raises(SystemExit) as ended:
        answer(args)
    out, err = capsys.readouterr()
    assert (ended.value.code, out) == (2, "")
    assert err.startswith("a_node: ") and said in err and err.count("\n") == 1


def test_arguments_between_are_the_programs():
    split = command_line.split(["a", "--ros-args", "-r", "b:=c", "--", "d", "--ros-args", "-p", "e:=1"])
    assert split == (["a", "d"], ["-r", "b:=c", "-p", "e:=1"])
