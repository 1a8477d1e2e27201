"""Who runs while a kernel advances a simulation."""

import threading

import pytest

from rigid_body_sim import Body, Simulation, State, Tether

pytest.importorskip("numba")  # Python's own threads always take turns

BODY = Body(mass=2.0, inertia=(0.1, 0.2, 0.25))
STATE = State(position=(1.0, 0.0, 0.0), angular_velocity=(1.0, 2.0, 3.0))


def is_seen_moving(simulation, n):
    """Whether this thread sees the body on its way while another one calls for n steps, once."""
    seen = {simulation.pose}
    thread = threading.Thread(target=simulation.step, args=(n,))
    thread.start()
    while thread.is_alive():
        seen.add(simulation.pose)
    return len(seen | {simulation.pose}) > 2  # more than where it began and where it ended


def test_other_threads_run_during_many_steps():
    assert is_seen_moving(Simulation(BODY, STATE, integrator="rk4"), 200_000)


def test_other_threads_run_during_a_single_step_of_many_sub_steps():
    tether = Tether(stiffness=1e6, rest_length=0.1, slack=False)
    assert is_seen_moving(Simulation(BODY, STATE, rate=2.0, integrator="rosenbrock", tethers=[tether]), 1)
