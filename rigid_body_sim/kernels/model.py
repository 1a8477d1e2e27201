"""The kernels' view of a body and its held wrench: one flat array, and the forces and torques that follow from it.

The array holds what is given (body, gravity, wrench in the axes in which it was given) and, from ``REDUCED`` on, what
``reduce_wrench`` makes of it: everything about the centre of mass and in principal axes.

A torque that is fixed in the world, or comes from a *lever* (a world-axes force at a body-fixed point, or a couple of a
body-fixed arm and a vector fixed in the world), is linear in the world axes seen from the body. So any
number of them is ``Σ_i A_i Rᵀ B_i`` with at most three *carried vectors* B_i (world) and matrices A_i (principal axes):
one carried vector when all are parallel, the three world axes otherwise.
"""

from .arrays import Floats
from .straight_line import straight_line
from .vectors import qrotate, qrotate_back

MASS = 0
MOMENTS = 1  # principal moments, 3
Q_BODY_PRINCIPAL = 4  # 4
CENTER_OF_MASS = 8  # body axes, 3
GRAVITY = 11  # world, 3
WRENCH = 14  # the twelve values of Wrench.values
N_LEVERS = 26
EULER = 27  # (I_y − I_z) / I_x and its cyclic companions, the coefficients of Euler's equation (theory 2.5.6), 3
RTOL = 30  # relative error that an error-controlled integrator may make in a step
MOST_MOMENTUM = 31  # kg m/s: up to this P no component of the velocity exceeds FASTEST
SAFE_ANGULAR_MOMENTUM = 32  # kg m²/s: up to this L no component of any velocity exceeds FASTEST, whatever the attitude
MOST_LOADS = 8
LOADS = 33  # of each kind of load (see effects): how many there are, where they begin, and their memory; 8 x 3
DRIVE = LOADS + 3 * MOST_LOADS  # where the row of all actuators begins (see kernels.drive); 0 where there are none
MEMORY = DRIVE + 1  # where begins what goes on from step to step: the end of the model, that of actuators first
INTERNAL = MEMORY + 1  # angular momentum of what spins inside, relative to the body, principal axes, a row of 4
INTERNAL_SLOPE = INTERNAL + 4  # its derivative [N m], 4
INSIDE = slice(INTERNAL, INTERNAL_SLOPE)
PARALLEL = INTERNAL_SLOPE + 4  # 1 when all levers have their vectors along that of the first
ALONG_FIRST = PARALLEL + 1  # what is carried, and arms, of the levers: one vector, that of the first; 9 + 27
ALONG_AXES = ALONG_FIRST + 36  # the same: the three world axes
GYRO = ALONG_AXES + 36  # 2 EULER as a row, x y z x (see kernels.series); so are the next
DIFFERENCES = GYRO + 4  # 2 (I_y − I_z) and so on
INVERSE = GYRO + 8  # 1 / I
MOMENT_ROW = GYRO + 12  # I
REDUCED = GYRO + 16
FORCE = REDUCED  # force in principal axes, 3
TORQUE = REDUCED + 3  # torque about the centre of mass in principal axes, 3
FORCE_WORLD = REDUCED + 6  # force in world axes, gravity included, 3
N_CARRIED = REDUCED + 9
ONLY_WORLD_TORQUE = REDUCED + 10  # 1 when all torque is fixed in the world: L is then a closed form
CARRIED = REDUCED + 11  # B_i, world, 3 x 3
ARMS = CARRIED + 9  # A_i, 3 x 9
# Each A_i as three rows, its diagonals (A_xx, A_yy, A_zz), (A_xy, A_yz, A_zx) and (A_xz, A_yx, A_zy); 3 x 3 x 4.
ARM_ROWS = ARMS + 27
FLUID = ARM_ROWS + 36  # where the velocity of the fluid around [m/s, world] begins: next to it, or in memory; and 3
LEVERS = FLUID + 4  # levers: arm (body axes), vector (world), and 1 for a force at a point, 0 for a couple; 7 each
LEVER_SIZE = 7

FASTEST = 1e307  # m/s, rad/s: a velocity beyond it may have no finite components in other axes


@straight_line
def to_principal(model: Floats, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """Body axes → principal axes."""
    i = Q_BODY_PRINCIPAL
    return qrotate_back(model[i], model[i + 1], model[i + 2], model[i + 3], vx, vy, vz)


@straight_line
def to_body(model: Floats, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """Principal axes → body axes."""
    i = Q_BODY_PRINCIPAL
    return qrotate(model[i], model[i + 1], model[i + 2], model[i + 3], vx, vy, vz)


@straight_line
def rates_principal(
    model: Floats, qw: float, qx: float, qy: float, qz: float, lx: float, ly: float, lz: float
) -> tuple[float, float, float]:
    """Angular velocity in principal axes from the angular momentum L in the world: ω = I₀⁻¹ Rᵀ L, theory (2.4.3)."""
    x, y, z = qrotate_back(qw, qx, qy, qz, lx, ly, lz)
    return x / model[MOMENTS], y / model[MOMENTS + 1], z / model[MOMENTS + 2]


@straight_line
def rates_of_whole(
    model: Floats, qw: float, qx: float, qy: float, qz: float, lx: float, ly: float, lz: float
) -> tuple[float, float, float]:
    """The same from that of the body with what spins inside: ω = I₀⁻¹ (Rᵀ L − h)."""
    x, y, z = qrotate_back(qw, qx, qy, qz, lx, ly, lz)
    i, m = INTERNAL, MOMENTS
    return (x - model[i]) / model[m], (y - model[i + 1]) / model[m + 1], (z - model[i + 2]) / model[m + 2]
