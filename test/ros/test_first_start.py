"""A node's first start: only what the scene needs is compiled before it is ready, and the rest is there when needed."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("numba")
pytestmark = pytest.mark.ros

SCENE = {
    "rate": 100.0,
    "publish_rate": 0.0,
    "start_paused": True,
    "body.mass": 2.0,
    "initial.linear_velocity": [3.0, 0.0, 0.0],
}


def kernels(folder):
    """Files in the cache, by the kernel that is in them."""
    return sorted(file.name.partition("-")[0] for file in folder.rglob("*.nbc"))


def test_drag_that_is_set_before_its_kernels_are_there_waits_for_them(connect, tmp_path):
    """And acts from the next step on, by an error-controlled method: v' = -c v / m, here in closed form."""
    node = connect(SCENE, environment={"NUMBA_CACHE_DIR": str(tmp_path)}).ready()
    assert "compiling kernels for this scene" in node.process.stderr
    assert node.set_together({"drag.linear": [1.0, 1.0, 1.0]}).successful
    assert "the simulation waits for some seconds" in node.process.stdout + node.process.stderr
    for _ in range(100):
        assert node.call("step").success
    assert node.twists[-1].twist.linear.x == pytest.approx(3.0 * 2.718281828459045**-0.5, abs=3e-9)  # measured 2e-12


def compile_all(environment):
    return subprocess.run(
        [sys.executable, "-m", "rigid_body_sim.ros.main", "--compile"],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.nightly
def test_compile_fills_the_cache_for_every_scene(connect, tmp_path):
    """Also with drag and tethers, and for a second time there is nothing to do."""
    done = compile_all({"NUMBA_CACHE_DIR": str(tmp_path)})
    assert done.returncode == 0, done.stderr
    assert len(kernels(tmp_path)) == int(done.stdout.split("compiled ")[1].split()[0]) > 20
    assert "compiled 0 kernels" in compile_all({"NUMBA_CACHE_DIR": str(tmp_path)}).stdout
    node = connect({**SCENE, "drag.linear": [1.0, 1.0, 1.0]}, environment={"NUMBA_CACHE_DIR": str(tmp_path)}).ready()
    assert "compiling" not in node.process.stderr


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        ({"RIGID_BODY_SIM_NO_NUMBA": "1"}, "numba is not in use, so there is nothing to compile"),
        (
            {"NUMBA_CACHE_DIR": "/proc/none", "XDG_CACHE_HOME": "/proc/none"},
            "set NUMBA_CACHE_DIR to a folder that only",
        ),
    ],
)
def test_compile_with_nowhere_to_keep_it_says_so(environment, said):
    done = compile_all(environment)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert done.stderr.startswith("rigid_body_node: ") and said in done.stderr


def test_compile_takes_no_parameters():
    """They would have no meaning: it is for every scene."""
    done = subprocess.run(
        [sys.executable, "-m", "rigid_body_sim.ros.main", "--compile", "--ros-args", "-p", "rate:=1.0"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "--compile is for every scene" in done.stderr
