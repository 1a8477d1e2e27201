"""What pushes back: drag and tethers. Their forces follow from the motion, so no polynomial in time holds them.

Drag acts at the centre of mass, component by component in body axes:

    F_i = −(linear_i + quadratic_i |v_i|) v_i        τ_i = −(angular_linear_i + angular_quadratic_i |ω_i|) ω_i

(the diagonal damping matrices of Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, section 6.4).
A tether is a spring and damper between a body-fixed point and a point fixed in the world.

``drag_load`` and ``tether_load`` give force and torque in world axes; ``add_drag_jacobian`` and ``add_tether_jacobian``
their exact derivatives, from which kernels.motion builds the Jacobian.
"""

import math

from .arrays import Floats
from .compiled import kernel
from .vectors import cross, qrotate, qrotate_back, unit_vector

TETHER_SIZE = 10  # body point 3 (from the centre of mass), anchor 3, rest length, stiffness, damping, slack


@kernel
def drag_load(
    model: Floats,
    d: int,
    qw: float,
    qx: float,
    qy: float,
    qz: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
) -> tuple[float, float, float, float, float, float]:
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
def add_to_row(
    out: Floats,
    row: int,
    s: float,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
    cx: float,
    cy: float,
    cz: float,
    wx: float,
    wy: float,
    wz: float,
) -> None:
    """out[row:row + 12] += s (a, b, c, w)."""
    out[row], out[row + 1], out[row + 2] = out[row] + s * ax, out[row + 1] + s * ay, out[row + 2] + s * az
    out[row + 3], out[row + 4], out[row + 5] = out[row + 3] + s * bx, out[row + 4] + s * by, out[row + 5] + s * bz
    out[row + 6], out[row + 7], out[row + 8] = out[row + 6] + s * cx, out[row + 7] + s * cy, out[row + 8] + s * cz
    out[row + 9], out[row + 10], out[row + 11] = out[row + 9] + s * wx, out[row + 10] + s * wy, out[row + 11] + s * wz


@kernel
def add_turning(out: Floats, o: int, ax: float, ay: float, az: float) -> None:
    """Three rows of 12 at out[o:]: a vector a that turns with the body changes by b × a with the small rotation b."""
    out[o + 4], out[o + 5] = out[o + 4] + az, out[o + 5] - ay
    out[o + 15], out[o + 17] = out[o + 15] - az, out[o + 17] + ax
    out[o + 27], out[o + 28] = out[o + 27] + ay, out[o + 28] - ax


@kernel
def add_drag_jacobian(
    model: Floats,
    d: int,
    qw: float,
    qx: float,
    qy: float,
    qz: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
    out: Floats,
    o: int,
) -> None:
    """Add the derivative of ``drag_load`` to six rows of 12 at out[o:]: of force, then torque.

    Columns are changes of position, attitude (the small rotation b), velocity and rates, in world axes. Along each body
    axis n the force is −f(n · v) n, and n turns with the body.
    """
    fx, fy, fz, tx, ty, tz = drag_load(model, d, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz)
    add_turning(out, o, fx, fy, fz)
    add_turning(out, o + 36, tx, ty, tz)
    for k in range(3):
        nx, ny, nz = qrotate(qw, qx, qy, qz, *unit_vector(k))
        f = model[d + k] + 2.0 * model[d + 3 + k] * abs(nx * vx + ny * vy + nz * vz)
        t = model[d + 6 + k] + 2.0 * model[d + 9 + k] * abs(nx * wx + ny * wy + nz * wz)
        ax, ay, az = cross(nx, ny, nz, vx, vy, vz)
        bx, by, bz = cross(nx, ny, nz, wx, wy, wz)
        for i in range(3):
            n = nx if i == 0 else ny if i == 1 else nz
            add_to_row(out, o + 12 * i, -f * n, 0.0, 0.0, 0.0, ax, ay, az, nx, ny, nz, 0.0, 0.0, 0.0)
            add_to_row(out, o + 36 + 12 * i, -t * n, 0.0, 0.0, 0.0, bx, by, bz, 0.0, 0.0, 0.0, nx, ny, nz)


