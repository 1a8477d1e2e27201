"""Build and install rules, for colcon (ROS) and for pip (no ROS)."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

package_name = "rigid_body_sim"


def ros_wheels(distribution):
    """rclpy and messages of a ROS distribution, from PyPI."""
    return [f"ros-{distribution}-rclpy[fastrtps]", f"ros-{distribution}-common-interfaces"]


data_files = [
    ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
    (f"share/{package_name}", ["package.xml"]),
    (f"share/{package_name}/config", sorted(glob("config/*"))),
    (f"share/{package_name}/launch", sorted(glob("launch/*"))),
    (f"share/{package_name}/rviz", sorted(glob("rviz/*"))),
    (f"share/{package_name}/foxglove", sorted(glob("foxglove/*"))),
    (f"share/{package_name}/security", sorted(glob("security/*"))),
    # For pip, which puts the programs in bin/ where `ros2 run` does not look. colcon writes the programs over these.
    (f"lib/{package_name}", sorted(glob("wrappers/*"))),
]

setup(
    name=package_name,
    version="0.1.0",
    description="Rigid-body simulation node for ROS 2, exact between commands",
    long_description=Path(__file__).with_name("README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    maintainer="rigid_body_sim maintainers",
    maintainer_email="maintainers@example.org",
    packages=find_packages(include=[package_name, f"{package_name}.*"]),
    package_data={package_name: ["py.typed"], f"{package_name}.report": ["page.css", "page.js", "reference/*.json"]},
    data_files=data_files,
    zip_safe=True,
    python_requires=">=3.10",
    install_requires=["numpy", "pyyaml"],
    extras_require={
        "ros": ros_wheels("jazzy"),
        "ros-jazzy": ros_wheels("jazzy"),
        "ros-kilted": ros_wheels("kilted"),
        "fast": ["numba"],
        "mesh": ["trimesh"],
        "report": ["matplotlib", "mpmath", "tqdm"],
        "bag": ["mcap>=1.5", "rosbags>=0.11", "tqdm"],
        "view": ["viser>=1.1"],
        "dask": ["distributed"],
        "rl": ["gymnasium>=1.1"],
        "sensors": ["pyproj"],  # what sensors of type gnss need
        "arrays": ["matplotlib", "pandas", "tqdm"],  # what trajectories are shown with
        # What the adapters in bench/peers drive.
        # bsk is Basilisk and pin is Pinocchio; the names "basilisk" and "pinocchio" on PyPI are other projects.
        "peers": ["bsk", "diffrax", "drake", "heyoka", "jax", "mujoco", "pin", "scipy"],
        "test": [
            "distributed",
            "gymnasium>=1.1",
            "hypothesis",
            "mcap>=1.5",
            "mcap-ros2-support",
            "matplotlib",
            "mpmath",
            "pandas",
            "pyproj",
            "pytest",
            "pytest-cov",
            "pytest-timeout",
            "pytest-xdist",
            "rosbags>=0.11",
            "scipy",
            "tqdm",
            "trimesh",
            "viser>=1.1",
        ],
    },
    entry_points={
        "console_scripts": [
            "rigid_body_node = rigid_body_sim.ros.main:main",
            "rigid_body_demo = rigid_body_sim.tools.demo:main",
            "rigid_body_report = rigid_body_sim.report.main:main",
            "rigid_body_view = rigid_body_sim.tools.view:main",
            "rigid_body_resim = rigid_body_sim.tools.resim_main:main",
            "rigid_body_plot = rigid_body_sim.tools.bag_plot:main",
            "pointing_controller = rigid_body_sim.tools.pointing_controller:main",
            "actuator_controller = rigid_body_sim.tools.actuator_controller:main",
        ],
    },
)
