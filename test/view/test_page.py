"""The page: on this machine alone, refusals in sentences, and what a browser shows of a run."""

import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rigid_body_sim import Body, Simulation, State, Wrench, load_scene
from rigid_body_sim.scene.installed import installed_scene
from rigid_body_sim.view import page
from rigid_body_sim.view.look import of_values
from rigid_body_sim.view.moment import Levels, Recording, Wrenches
from rigid_body_sim.view.player import Player
from rigid_body_sim.view.stage import Stage

from ..report.browser_page import BrowserPage, differing, until

pytest.importorskip("viser")

SPIN = 1.0  # rad/s


@pytest.fixture
def opened(chromium, tmp_path):
    """A function that opens a page in the browser; all are closed at the end."""
    pages = []

    def opens(url):
        folder = tmp_path / f"browser{len(pages)}"
        folder.mkdir()
        pages.append(BrowserPage(chromium, folder, url))
        return pages[-1]

    yield opens
    for each in pages:
        each.close()


def trajectory():
    body = Body(mass=1.0, inertia=(0.3, 0.2, 0.1))
    simulation = Simulation(body, State(velocity=(0.1, 0.0, 0.0), angular_velocity=(0.0, 0.0, SPIN)), rate=100.0)
    simulation.set_wrench(Wrench(torque_body=(0.0, 0.0, 0.02)))
    return simulation.run(3.0, every=2)


def test_it_listens_on_this_machine_alone():
    stage = Stage("test", port=0)
    try:
        port = int(stage.url.rpartition(":")[2])
        listening = [line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
        assert [one for one in listening if one.endswith(f":{port:04X}")] == [f"0100007F:{port:04X}"]
        assert stage.server.request_share_url() is None
    finally:
        stage.close()


def test_a_port_that_is_taken_is_refused():
    with socket.socket() as taken:
        taken.bind((page.HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            page.ViewError, match=rf"nothing can listen on 127\.0\.0\.1, port {port} \(.*; give another"
        ):
            Stage("test", port=port)


def test_a_host_that_is_none_of_ours_is_refused():
    with pytest.raises(page.ViewError, match=r"nothing can listen on 192\.0\.2\.1, port 0 "):  # TEST-NET-1
        Stage("test", host="192.0.2.1", port=0)


def test_without_viser_it_says_what_to_install():
    code = "import sys; sys.modules['viser'] = None\nfrom rigid_body_sim.view import page\npage.open_page('a')"
    root = Path(__file__).parents[2]
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root, timeout=60).stderr
    assert told.rstrip().endswith("; pip install viser")


def test_a_run_is_seen_and_moves(opened):
    empty, shown = Stage("empty", port=0), trajectory().view()
    try:
        seen = opened(empty.url)
        seen.wait_for("empty")
        blank = seen.scene()
        seen.go(shown.url)
        seen.wait_for("of 3.000 s")
        until(lambda: differing(blank, seen.scene()) > 0.01, "body")  # measured 0.05
        until(lambda: differing(seen.scene(), seen.scene()) == 0.0, "picture that stands still")
        before = seen.scene()
        seen.click("Play")
        seen.wait_for("3.000 s of 3.000 s")
        assert differing(before, seen.scene()) > 0.003  # measured 0.02
    finally:
        empty.close()
        shown.close()


def test_a_run_is_saved_as_a_page_that_needs_nothing_else(opened, tmp_path):
    shown = trajectory().view()
    shown.save(tmp_path / "run.html")
    shown.close()
    text = (tmp_path / "run.html").read_text()
    assert not any(f'{what}="http' in text for what in ("src", "href"))
    seen = opened((tmp_path / "run.html").as_uri())
    until(lambda: len(np.unique(seen.scene())) > 100, "body")
    first = seen.scene()
    until(lambda: differing(first, seen.scene()) > 0.003, "motion")


def test_every_moment_of_a_run_with_actuators_is_shown():
    scene = load_scene(installed_scene("quadrotor"))
    look, n = of_values(scene.values), 5
    time, levels = np.arange(n) / 10.0, np.linspace(0.0, 1.0, n)[:, None] * np.ones(4)
    force = np.outer(time, [1.0, 0.0, 0.0])
    still = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    motion = Recording(time, force, still, Wrenches(time, force, -force), Levels(time, levels))
    player = Player({"drone": motion}, {"drone": look}, "test")
    try:
        body = player._stage._bodies["drone"]
        for at in time:
            player._show(at)
            assert body.place == tuple(motion.at(at).position)
        tip = body._levels[0]._arrow.points[0, 1] - look.actuators[0].position
        assert np.allclose(tip, [0.0, 0.0, look.extent])  # all that it can
        assert body._force._arrow.visible and np.allclose(
            body._force._arrow.points[0, 1], [2.0 * look.extent, 0.0, 0.0]
        )
        player._stage._switch("actuators", False)
        assert not body._levels[0]._arrow.visible
    finally:
        player._stage.close()


def test_a_notebook_shows_the_page():
    shown = trajectory().view()
    try:
        assert f'<iframe src="{shown.url}"' in shown._repr_html_()
        assert repr(shown) == f"Player({shown.url}: 3 s of body)"
    finally:
        shown.close()
