"""
Solve the report's problems with mpmath to more than 30 digits and write report.json.

Run `python -m bench.reference.make_report` (some minutes). Formulation and method are those of
make_reference.py. In all problems the centre of mass is the body frame's origin and the body axes are principal axes,
so that no simulator has to be told about another frame.
"""

import random

from . import DATA
from .make_reference import problem, wrench, write

FILE = DATA / "report.json"
GRAVITY = (0.0, 0.0, -9.80665)
AT_REST = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def tumble():
    return problem(
        "Torque-free tumble about the unstable middle axis, 100 s.",
        mass=2.0,
        inertia=(0.1, 0.2, 0.3, 0.0, 0.0, 0.0),
        initial=((1.0, -2.0, 0.5), (0.5, -0.1, 0.7, 0.5), (0.3, 0.1, -0.2), (0.01, 3.0, 0.02)),
        wrenches=[wrench("100")],
        times=("100",),
    )


def symmetric_top():
    return problem(
        "Heavy symmetric top at 20 rad/s, 20 s: a constant force in world axes at a point on the axis of the body.",
        mass=0.5,
        inertia=(0.002, 0.002, 0.003, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.9, 0.3, 0.1, -0.3), (0.0, 0.0, 0.0), (0.5, -0.3, 20.0)),
        wrenches=[wrench("20", points=[((0.0, 0.0, 0.05), (0.0, 0.0, -4.905))])],
        times=("20",),
    )


def asymmetric_top():
    return problem(
        "Heavy top with three different moments at 20 rad/s, 10 s: a constant force in world axes at a body-fixed "
        "point.",
        mass=0.5,
        inertia=(0.0018, 0.0024, 0.003, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.9, 0.3, 0.1, -0.3), (0.1, 0.0, 0.2), (2.0, -1.0, 20.0)),
        wrenches=[wrench("10", points=[((0.003, -0.002, 0.02), (0.0, 0.0, -4.905))])],
        times=("10",),
    )


def body_wrench():
    return problem(
        "Constant force and torque that turn with the body, 60 s.",
        mass=1.5,
        inertia=(0.12, 0.2, 0.27, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 1.0), (0.8, 0.4, -0.4, 0.2), (0.5, 0.0, -0.1), (1.0, -0.5, 2.0)),
        wrenches=[wrench("60", force_body=(0.7, -0.3, 1.1), torque_body=(0.01, -0.02, 0.015))],
        times=("60",),
    )


def commands():
    rng = random.Random(100)

    def vector(size):
        return [round(size * (2.0 * rng.random() - 1.0), 3) for _ in range(3)]

    held = [
        wrench(f"{k / 100:g}", force_body=[*vector(2.0)[:2], 14.7 + vector(4.0)[2]], torque_body=vector(0.3))
        for k in range(1, 501)
    ]
    return problem(
        "A drone's force and torque, in body axes, new ones at random 100 times a second, 5 s.",
        mass=1.5,
        inertia=(0.015, 0.018, 0.03, 0.0, 0.0, 0.0),
        gravity=GRAVITY,
        initial=((0.0, 0.0, 10.0), (1.0, 0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.3, -0.2, 0.5)),
        wrenches=held,
        times=("5",),
    )


def fast_spin():
    return problem(
        "Needle with moments of inertia 1 : 1000 at 500 rad/s under a small torque in body axes, 2 s.",
        mass=1.0,
        inertia=(0.001, 1.0, 1.0005, 0.0, 0.0, 0.0),
        initial=((0.0, 0.0, 0.0), (0.7, 0.1, -0.5, 0.5), (1.0, 0.0, 0.0), (300.0, 280.0, -290.0)),
        wrenches=[wrench("2", torque_body=(0.002, 0.03, -0.05))],
        times=("2",),
    )


def free_fall():
    position, orientation, _, rates = AT_REST
    return problem(
        "Free fall of a thrown body that does not turn, 10 s.",
        mass=1.5,
        inertia=(0.12, 0.2, 0.27, 0.0, 0.0, 0.0),
        gravity=GRAVITY,
        initial=(position, orientation, (3.0, -1.0, 20.0), rates),
        wrenches=[wrench("10")],
        times=("10",),
    )


def damped_vehicle():
    thrust = wrench(
        "10", force_body=(25.0, 6.0, -4.0), torque_body=(0.3, -0.4, 0.6), points=[((0.0, 0.0, 0.02), (0.0, 0.0, 114.8))]
    )
    return problem(
        "Underwater vehicle with thrusters on, buoyancy above the centre of mass, linear and quadratic drag, 10 s.",
        mass=11.5,
        inertia=(0.16, 0.19, 0.23, 0.0, 0.0, 0.0),
        gravity=GRAVITY,
        initial=((0.0, 0.0, -10.0), (0.9, 0.3, -0.3, 0.1), (0.2, -0.1, 0.1), (1.0, -0.8, 1.5)),
        wrenches=[thrust],
        times=("10",),
        drag={
            "linear": (4.03, 6.22, 5.18),
            "quadratic": (18.18, 21.66, 36.99),
            "angular_linear": (0.07, 0.07, 0.07),
            "angular_quadratic": (1.55, 1.55, 1.55),
        },
    )


MAKERS = (tumble, symmetric_top, asymmetric_top, body_wrench, commands, fast_spin, free_fall, damped_vehicle)
PROBLEMS = {maker.__name__: maker() for maker in MAKERS}

if __name__ == "__main__":
    write(PROBLEMS, FILE, "make_report.py")
