"""Each type against closed forms and published tables: magnetic field, ellipsoid, atmosphere, distance, pose."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rigid_body_sim import (
    Barometer,
    Body,
    Gnss,
    Ground,
    Magnetometer,
    Noise,
    PoseSensor,
    RangeFinder,
    Simulation,
    State,
)
from rigid_body_sim.sensors.barometer import pressure
from rigid_body_sim.values import rotation

pytestmark = pytest.mark.no_numba

ARM, TURN = (0.4, -0.25, 0.15), rotation.normalize((0.5, -0.3, 0.7, 0.4))
START = State((3.0, -2.0, 5.0), (0.9, 0.1, -0.3, 0.2), (1.0, -0.5, 0.3), (1.1, -2.0, 0.7))
PLACE = START.position + rotation.rotate(START.orientation, ARM)
AXES = rotation.multiply(START.orientation, TURN)


def sensed(sensor, state=START, **options):
    return Simulation(Body(1.0, (0.1, 0.2, 0.25)), state, sensors=[sensor], **options).sense(sensor.name)


# Magnetometer ---------------------------------------------------------------------------------------------------------


def test_a_uniform_field_is_shown_in_the_sensors_axes():
    field = (2.1e-5, 1e-6, -4.3e-5)
    shown = sensed(Magnetometer("mag", 0.0, ARM, TURN, field=field))
    assert_allclose(rotation.rotate(AXES, shown), field, rtol=0, atol=1e-19)  # measured: 2.1e-20


def test_a_dipole_is_the_gradient_of_its_potential():
    """B = −μ₀/4π ∇ (m · r / r³), by differences. Measured: 1e-16 T of 9e-9."""
    moment, at = np.array([10.0, -20.0, 40.0]), np.array([1.0, 2.0, -3.0])

    def potential(point):
        r = point - at
        return 1e-7 * moment @ r / np.linalg.norm(r) ** 3

    step = 1e-3
    expected = [-(potential(PLACE + e) - potential(PLACE - e)) / (2 * step) for e in step * np.eye(3)]
    uniform = np.array([1e-6, 2e-6, 3e-6])
    one = Magnetometer("mag", 0.0, ARM, TURN, field=uniform, dipole_moment=moment, dipole_position=at)
    found = rotation.rotate(AXES, sensed(one)) - uniform
    assert_allclose(found, expected, rtol=0, atol=1e-15)


def test_the_earths_dipole_at_its_equator():
    """30 µT to the north, of 7.7e22 A m² southwards, at the radius of 6371.2 km."""
    one = Magnetometer("mag", dipole_moment=(0.0, 0.0, -7.7e22))
    assert_allclose(sensed(one, State((6.3712e6, 0.0, 0.0))), (0.0, 0.0, 2.977e-5), rtol=1e-3, atol=1e-12)


def test_a_dipole_shows_nothing_where_it_is():
    assert_array_equal(sensed(Magnetometer("mag", dipole_moment=(1.0, 2.0, 3.0)), State()), np.zeros(3))


# GNSS -----------------------------------------------------------------------------------------------------------------

A, F = 6378137.0, 1 / 298.257223563  # of WGS-84
E2 = F * (2 - F)


def earth_centred(latitude, longitude, altitude):
    """Place [m] by the closed form, and the axes east, north and up there as rows."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    n = A / math.sqrt(1 - E2 * math.sin(phi) ** 2)
    place = ((n + altitude) * math.cos(phi) * math.cos(lam), (n + altitude) * math.cos(phi) * math.sin(lam))
    east = (-math.sin(lam), math.cos(lam), 0.0)
    up = (math.cos(phi) * math.cos(lam), math.cos(phi) * math.sin(lam), math.sin(phi))
    return np.array([*place, (n * (1 - E2) + altitude) * math.sin(phi)]), np.array([east, np.cross(up, east), up])


FAR = {  # from the origin [m], and how exact PROJ is there [m], whose way from earth-centred axes is Bowring's, once
    (0.0, 0.0, 0.0): 1e-8,  # measured: 1.9e-9, the round-off of earth-centred numbers
    (120.0, -340.0, 56.0): 1e-8,  # 3.7e-9
    (2e4, 3e4, 1e4): 3e-6,  # 1.5e-6
    (2e5, 3e5, 4e5): 4e-3,  # 2.0e-3
}


@pytest.mark.parametrize(
    "origin", [(47.397742, 8.545594, 488.0), (-33.9, 151.2, 5.0), (89.9999, -10.0, 0.0), (0, 180, 0)]
)
@pytest.mark.parametrize(("away", "within"), FAR.items())
def test_gnss_is_where_the_ellipsoid_says(origin, away, within):
    pytest.importorskip("pyproj")
    latitude, longitude, altitude = origin
    names = {"origin_latitude": latitude, "origin_longitude": longitude, "origin_altitude": altitude}
    gnss = Gnss("gnss", 0.0, ARM, **names)
    start = State(away, START.orientation)
    found, _ = earth_centred(*sensed(gnss, start))
    centre, axes = earth_centred(*origin)
    local = np.array(away) + rotation.rotate(START.orientation, ARM)
    assert_allclose(found, centre + local @ axes, rtol=0, atol=within)


