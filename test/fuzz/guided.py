"""Input that is changed towards lines of code not reached before: ``python guided.py [runs]``, 20 000 for each reader.

atheris watches the readers of this package and the YAML parser, and begins with what the random tests begin with. What
is checked is what those check. Exit status 1 when something fails, which atheris then writes into a file and names.
"""

import importlib
import multiprocessing
import os
import random
import sys
import tempfile
from contextlib import redirect_stderr
from functools import partial
from io import StringIO
from pathlib import Path

TESTS, ROOT = Path(__file__).parents[1:3]

WATCHED = ["rigid_body_sim", "yaml"]
COMPILED = ["kernels", "effects", "integrators"]  # numba cannot compile what atheris has changed
RUNS = 20_000
BEGINNINGS = 200  # random messages to begin with
OPTIONS = ["-seed=1", "-timeout=20", "-rss_limit_mb=4096", "-verbosity=0"]
MESH = "body.mesh_file"


def files(suffix, beginnings, check):
    """What checks a file with given bytes, and files to begin with."""
    path = Path(f"file.{suffix}").resolve()

    def one(data):
        path.write_bytes(data)
        check(path, [])

    return one, beginnings


def messages(commands, check, *topics):
    """What checks bytes sent to any of those topics, which the first byte chooses."""
    chance = random.Random(1)

    def one(data):
        if data:
            check([(topics[data[0] % len(topics)], data[1:])])

    chosen = [chance.randrange(len(topics)) for _ in range(BEGINNINGS)]
    return one, [bytes([i]) + commands.made(chance, topics[i]) for i in chosen]


def scenes(tests, _):
    return files("yaml", [path.read_bytes() for path in tests.CONFIG], tests.check_scene)


def urdfs(tests, _):
    return files("urdf", [tests.ROBOT], partial(tests.check_body_of, "body.urdf_file"))


def stls(tests, _):
    return files("stl", [data for data, of in tests.MESHES if of == "stl"], partial(tests.check_body_of, MESH))


def objs(tests, _):
    return files("obj", [data for data, of in tests.MESHES if of == "obj"], partial(tests.check_body_of, MESH))


def wrenches(_, commands):
    return messages(commands, commands.check_wrenches, "wrench", "gust", "impulse")


def states(_, commands):
    return messages(commands, commands.check_states, "set_pose", "set_twist")


def actuators(_, commands):
    return messages(commands, commands.check_actuators, "actuator_commands")


TARGETS = (scenes, urdfs, stls, objs, wrenches, states, actuators)


def compile_all():
    """Before any time is taken: a first run compiles for a minute."""
    from rigid_body_sim import Body, Simulation
    from rigid_body_sim.integrators import REGISTRY

    for name in REGISTRY:
        Simulation(Body(1.0, (1.0, 1.0, 1.0)), integrator=name).step()


def explore(target, runs, folder):
    """Never returns: libFuzzer ends the process, with status 0 when nothing was found."""
    sys.path[:0] = [str(TESTS), str(ROOT)]
    import atheris

    importlib.import_module("conftest")  # the settings of hypothesis
    sources = (file for name in COMPILED for file in (ROOT / "rigid_body_sim" / name).glob("*.py"))
    left_out = ["rigid_body_sim." + f"{file.parent.name}.{file.stem}".removesuffix(".__init__") for file in sources]
    with redirect_stderr(StringIO()), atheris.instrument_imports(include=WATCHED, exclude=left_out):
        from fuzz import test_commands, test_files
    compile_all()
    found_in = f"-artifact_prefix={Path.cwd()}/{target.__name__}-"
    os.chdir(folder)
    check, beginnings = target(test_files, test_commands)
    for number, data in enumerate(beginnings):
        Path("corpus", str(number)).write_bytes(data)
    longest = f"-max_len={2 * max(map(len, beginnings))}"
    atheris.Setup([target.__name__, f"-runs={runs}", longest, found_in, *OPTIONS, "corpus"], check)
    atheris.Fuzz()


def passes(target, runs):
    """Whether that many runs find nothing, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "corpus").mkdir()
        process = multiprocessing.get_context("spawn").Process(target=explore, args=(target, runs, folder))
        process.start()
        process.join()
    print(f"{target.__name__}: {runs} runs, {'FAILED' if process.exitcode else 'nothing found'}", flush=True)
    return process.exitcode == 0


def main(runs=RUNS):
    """Try all, whatever fails; returns the exit status."""
    passed = [passes(target, int(runs)) for target in TARGETS]
    return int(not all(passed))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
