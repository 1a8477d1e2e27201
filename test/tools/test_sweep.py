"""Grids of runs: every row is there once and right, whatever is interrupted, in processes and on a Dask cluster."""

import contextlib
import csv
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rigid_body_sim import Scene
from rigid_body_sim.bags.reading import read
from rigid_body_sim.resim import resimulating
from rigid_body_sim.scenarios import scenario as scenarios
from rigid_body_sim.tools import sweep

from ..bags import making
from ..resim import runs
from .test_resim import BASE, call, refusal, write_scene

SECONDS = 1.0
WITHIN = 120.0  # s, for a cluster to start or a run to begin, on a slow machine


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with the bag ``run`` and the ``scene.yaml`` of its run."""
    monkeypatch.chdir(tmp_path)
    making.make(tmp_path / "run", runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS))
    write_scene(tmp_path / "scene.yaml")
    return tmp_path


def rows_of(path):
    about, *lines = path.read_text().splitlines()
    assert about.startswith("# ")
    return list(csv.DictReader(lines))


def expected(**changes):
    """Hash of the final state of a run of the scene with other values."""
    scene = BASE.changed({name.replace("__", "."): value for name, value in changes.items()})
    scenario = scenarios.prepare(read("run"), BASE)
    return resimulating.run(scenario, scene).state


SWEEP = ("run", "--scene", "scene.yaml", "--workers", "1", "--vary")  # each more imports all for a second
TWO = (*SWEEP[:-2], "2", SWEEP[-1])


def test_grid_has_a_row_for_each_run(folder, capsys):
    status, out, _ = call(capsys, *TWO, "body.mass=1:3:3", "--vary", "gravity[2]=-9.80665,-1.62")
    assert status == 0 and "Rows: 6 of 6, in run.csv" in out
    rows = {(float(row["body.mass"]), float(row["gravity[2]"])): row for row in rows_of(folder / "run.csv")}
    assert set(rows) == {(m, g) for m in (1.0, 2.0, 3.0) for g in (-9.80665, -1.62)}
    for (mass, g), row in rows.items():
        assert row["state"] == expected(body__mass=mass, gravity=[0.0, 0.0, g])
        assert row["refusal"] == ""
    as_recorded = rows[2.0, -9.80665]
    assert [as_recorded[name] for name in sweep.RESULTS[:4]] == ["0.0"] * 4
    assert all(float(rows[3.0, -9.80665][name]) > 1e-3 for name in ("position_max", "position_rms"))
    assert float(rows[3.0, -1.62]["position_max"]) > float(rows[3.0, -1.62]["position_rms"])


def test_refusals_are_rows_too(folder, capsys):
    """An inertia that no body has, and an integrator that takes no torque."""
    status, _, _ = call(capsys, *SWEEP, "body.inertia[0]=0.1,0.9")
    assert status == 0
    refusals = {row["body.inertia[0]"]: row["refusal"] for row in rows_of(folder / "run.csv")}
    assert refusals["0.1"] == "" and "body.inertia" in refusals["0.9"]
    assert call(capsys, *SWEEP, "integrator.name=taylor,exact,rk4", "--csv", "other.csv")[0] == 0
    refusals = {row["integrator.name"]: row["refusal"] for row in rows_of(folder / "other.csv")}
    assert refusals["taylor"] == refusals["rk4"] == ""


def test_goes_on_with_what_is_there(folder, capsys):
    vary = ("body.mass=1:3:5",)
    assert call(capsys, *SWEEP, *vary)[0] == 0
    whole = (folder / "run.csv").read_text()
    lines = whole.splitlines(keepends=True)
    # Killed in the middle of the third row: the first two are kept, marked here to be seen again.
    kept = [lines[2], lines[3].replace(lines[3].split(",")[5], "kept")]
    (folder / "run.csv").write_text("".join([*lines[:2], *kept, lines[4][:15]]))
    status, out, _ = call(capsys, *SWEEP, *vary)
    assert status == 0 and "Rows: 5 of 5" in out
    again = (folder / "run.csv").read_text().splitlines(keepends=True)
    assert again[:4] == [*lines[:2], *kept]
    assert sorted(again[4:]) == sorted(lines[4:])
    assert call(capsys, *SWEEP, *vary)[0] == 0
    assert (folder / "run.csv").read_text() == "".join(again)


def test_rows_of_another_command_are_not_gone_on_with(folder, capsys):
    assert call(capsys, *SWEEP, "body.mass=1,2")[0] == 0
    assert "--csv run.csv: is of another command, with another vary; give another file" in refusal(
        capsys, *SWEEP, "body.mass=1,3"
    )
    write_scene(folder / "scene.yaml", **{"wrench.timeout": 0.2})
    assert "with another scene;" in refusal(capsys, *SWEEP, "body.mass=1,2")
    write_scene(folder / "scene.yaml")
    making.make(folder / "other", runs.in_real_time(BASE, runs.sends(BASE, SECONDS, seed=4), SECONDS))
    assert "with another bag;" in refusal(
        capsys, "other", "--scene", "scene.yaml", "--vary", "body.mass=1,2", "--csv", "run.csv"
    )
    (folder / "plain.csv").write_text("a,b\n1,2\n")
    assert "is no table of runs" in refusal(capsys, *SWEEP, "body.mass=1,2", "--csv", "plain.csv")
    about = json.loads((folder / "run.csv").read_text().splitlines()[0][2:])
    assert about["vary"] == ["body.mass=1,2"] and set(about) == {"vary", "bag", "scene", "version", "kernels"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("body.mas=1,2",), "parameter body.mas is not known; did you mean body.mass?"),
        (("body.mass",), "is not NAME=first:last:count or NAME=a,b,c"),
        (("body.mass=1:2",), "1:2 is not first:last:count or numbers"),
        (("body.mass=1:2:0",), "1:2:0 is not first:last:count"),
        (("body.mass=heavy",), "heavy is not first:last:count or numbers"),
        (("body.mass=-1,1",), "parameter body.mass = -1.0: is out of range"),
        (("body.mass=1,2,1.0",), "--vary body.mass=1,2,1.0: has the value 1.0 twice; give each once"),
        (("body.mass=2:2:3",), "has the value 2.0 twice"),
        (("body.mass=nan,1",), "parameter body.mass = nan: is not finite"),
        (("gravity[2]=nan,1",), "parameter gravity[2] = nan: is not finite"),
        (("drag.linear[0]=0,-1",), "parameter drag.linear[0] = -1.0: is out of range"),
        (("integrator.name=rk4,euler",), "parameter integrator.name = 'euler': give one of auto, taylor"),
        (("record.path=a,b",), "record.path does not change the motion"),
        (("twist_frame=world,body",), "twist_frame does not change the motion"),
        (("body.frame_id=a,b",), "body.frame_id does not change the motion"),
        (("outputs=odom",), "is of type string array"),
        (("body.mass=1:2:1000000000",), "asks for 1000000000 runs; give at most 1000000"),
        (("body.mass=1:inf:3",), "1:inf:3 is not first:last:count"),
        (("steps_per_command=1:inf:3",), "1:inf:3 is not first:last:count"),
        (("steps_per_command=1,2",), "a command advances nothing in real time"),
        (("body.mass=1:2:inf",), "1:2:inf is not first:last:count"),
        (("body.mass=1", "--csv", "run"), "--csv run: is a folder; give a file, such as run/runs.csv"),
        (("initial.orientation[0]=0,1",), "initial.orientation.w, .x, .y and .z, or initial.rpy"),
        (("gravity=1,2",), "give one entry, such as gravity[0]=..."),
        (("gravity[3]=1,2",), "gravity has the entries 0 to 2"),
        (("body.mass[0]=1",), "give no [0]: it is no array"),
        (("lockstep=true",), "is of type bool; numbers and texts can be varied"),
        (("body.mass=1", "--vary", "body.mass=2"), "--vary body.mass is given twice"),
        (("body.mass=1:2:1000", "--vary", "rate=1:2:2000"), "asks for 2000000 runs; give at most 1000000"),
        (("body.mass=1", "--out", "again"), "--out is for one run"),
        (("body.mass=1", "--tolerance", "1", "1"), "--tolerance is for one run"),
        (("body.mass=1", "--csv", "none/rows.csv"), "--csv none/rows.csv: there is no such folder"),
        (("body.mass=1", "--dask", "tcp://127.0.0.1:1"), "--workers is for processes of this machine"),
    ],
)
def test_what_cannot_be_varied(folder, capsys, arguments, said):
    assert said in refusal(capsys, *SWEEP, *arguments)


def test_attitude_is_varied_by_its_parts_or_its_angles():
    parts, angles = (sweep.variation(text) for text in ("initial.orientation.x=0.5,0.7", "initial.rpy[2]=1,2"))
    scene = Scene({"initial.rpy": [0.1, 0.2, 0.3]})
    assert sweep.changed(scene, [angles], (2.0,)).values == Scene({"initial.rpy": [0.1, 0.2, 2.0]}).values
    w, y, z = (scene[f"initial.orientation.{part}"] for part in "wyz")
    wanted = Scene({"initial": {"orientation": {"w": w, "x": 0.7, "y": y, "z": z}}})
    assert sweep.changed(scene, [parts], (0.7,)).values == wanted.values
    with pytest.raises(ValueError, match=r"initial\.rpy has 0 entries in this scene; there is no \[2\]"):
        sweep.changed(wanted, [angles], (1.0,))


def test_values_are_checked_before_the_bag_is_read(folder, capsys):
    for values in ("body.mass=1:2:1000000000", "body.mass=1,1", "record.path=a"):
        assert f"--vary {values}" in refusal(capsys, "none", "--vary", values)
    grid = ("--vary", "body.mass=1:2:1001", "--vary", "gravity[0]=1:2:1000")
    assert "asks for 1001000 runs" in refusal(capsys, "none", *grid)


def test_what_a_journal_has_noted_cannot_be_varied(folder, capsys):
    making.make(folder / "own", runs.with_journal(BASE, runs.sends(BASE, SECONDS), SECONDS))
    for values in ("wrench.timeout=0.1,0.2", "frames.hook.position[0]=0,1"):
        assert "the journal holds the commands as they took effect" in refusal(capsys, "own", "--vary", values)


def test_progress_without_a_terminal_is_a_line_now_and_then(folder, capsys, monkeypatch):
    monkeypatch.setattr(sweep, "TELL_EVERY", 0.0)
    assert call(capsys, *SWEEP, "body.mass=1:3:3")[2].splitlines() == [
        f"rigid_body_resim: {count} of 3 runs" for count in (1, 2, 3)
    ]


def test_initial_state_of_a_bag_that_begins_late_cannot_be_varied(folder, capsys):
    messages = runs.in_real_time(BASE, runs.sends(BASE, SECONDS), SECONDS)[60:]
    making.make(folder / "late", messages)
    late = ("late", "--scene", "scene.yaml", "--vary", "initial.position[0]=0,1")
    assert "give --start scene, too" in refusal(capsys, *late)
    assert call(capsys, *late, "--start", "scene")[0] == 0


def test_process_that_dies_loses_no_row(folder, capsys, monkeypatch):
    """The rows that are there stay, the call fails with a sentence, and the same call goes on."""
    scenario = scenarios.prepare(read("run"), BASE)
    variations = [sweep.variation("body.mass=1:3:40")]
    table = sweep.Table(folder / "rows.csv", scenario, BASE, variations)

    def runs_with_a_death(work, wanted):
        for count, outcome in enumerate(sweep.processes(1)(work, wanted)):
            if count == 3:
                (child,) = children()
                os.kill(child, signal.SIGKILL)
            yield outcome

    lost = sweep.run(table, scenario, BASE, runs_with_a_death)
    assert lost and "BrokenProcessPool" in lost[0]
    there = len(table.rows)
    assert 4 <= there == 40 - len(lost)
    again = sweep.Table(folder / "rows.csv", scenario, BASE, variations)
    assert len(again.rows) == there
    assert sweep.run(again, scenario, BASE, sweep.processes(1)) == []
    assert len(rows_of(folder / "rows.csv")) == len(again.rows) == 40


def children():
    """Worker processes of this one: those that multiprocessing has spawned, without its resource tracker."""
    import multiprocessing

    return [child.pid for child in multiprocessing.active_children()]


def begin_a_long_sweep():
    command = [sys.executable, "-m", "rigid_body_sim.tools.resim_main", *TWO]
    return subprocess.Popen(
        [*command, "body.mass=1:3:2000", "--csv", "rows.csv"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip


def assert_interrupted(process):
    """With one sentence, and without a process that it leaves behind."""
    _, err = process.communicate(timeout=WITHIN)
    assert process.returncode == 130
    assert err.strip() == "rigid_body_resim: interrupted; the same command goes on with the runs that are left"
    wait(lambda: not in_group(process.pid), "the end of all processes")


def in_group(group):
    """Processes of a group that are no zombies; init may be slow to bury those."""
    states = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, its_group = stat.read_text().rpartition(")")[2].split()[:3]
            states += [state] if int(its_group) == group and state != "Z" else []
    return states


@pytest.mark.parametrize(
    "send",
    [
        pytest.param(lambda process: os.killpg(process.pid, signal.SIGINT), id="Ctrl-C"),
        pytest.param(lambda process: process.terminate(), id="SIGTERM"),
    ],
)
def test_signals_keep_the_rows(folder, send):
    """Ctrl-C as from a terminal, to all processes of the group; SIGTERM to the one that was started."""
    process = begin_a_long_sweep()
    wait(lambda: (folder / "rows.csv").exists() and len(rows_of(folder / "rows.csv")) > 3, "some rows")
    send(process)
    assert_interrupted(process)
    assert 3 < len(rows_of(folder / "rows.csv")) < 2000


def test_ctrl_c_while_workers_start(folder):
    """They import the package then, and must not tell of an interrupted import."""
    process = begin_a_long_sweep()
    wait(lambda: len(in_group(process.pid)) > 2, "a worker")  # beside multiprocessing's own process
    os.killpg(process.pid, signal.SIGINT)
    assert_interrupted(process)


def test_ctrl_c_that_another_thread_takes_waits_until_all_have_started():
    """numpy has threads, and the system gives a signal to any that does not block it."""
    done, begun, (taken, take) = threading.Event(), [], os.pipe()
    os.set_blocking(take, False)
    other = threading.Thread(target=done.wait)
    other.start()
    before = signal.set_wakeup_fd(take)  # written to by whichever thread takes a signal
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # workers of pytest-xdist ignore it
    try:
        with pytest.raises(KeyboardInterrupt), sweep._signals_put_off():
            os.kill(os.getpid(), signal.SIGINT)
            wait(lambda: select.select([taken], [], [], 0.0)[0], "the other thread")
            begun.append("all")
    finally:
        signal.signal(signal.SIGINT, handler)
        signal.set_wakeup_fd(before)
        done.set()
        other.join()
        os.close(taken)
        os.close(take)
    assert begun == ["all"]


def wait(true, what):
    deadline = time.monotonic() + WITHIN
    while not true():
        assert time.monotonic() < deadline, f"{what} did not come within {WITHIN} s"
        time.sleep(0.02)


# Dask -----------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cluster():
    """A scheduler and three workers, each a process of its own, as a user starts them: its address."""
    pytest.importorskip("distributed")
    processes = []

    def start(*arguments):
        command = [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:], "--no-dashboard"]
        processes.append(subprocess.Popen(command, stderr=subprocess.DEVNULL))
        return processes[-1]

    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    try:
        start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port))
        for _ in range(3):
            start("dask_worker", address, "--nthreads", "1", "--no-nanny")
        yield address
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def free_port():
    import socket

    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def workers(address, count):
    from distributed import Client

    with Client(address, timeout=WITHIN) as client:
        client.wait_for_workers(count, timeout=WITHIN)


def kill_a_busy_worker(address):
    """Kill the worker with the most to do; returns the tasks that the scheduler had given it."""
    from distributed import Client

    with Client(address, timeout=WITHIN) as client:
        given = client.processing()
        busiest = max(given, key=lambda worker: len(given[worker]))
        os.kill(client.run(os.getpid)[busiest], signal.SIGKILL)
        return given[busiest]


def test_dask_gives_the_rows_of_processes_though_a_worker_is_killed(folder, capsys, cluster):
    """A worker is killed while it runs; the scheduler has others do again what it had and had done."""
    address = cluster
    workers(address, 3)
    long = runs.in_real_time(BASE, runs.sends(BASE, 20.0), 20.0)
    making.make(folder / "long", long)
    scenario = scenarios.prepare(read("long"), BASE)
    variations = [sweep.variation("body.mass=1:3:60")]
    table = sweep.Table(folder / "rows.csv", scenario, BASE, variations)
    left = []

    def runs_with_a_death(work, wanted):
        for count, outcome in enumerate(sweep.dask(address)(work, wanted)):
            if count == 10:
                left.extend(kill_a_busy_worker(address))
            yield outcome

    assert sweep.run(table, scenario, BASE, runs_with_a_death) == []
    assert left  # runs that were its own to do
    rows = rows_of(folder / "rows.csv")
    assert len(rows) == len({row["body.mass"] for row in rows}) == 60
    for row in rows[::10]:
        scene = BASE.changed({"body.mass": float(row["body.mass"])})
        assert row["state"] == resimulating.run(scenario, scene).state
    status, out, _ = call(capsys, "run", "--scene", "scene.yaml", "--vary", "body.mass=1:3:5", "--dask", address)
    assert status == 0 and "Rows: 5 of 5" in out
    by_dask = (folder / "run.csv").read_text().splitlines()
    assert call(capsys, *TWO, "body.mass=1:3:5", "--csv", "own.csv")[0] == 0
    assert sorted((folder / "own.csv").read_text().splitlines()) == sorted(by_dask)


def test_no_scheduler_there(folder, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(sweep, "CONNECT_WITHIN", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    status, _, err = call(capsys, "run", "--scene", "scene.yaml", "--vary", "body.mass=1,2", "--dask", address)
    assert status == 1 and f"--dask {address}: no scheduler answers there" in err


def test_without_distributed(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    status, _, err = call(capsys, "run", "--scene", "scene.yaml", "--vary", "body.mass=1,2", "--dask", "tcp://a:1")
    assert status == 1 and "pip install '.[dask]'" in err


def test_workers_of_another_version_are_refused(folder, capsys, cluster, monkeypatch):
    workers(cluster, 2)
    monkeypatch.setattr(sweep, "__version__", "9.9.9")
    status, _, err = call(capsys, "run", "--scene", "scene.yaml", "--vary", "body.mass=1,2", "--dask", cluster)
    assert status == 1 and "here is rigid_body_sim 9.9.9" in err and "install the same" in err


def test_digest_tells_bags_apart_and_nothing_else(folder):
    scenario = scenarios.prepare(read("run"), BASE)
    same = scenarios.prepare(read("run"), BASE)
    assert sweep._digest(scenario) == sweep._digest(same)
    same.commands.values[3, 2] = np.nextafter(same.commands.values[3, 2], 1.0)
    assert sweep._digest(scenario) != sweep._digest(same)
    assert sweep._digest(Scene(runs.SCENE).values) == sweep._digest(BASE.values)