def test_noise_of_gnss_is_one_of_metres():
    pytest.importorskip("pyproj")
    origin = {"origin_latitude": 47.4, "origin_longitude": 8.5}
    bare, off = (
        sensed(Gnss("gnss", **origin, horizontal=Noise(bias=bias), vertical=Noise(bias=(h,))), State())
        for bias, h in (((0.0, 0.0), 0.0), ((30.0, -40.0), 12.0))
    )
    moved = (earth_centred(*off)[0] - earth_centred(*bare)[0]) @ earth_centred(*bare)[1].T
    assert_allclose(moved, (30.0, -40.0, 12.0), rtol=0, atol=1e-8)


# Barometer ------------------------------------------------------------------------------------------------------------

RADIUS = 6356766.0
TABLE = {  # pressure [Pa] at geopotential altitudes [m]: U.S. Standard Atmosphere 1976 (NASA TM X-74335), as ISO 2533
    -2000.0: 127774.0,
    0.0: 101325.0,
    5000.0: 54019.9,
    11000.0: 22632.1,
    20000.0: 5474.89,
    32000.0: 868.019,
    47000.0: 110.906,
    51000.0: 66.9389,
    71000.0: 3.95642,
}


@pytest.mark.parametrize("altitude", TABLE)
def test_pressure_is_that_of_the_standard_atmosphere(altitude):
    """Measured: 2.8e-6 of it, what the table has digits for."""
    geometric = altitude / (1.0 - altitude / RADIUS)
    assert pressure(geometric) == pytest.approx(TABLE[altitude], rel=1e-5)


def test_pressure_at_a_geometric_altitude():
    """540.48 mb at 5000 m in the table by geometric altitude."""
    assert pressure(5000.0) == pytest.approx(54048.0, rel=1e-5)


def test_pressure_is_in_balance_with_the_weight_of_the_air_everywhere():
    """d ln p / dz = −g M / R T, of 180 to 321 K, in each layer and across their borders: there is no step in it."""
    heights = np.linspace(-4990.0, 100_000.0, 20_001)
    slope = np.diff(np.log([pressure(z) for z in heights.tolist()])) / np.diff(heights)
    assert slope.max() < -0.0341632 / 321.0  # measured: -1.067e-4, at 320 K
    assert slope.min() > -0.0341632 / 180.0  # measured: -1.694e-4, at 197 K and less gravity
    assert pressure(-5000.0) == pressure(-6000.0) == pressure(-1e7)


def test_a_barometer_is_as_high_as_where_it_is_mounted():
    assert sensed(Barometer("baro", 0.0, ARM, origin_altitude=400.0))[0] == pressure(400.0 + PLACE[2])


# Range ----------------------------------------------------------------------------------------------------------------


def down(**options):
    return RangeFinder("sonar", 0.0, ARM, rotation.from_axis_angle((0.0, 1.0, 0.0), math.pi / 2), **options)


def test_range_is_the_distance_along_its_axis_to_a_slope():
    ground = Ground(height=0.7, normal=(0.2, -0.3, 2.0))
    (found,) = sensed(down(range=100.0), ground=ground)
    axis = rotation.rotate(START.orientation, rotation.rotate(down(range=1.0).orientation, (1.0, 0.0, 0.0)))
    assert ground.unit_normal @ (PLACE + found * axis) == pytest.approx(0.7, abs=1e-14)


def test_range_beyond_its_limits_is_infinite():
    """REP-117."""
    level = State((0.0, 0.0, 5.0))
    assert sensed(down(range=6.0), level)[0] == pytest.approx(5.15, abs=1e-14)
    assert sensed(down(range=5.0), level)[0] == math.inf
    assert sensed(down(range=60.0, min_range=5.2), level)[0] == -math.inf
    upside_down = State((0.0, 0.0, 5.0), (0.0, 1.0, 0.0, 0.0))
    assert sensed(down(range=1e300, noise=Noise(1.0, (1.0,), 1.0, 0.1)), upside_down)[0] == math.inf


# Pose -----------------------------------------------------------------------------------------------------------------


def test_a_pose_is_that_of_the_markers():
    shown = sensed(PoseSensor("mocap", 0.0, ARM, TURN))
    assert_allclose(shown, (*PLACE, *AXES), rtol=0, atol=1e-15)


def test_a_pose_is_turned_on_about_the_sensors_axes():
    bias = np.array([0.1, -0.2, 0.3])
    shown = sensed(PoseSensor("mocap", 0.0, ARM, TURN, rotation=Noise(bias=bias)))
    turn = rotation.multiply(rotation.conjugate(AXES), shown[3:])
    axis, angle = rotation.to_axis_angle(turn)
    assert_allclose(angle * axis, bias, rtol=0, atol=1e-15)
