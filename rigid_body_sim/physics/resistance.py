"""What pushes back: drag and tethers. Their forces follow from the motion, so no polynomial in time holds them.

Drag acts at the centre of mass, component by component in body axes:

    F_i = −(linear_i + quadratic_i |v_i|) v_i        τ_i = −(angular_linear_i + angular_quadratic_i |ω_i|) ω_i

(the diagonal damping matrices of Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, section 6.4).
A tether is a spring and damper between a body-fixed point and a point fixed in the world.

``drag_load`` and ``tether_load`` give force and torque in world axes; ``drag_change`` and ``tether_change`` their exact
derivatives along a change of the state, from which implicit integrators build the Jacobian.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .rotation import cross, qrotate, qrotate_back
from .wrench import ZERO, three_finite

TETHER_SIZE = 10  # body point 3 (from the centre of mass), anchor 3, rest length, stiffness, damping, slack


@dataclass(frozen=True)
class Drag:
    """Coefficients along the body axes: linear [N s/m], quadratic [N s²/m²], angular [N m s/rad], [N m s²/rad²].

    Raises ValueError for a coefficient that is negative or not finite: drag takes energy out.
    """

    linear: Sequence[float] = ZERO
    quadratic: Sequence[float] = ZERO
    angular_linear: Sequence[float] = ZERO
    angular_quadratic: Sequence[float] = ZERO

    def __post_init__(self) -> None:
        for name in ("linear", "quadratic", "angular_linear", "angular_quadratic"):
            values = three_finite(getattr(self, name), f"drag {name}")
            if min(values) < 0.0:
                raise ValueError(
                    f"drag {name} {values} has a negative entry; drag takes energy out, so none may be below 0"
                )
            object.__setattr__(self, name, values)

    @property
    def values(self) -> tuple[float, ...]:
        """The twelve coefficients in the order of the fields."""
        return (*self.linear, *self.quadratic, *self.angular_linear, *self.angular_quadratic)


NO_DRAG = Drag()


@dataclass(frozen=True)
class Tether:
    """A spring and damper between a body point [m, body axes from the body frame's origin] and an anchor [m, world].

    The tension is stiffness [N/m] times what the length exceeds rest_length [m], plus damping [N s/m] times the rate of
    lengthening. With ``slack`` it pulls only while stretched, and never pushes. Raises ValueError for a value that is
    negative or not finite.
    """

    body_point: Sequence[float] = ZERO
    anchor: Sequence[float] = ZERO
    rest_length: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    slack: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_point", three_finite(self.body_point, "tether body_point"))
        object.__setattr__(self, "anchor", three_finite(self.anchor, "tether anchor"))
        for name in ("rest_length", "stiffness", "damping"):
            value = float(getattr(self, name))
            if not 0.0 <= value < math.inf:
                raise ValueError(f"tether {name} {value:g} is not a finite number of at least 0")
            object.__setattr__(self, name, value)

    def row(self, center_of_mass: NDArray) -> NDArray:
        """The numbers that the kernels need, shape (10,): the point is taken from the centre of mass."""
        arm = np.subtract(self.body_point, center_of_mass)
        return np.array((*arm, *self.anchor, self.rest_length, self.stiffness, self.damping, self.slack), float)


@kernel
def drag_load(model, d, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz):
    """Force and torque of the drag at ``model[d]``, world axes, from velocity and rates there; q: body → world."""
    ux, uy, uz = qrotate_back(qw, qx, qy, qz, vx, vy, vz)
    sx, sy, sz = qrotate_back(qw, qx, qy, qz, wx, wy, wz)
    fx, fy, fz = qrotate(
        qw,
        qx,
        qy,
        qz,
        -(model[d] + model[d + 3] * abs(ux)) * ux,
        -(model[d + 1] + model[d + 4] * abs(uy)) * uy,
        -(model[d + 2] + model[d + 5] * abs(uz)) * uz,
    )
    tx, ty, tz = qrotate(
        qw,
        qx,
        qy,
        qz,
        -(model[d + 6] + model[d + 9] * abs(sx)) * sx,
        -(model[d + 7] + model[d + 10] * abs(sy)) * sy,
        -(model[d + 8] + model[d + 11] * abs(sz)) * sz,
    )
    return fx, fy, fz, tx, ty, tz


@kernel
def damp(model, d, qw, qx, qy, qz, ux, uy, uz, cx, cy, cz):
    """−R diag(∂F/∂u) Rᵀ c at the velocity u, for coefficients at d (linear) and d + 3 (quadratic)."""
    sx, sy, sz = qrotate_back(qw, qx, qy, qz, ux, uy, uz)
    bx, by, bz = qrotate_back(qw, qx, qy, qz, cx, cy, cz)
    return qrotate(
        qw,
        qx,
        qy,
        qz,
        -(model[d] + 2.0 * model[d + 3] * abs(sx)) * bx,
        -(model[d + 1] + 2.0 * model[d + 4] * abs(sy)) * by,
        -(model[d + 2] + 2.0 * model[d + 5] * abs(sz)) * bz,
    )


@kernel
def tether_stretch(model, k, x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz):
    """Unit vector from the anchor to the body point, length [m], tension [N] of the tether at ``model[k]``.

    All in world axes: centre of mass (x, y, z), arm r to the point, velocity v of the centre of mass, rates w. At
    length zero there is no direction and no force.
    """
    nx, ny, nz = x + rx - model[k + 3], y + ry - model[k + 4], z + rz - model[k + 5]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    nx, ny, nz = nx / length, ny / length, nz / length
    ux, uy, uz = cross(wx, wy, wz, rx, ry, rz)
    rate = nx * (vx + ux) + ny * (vy + uy) + nz * (vz + uz)
    stretch = length - model[k + 6]
    tension = model[k + 7] * stretch + model[k + 8] * rate
    if model[k + 9] != 0.0 and (stretch <= 0.0 or tension <= 0.0):
        tension = 0.0
    return nx, ny, nz, length, tension


@kernel
def tether_load(model, k, qw, qx, qy, qz, x, y, z, vx, vy, vz, wx, wy, wz):
    """Force and torque about the centre of mass of the tether at ``model[k]``, world axes; q: body → world."""
    rx, ry, rz = qrotate(qw, qx, qy, qz, model[k], model[k + 1], model[k + 2])
    nx, ny, nz, _, tension = tether_stretch(model, k, x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz)
    fx, fy, fz = -tension * nx, -tension * ny, -tension * nz
    tx, ty, tz = cross(rx, ry, rz, fx, fy, fz)
    return fx, fy, fz, tx, ty, tz


@kernel
def tether_change(
    model, k, qw, qx, qy, qz, x, y, z, vx, vy, vz, wx, wy, wz, ax, ay, az, bx, by, bz, cx, cy, cz, ex, ey, ez
):
    """Change of a tether's force and torque for changes of position a, attitude b, velocity c and rates e (world axes).

    The attitude changes by the small rotation b: δr = b × r.
    """
    rx, ry, rz = qrotate(qw, qx, qy, qz, model[k], model[k + 1], model[k + 2])
    nx, ny, nz, length, tension = tether_stretch(model, k, x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz)
    if tension == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    drx, dry, drz = cross(bx, by, bz, rx, ry, rz)
    dpx, dpy, dpz = ax + drx, ay + dry, az + drz
    along = nx * dpx + ny * dpy + nz * dpz
    dnx, dny, dnz = (dpx - along * nx) / length, (dpy - along * ny) / length, (dpz - along * nz) / length
    ux, uy, uz = cross(wx, wy, wz, rx, ry, rz)
    px, py, pz = cross(ex, ey, ez, rx, ry, rz)
    sx, sy, sz = cross(wx, wy, wz, drx, dry, drz)
    rate = dnx * (vx + ux) + dny * (vy + uy) + dnz * (vz + uz)
    rate += nx * (cx + px + sx) + ny * (cy + py + sy) + nz * (cz + pz + sz)
    change = model[k + 7] * along + model[k + 8] * rate
    fx, fy, fz = -change * nx - tension * dnx, -change * ny - tension * dny, -change * nz - tension * dnz
    tx, ty, tz = cross(rx, ry, rz, fx, fy, fz)
    gx, gy, gz = cross(drx, dry, drz, -tension * nx, -tension * ny, -tension * nz)
    return fx, fy, fz, tx + gx, ty + gy, tz + gz
