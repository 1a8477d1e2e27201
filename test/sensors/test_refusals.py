"""What cannot be is refused by a sentence that says what was given, and what would be right."""

import subprocess
import sys

import pytest

from rigid_body_sim import Body, Ensemble, Gnss, Imu, Magnetometer, Noise, RangeFinder, Scene, Simulation

pytestmark = pytest.mark.no_numba

IMU = {"sensors.imu.type": "imu"}
OF_SCENES = {
    "unknown type": (
        {"sensors.imu.type": "imuu"},
        r"sensors\.imu\.type = 'imuu': is not allowed; give one of imu, magnetometer, .*; did you mean imu\?",
    ),
    "no type": ({"sensors.imu.rate": 10.0}, r"sensors\.imu\.rate is given without sensors\.imu\.type"),
    "negative density": (
        {**IMU, "sensors.imu.gyroscope.noise_density": -1.0},
        r"gyroscope\.noise_density = -1\.0: is out of range; .* at least 0",
    ),
    "negative walk": ({**IMU, "sensors.imu.accelerometer.random_walk": -1e-9}, "is out of range; .* at least 0"),
    "rate that does not divide": (
        {**IMU, "sensors.imu.rate": 300.0},
        r"parameter sensors\.imu: rate 300 Hz does not divide the step rate 1000 Hz .* that does is 333\.333",
    ),
    "rate above that of the steps": ({**IMU, "sensors.imu.rate": 2000.0}, "the nearest that does is 1000"),
    "another type's parameter": (
        {**IMU, "sensors.imu.field": [0.0, 0.0, 1.0]},
        r"parameter sensors\.imu\.field: a sensor of type imu has no such parameter, but gyroscope\.noise_density, .*",
    ),
    "no name of a topic": (
        {"sensors.i-mu.type": "imu"},
        r"parameter sensors\.i-mu: its name is that of a topic of ROS; give one of letters, digits",
    ),
    "two underscores": ({"sensors.i__mu.type": "imu"}, "its name is that of a topic of ROS"),
    "an output's topic": (
        {**IMU, "outputs": ["imu"]},
        r"parameter sensors\.imu: the node already has a topic imu; give the sensor another name",
    ),
    "a command's topic": ({**IMU, "wrench.topics": ["/imu"]}, "the node already has a topic imu"),
    "pose's topic": ({"sensors.pose.type": "pose"}, "the node already has a topic pose"),
    "bias of another length": (
        {**IMU, "sensors.imu.gyroscope.bias": [0.1, 0.2]},
        r"parameter sensors\.imu: gyroscope\.bias \[0\.1, 0\.2\] has 2 entries; give 3, or none",
    ),
    "no range": ({"sensors.sonar.type": "range"}, r"parameter sensors\.sonar: range 0 m is not above min_range 0 m"),
    "endless delay": ({**IMU, "sensors.imu.delay": 1e6}, "delay 1e[+]06 s is more than 100000 steps of 0.001 s"),
    "no direction": (
        {**IMU, **{f"sensors.imu.orientation.{part}": 0.0 for part in "wxyz"}},
        r"parameter sensors\.imu\.orientation: ",
    ),
    "quaternion in a row": (
        {**IMU, "sensors.imu.orientation": [1.0, 0.0, 0.0, 0.0]},
        "does not tell which number is w",
    ),
    "misspelt": ({**IMU, "sensors.imu.gyroscope.noise": 1.0}, r"sensors\.imu\.gyroscope\.noise is not known"),
}


@pytest.mark.parametrize(("given", "said"), OF_SCENES.values(), ids=OF_SCENES)
def test_scene_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        Scene(given)


def test_a_sensor_named_imu_and_the_output_of_that_name_do_not_meet_unless_both_are_asked_for():
    assert [one.name for one in Scene(IMU).sensors()] == ["imu"]
    assert Scene({"outputs": ["imu"]}).sensors() == ()


