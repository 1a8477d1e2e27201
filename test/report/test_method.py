"""What is measured of a method, with a clock that the test winds."""

import pytest

from rigid_body_sim.report import method
from rigid_body_sim.report.method import LIBRARY, RTOL, Method
from rigid_body_sim.report.problems import End, problem


class _Run:
    """Takes 3 s for a run, and knows the end."""

    compile_seconds = 0.25

    def __init__(self, clock, truth):
        self._clock, self._truth = clock, truth

    def restart(self):
        self._clock.append(self._clock[-1] + 10**9)

    def advance(self):
        self._clock.append(self._clock[-1] + 3 * 10**9)
        return End(*(self._truth[name] for name in ("position", "orientation", "velocity", "angular_velocity")))

    def counts(self):
        return {"steps": 1, "rhs": None}


@pytest.mark.parametrize("bodies", [1, 8])
def test_the_time_is_that_of_one_body_for_a_second(monkeypatch, bodies):
    clock, tumble = [0], problem("tumble")
    monkeypatch.setattr(method.time, "process_time_ns", lambda: clock[-1])
    one = Method("it", LIBRARY, lambda p: RTOL, lambda p, quick: [1.0], lambda p, v: _Run(clock, p.end), bodies=bodies)
    found = method.measure(one, tumble, False)
    (point,) = found["points"]
    assert point["cpu"] == pytest.approx(3.0 / tumble.duration / bodies) and point["compile_seconds"] == 0.25
    assert found["bodies"] == bodies and point["error"] < 1e-30
