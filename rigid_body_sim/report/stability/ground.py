"""Contacts with the ground: the step size against the stiffness of one, and against the slip speed of its friction.

The body touches the ground with its centre of mass, so that it rotates freely, and the rest is a closed form. A bounce
is one swing of a damped oscillator, with the depth d'' = −ω² d − 2 ζ ω d', up to where its force is zero. Friction
slows a slide down by μ g until the slip speed s is reached, after which x = |u| / s obeys

    x' = −(μ g / s) (15 x − 10 x³ + 3 x⁵) / 8,

so that y = x² follows from a partial fraction, and the way from the integral of 1 / (15 − 10 x² + 3 x⁴).
"""

import math

import numpy as np

from ...effects.ground import Ground
from ...kernels.arrays import Floats, Vector
from ...simulation import Simulation
from ...values.body import Body
from ...values.state import State
from .free import turned
from .maps import Map
from .outcome import Case, Scale

BODY = Body(2.0, (0.1, 0.2, 0.25))
G = 9.80665  # m/s²
SPEED = 1.0  # m/s
SPIN = (3.0, -20.0, 5.0)  # rad/s
SCALE = Scale(0.1, 1.0, SPEED, 20.0)
FALL, BOUNCE = 0.0317, 0.1  # s: until it touches, and all
RATIO = 0.2  # of the damping to the critical
SLIDE, FRICTION = 0.3, 0.5  # s, and the coefficient: it comes to rest after 0.2 s
SOFT = 1e4  # N/m, of the ground on which it slides
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)


def bounce(quick: bool) -> Map[float]:
    """The map over the stiffness, as the frequency ω = √(k/m)."""
    return Map(
        "ground_stiffness",
        "Ground: contact stiffness against step size",
        f"A spinning body meets the ground at {SPEED:g} m/s after {1e3 * FALL:g} ms and bounces; damping ratio "
        f"{RATIO:g}, {BOUNCE:g} s are simulated. Truth: a closed form.",
        "contact frequency ω = √(k/m) [rad/s]",
        "step size [s]",
        (1e1, 1e2, 1e3, 1e4) if quick else [10.0 ** (0.5 * n) for n in range(2, 11)],
        _steps(BOUNCE, quick),
        bouncing,
        "ω h",
        lambda frequency, h: frequency * h,
    )


def slide(quick: bool) -> Map[float]:
    """The map over the slip speed."""
    return Map(
        "ground_friction",
        "Ground: slip speed of the friction against step size",
        f"A spinning body slides along the ground from {SPEED:g} m/s and comes to rest; friction {FRICTION:g}, "
        f"{SLIDE:g} s are simulated. Truth: a closed form.",
        "slip speed s [m/s]",
        "step size [s]",
        (1e-1, 1e-3, 1e-6) if quick else [10.0**-n for n in range(1, 7)],
        _steps(SLIDE, quick),
        sliding,
        "μ g h / s",
        lambda slip_speed, h: FRICTION * G * h / slip_speed,
    )


def _steps(span: float, quick: bool) -> list[float]:
    return [span / n for n in ((100, 10, 1) if quick else (1000, 300, 100, 30, 10, 3, 1))]


def bouncing(frequency: float, h: float) -> Case:
    """The run with a frequency [rad/s] and a step [s]."""
    start = State((0.0, 0.0, FALL * SPEED), velocity=(0.0, 0.0, -SPEED), angular_velocity=SPIN)
    k, c = BODY.mass * frequency**2, 2.0 * RATIO * BODY.mass * frequency
    ground = Ground(stiffness=k, damping=c, contacts=((0.0, 0.0, 0.0),))
    depth, rate = after_bounce(frequency, BOUNCE - FALL)
    return _case(start, ground, 0.0, BOUNCE, h, (0.0, 0.0, -depth), (0.0, 0.0, -rate))


def sliding(slip_speed: float, h: float) -> Case:
    """The run with a slip speed [m/s] and a step [s]."""
    sunk = -BODY.mass * G / SOFT
    start = State((0.0, 0.0, sunk), velocity=(SPEED, 0.0, 0.0), angular_velocity=SPIN)
    ground = Ground(stiffness=SOFT, damping=1e2, friction=FRICTION, slip_speed=slip_speed, contacts=((0.0, 0.0, 0.0),))
    way, speed = after_slide(slip_speed, SLIDE)
    return _case(start, ground, G, SLIDE, h, (way, 0.0, sunk), (speed, 0.0, 0.0))


def _case(
    start: State, ground: Ground, gravity: float, span: float, h: float, position: Vector, velocity: Vector
) -> Case:
    """The run of ``span`` [s] in steps of h, and where it ends."""
    steps = round(span / h)

    def simulation(integrator: str) -> Simulation:
        down = (0.0, 0.0, -gravity)
        return Simulation(BODY, start, rate=steps / span, gravity=down, ground=ground, integrator=integrator)

    def follow(made: Simulation) -> list[Floats]:
        made.step(steps)
        return [made.state.values[:13]]

    orientation, w_body = turned(BODY, SPIN, span)
    return Case(simulation, follow, np.concatenate((position, orientation, velocity, w_body))[None, :], SCALE)


def after_bounce(frequency: float, t: float) -> tuple[float, float]:
    """Depth [m] and its rate [m/s] t [s] after the touch-down."""
    b, w = RATIO * frequency, frequency * math.sqrt(1.0 - RATIO * RATIO)
    contact = (math.pi - math.atan2(2.0 * b * w, w * w - b * b)) / w
    touching = min(t, contact)
    decay = SPEED * math.exp(-b * touching)
    depth = decay * math.sin(w * touching) / w
    rate = decay * math.cos(w * touching) - b * depth
    return depth + rate * (t - touching), rate


def after_slide(slip_speed: float, t: float) -> tuple[float, float]:
    """Way [m] and speed [m/s] after t [s], by which the slip speed is reached."""
    a = FRICTION * G
    left = (t - (SPEED - slip_speed) / a) * a / (4.0 * slip_speed)
    low, high = -600.0, 0.0  # of ln y, which falls all the time
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _since(1.0) - _since(math.exp(middle)) > left else (low, middle)
    x = math.exp(0.5 * low)
    u = x + (1.0 - x) * 0.5 * (1.0 + _NODES)
    crept = 4.0 * slip_speed**2 / a * (1.0 - x) * float(_WEIGHTS @ (1.0 / (15.0 - 10.0 * u**2 + 3.0 * u**4)))
    return (SPEED**2 - slip_speed**2) / (2.0 * a) + crept, slip_speed * x


def _since(y: float) -> float:
    """∫ dy / (y (15 − 10 y + 3 y²))."""
    root = math.sqrt(80.0)
    rest = math.log(15.0 - 10.0 * y + 3.0 * y * y) / 30.0
    return math.log(y) / 15.0 - rest + 2.0 * math.atan((6.0 * y - 10.0) / root) / (3.0 * root)