OF_PYTHON = {
    "negative density": (
        lambda: Imu("imu", gyroscope=Noise(-1.0)),
        "sensor 'imu': gyroscope.noise_density -1 is not a",
    ),
    "infinite walk": (lambda: Imu("imu", gyroscope=Noise(0.0, (), float("inf"))), "gyroscope.random_walk inf is not a"),
    "rate": (lambda: Imu("imu", float("nan")), "sensor 'imu': rate nan is not a finite number of at least 0"),
    "delay": (lambda: Imu("imu", delay=-1.0), "sensor 'imu': delay -1 is not a finite number of at least 0"),
    "name": (lambda: Imu(""), "sensor '': its name is that of a topic of ROS"),
    "seed": (lambda: Imu("imu", seed=-1), "sensor 'imu': seed -1 is not a whole number of at least 0"),
    "seed that is a bool": (lambda: Imu("imu", seed=True), "seed True is not a whole number"),
    "position": (lambda: Imu("imu", 0.0, (1.0, 2.0)), r"sensor 'imu': position \(1\.0, 2\.0\)|position \[1\.0, 2\.0\]"),
    "field": (lambda: Magnetometer("mag", field=(1.0,)), "sensor 'mag': field .* must be three finite numbers"),
    "latitude": (lambda: Gnss("gnss", origin_latitude=91.0), "origin_latitude 91 is more than 90; give degrees"),
    "least latitude": (lambda: Gnss("gnss", origin_latitude=-91.0), "origin_latitude -91 is not a finite number of at"),
    "radiation": (lambda: RangeFinder("r", range=1.0, radiation="x"), "radiation 'x' is not known; give ultrasound or"),
    "range of a range": (
        lambda: RangeFinder("r", range=1.0, noise=Noise(range=2.0)),
        "sensor 'r': noise has no range; leave it out",
    ),
}


@pytest.mark.parametrize(("make", "said"), OF_PYTHON.values(), ids=OF_PYTHON)
def test_sensor_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


BODY = Body(1.0, (0.1, 0.2, 0.25))


def test_simulation_refuses_what_does_not_go_with_it():
    with pytest.raises(ValueError, match="sensor 'imu': rate 300 Hz does not divide the step rate 1000 Hz"):
        Simulation(BODY, sensors=[Imu("imu", 300.0)])
    with pytest.raises(ValueError, match="sensors: the name 'imu' is there twice; give each its own"):
        Simulation(BODY, sensors=[Imu("imu"), Imu("imu")])
    with pytest.raises(TypeError, match="sensors: 'imu' is no sensor; give a sequence of them"):
        Simulation(BODY, sensors=["imu"])
    with pytest.raises(TypeError, match=r"gyroscope 0\.1 is no Noise; give one"):
        Imu("imu", gyroscope=0.1)


def test_a_sensor_that_is_not_there_is_named_with_those_that_are():
    sim = Simulation(BODY, sensors=[Imu("imu")])
    run = sim.run(steps=3)
    for sense in (sim.sense, run.sense, Ensemble(1.0, BODY.inertia, sensors=[Imu("imu")]).sense):
        with pytest.raises(ValueError, match="there is no sensor 'gyro'; there are imu"):
            sense("gyro")
    for sense in (Simulation(BODY).sense, Simulation(BODY).run(steps=1).sense, Ensemble(1.0, BODY.inertia).sense):
        with pytest.raises(ValueError, match="there is no sensor 'imu'; none was given"):
            sense("imu")


def test_gnss_without_pyproj_is_refused_by_a_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyproj", None)
    scene = Scene({"sensors.gps.type": "gnss"})
    with pytest.raises(ValueError, match=r"sensor 'gps': type gnss needs pyproj, .* or leave the sensor out"):
        Simulation.from_scene(scene)


def test_nothing_but_gnss_needs_pyproj():
    text = (
        "import sys; sys.modules['pyproj'] = None; from rigid_body_sim import Scene, Simulation; print(Scene()['rate'])"
    )
    found = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert found.stdout == "1000.0\n"


def test_a_delay_that_is_no_whole_number_of_steps_is_noted():
    (note,) = Scene({**IMU, "sensors.imu.delay": 0.0123}).notes
    assert note == "parameter sensors.imu.delay = 0.0123: is no whole number of steps of 0.001 s, and taken as 0.012 s"
    assert Scene({**IMU, "sensors.imu.delay": 0.012}).notes == ()


def test_parameters_are_those_of_the_type():
    names = {
        name.removeprefix("sensors.baro.")
        for name in Scene({"sensors.baro.type": "barometer"}).values
        if name.startswith("sensors.")
    }
    assert {"type", "rate", "seed", "delay", "noise_density", "bias", "origin.altitude"} <= names
    assert not names & {"origin.latitude", "field", "gyroscope.bias", "min_range"}