@kernel
def tether_direction(model: Floats, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Unit vector from the anchor of the tether at ``model[k]`` to (x, y, z); zero where that is the anchor itself."""
    nx, ny, nz = x - model[k + 3], y - model[k + 4], z - model[k + 5]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return nx / length, ny / length, nz / length


@kernel
def tether_stretch(
    model: Floats,
    k: int,
    x: float,
    y: float,
    z: float,
    rx: float,
    ry: float,
    rz: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
) -> tuple[float, float, float, float, float]:
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
def tether_load(
    model: Floats,
    k: int,
    qw: float,
    qx: float,
    qy: float,
    qz: float,
    x: float,
    y: float,
    z: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
) -> tuple[float, float, float, float, float, float]:
    """Force and torque about the centre of mass of the tether at ``model[k]``, world axes; q: body → world."""
    rx, ry, rz = qrotate(qw, qx, qy, qz, model[k], model[k + 1], model[k + 2])
    nx, ny, nz, _, tension = tether_stretch(model, k, x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz)
    fx, fy, fz = -tension * nx, -tension * ny, -tension * nz
    tx, ty, tz = cross(rx, ry, rz, fx, fy, fz)
    return fx, fy, fz, tx, ty, tz


@kernel
def tether_stiffness(
    model: Floats,
    k: int,
    taut: bool,
    x: float,
    y: float,
    z: float,
    rx: float,
    ry: float,
    rz: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """What a tether's force changes with: F, n, g and s such that δF = −s δp − n (g · δp) − damping n (n · δu).

    p is where the body point is and u its velocity; n is the unit vector from the anchor. All zero where the tether
    does not pull, unless ``taut``.
    """
    nx, ny, nz, length, tension = tether_stretch(model, k, x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz)
    if model[k + 9] != 0.0 and tension <= 0.0 and not taut:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if length == 0.0:  # without a direction only a spring of no rest length is smooth: it pulls alike all round
        s = model[k + 7] if model[k + 6] == 0.0 else 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, s
    s = tension / length
    ux, uy, uz = cross(wx, wy, wz, rx, ry, rz)
    ux, uy, uz = ux + vx, uy + vy, uz + vz
    across = model[k + 8] / length
    along = model[k + 7] - s - across * (nx * ux + ny * uy + nz * uz)
    gx, gy, gz = along * nx + across * ux, along * ny + across * uy, along * nz + across * uz
    return tension, nx, ny, nz, gx, gy, gz, s


@kernel
def add_tether_jacobian(
    model: Floats,
    k: int,
    taut: bool,
    qw: float,
    qx: float,
    qy: float,
    qz: float,
    x: float,
    y: float,
    z: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
    out: Floats,
    o: int,
) -> None:
    """Add the derivative of ``tether_load`` to six rows of 12 at out[o:]; columns as in ``add_drag_jacobian``.

    The arm r turns with the body, so the point moves by δp = δx + b × r and δu = δv + δω × r + ω × (b × r), and with
    τ = r × F: δτ = r × δF + (b × r) × F. ``taut`` counts the tether as pulling even where it is slack.
    """
    rx, ry, rz = qrotate(qw, qx, qy, qz, model[k], model[k + 1], model[k + 2])
    tension, nx, ny, nz, gx, gy, gz, s = tether_stiffness(model, k, taut, x, y, z, rx, ry, rz, vx, vy, vz, wx, wy, wz)
    fx, fy, fz = -tension * nx, -tension * ny, -tension * nz
    dx, dy, dz = model[k + 8] * nx, model[k + 8] * ny, model[k + 8] * nz
    hx, hy, hz = cross(dx, dy, dz, wx, wy, wz)
    hx, hy, hz = cross(rx, ry, rz, gx + hx, gy + hy, gz + hz)
    ex, ey, ez = cross(rx, ry, rz, dx, dy, dz)
    moment = fx * rx + fy * ry + fz * rz
    for i in range(3):
        ix, iy, iz = unit_vector(i)
        jx, jy, jz = cross(rx, ry, rz, ix, iy, iz)
        n = nx * ix + ny * iy + nz * iz
        r = rx * ix + ry * iy + rz * iz
        px, py, pz = s * jx, s * jy, s * jz
        ax, ay, az = s * ix + n * gx, s * iy + n * gy, s * iz + n * gz
        bx, by, bz = px + n * hx, py + n * hy, pz + n * hz
        cx, cy, cz = n * dx, n * dy, n * dz
        mx, my, mz = n * ex, n * ey, n * ez
        add_to_row(out, o + 12 * i, -1.0, ax, ay, az, bx, by, bz, cx, cy, cz, mx, my, mz)
        add_to_row(out, o + 36, -jx, ax, ay, az, bx, by, bz, cx, cy, cz, mx, my, mz)
        add_to_row(out, o + 48, -jy, ax, ay, az, bx, by, bz, cx, cy, cz, mx, my, mz)
        add_to_row(out, o + 60, -jz, ax, ay, az, bx, by, bz, cx, cy, cz, mx, my, mz)
        t = o + 36 + 12 * i + 3
        out[t] += r * fx - moment * ix
        out[t + 1] += r * fy - moment * iy
        out[t + 2] += r * fz - moment * iz
