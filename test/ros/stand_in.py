"""Stand-ins for message packages that PyPI does not have: simulation_interfaces 1.5.1, and actuator_msgs.

The interfaces that the node serves or takes, with their fields, numbers and names as there, go through the generators
that come with rclpy and through the C compiler: what comes out travels over DDS as the real ones do, under the same
type hashes.
"""

import json
import os
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

PACKAGE = "simulation_interfaces"
DEPENDENCIES = (
    "action_msgs",
    "builtin_interfaces",
    "geometry_msgs",
    "service_msgs",
    "std_msgs",
    "unique_identifier_msgs",
)
INTERFACES = {
    "msg/Result.msg": """
        uint8 RESULT_FEATURE_UNSUPPORTED = 0
        uint8 RESULT_OK = 1
        uint8 RESULT_NOT_FOUND = 2
        uint8 RESULT_INCORRECT_STATE = 3
        uint8 RESULT_OPERATION_FAILED = 4
        uint8 result
        string error_message
    """,
    "msg/SimulationState.msg": """
        uint8 STATE_STOPPED = 0
        uint8 STATE_PLAYING = 1
        uint8 STATE_PAUSED = 2
        uint8 STATE_QUITTING = 3
        uint8 STATE_NO_WORLD = 4
        uint8 STATE_LOADING_WORLD = 5
        uint8 state
    """,
    "msg/SimulatorFeatures.msg": """
        uint8 ENTITY_STATE_GETTING = 10
        uint8 ENTITY_STATE_SETTING = 11
        uint8 ENTITY_INFO_GETTING = 12
        uint8 SIMULATION_RESET = 20
        uint8 SIMULATION_RESET_TIME = 21
        uint8 SIMULATION_RESET_STATE = 22
        uint8 SIMULATION_RESET_SPAWNED = 23
        uint8 SIMULATION_STATE_GETTING = 24
        uint8 SIMULATION_STATE_SETTING = 25
        uint8 SIMULATION_STATE_PAUSE = 26
        uint8 STEP_SIMULATION_SINGLE = 31
        uint8 STEP_SIMULATION_MULTIPLE = 32
        uint8 STEP_SIMULATION_ACTION = 33
        uint16[] features
        string[] spawn_formats
        string custom_info
    """,
    "msg/EntityCategory.msg": "uint8 CATEGORY_OBJECT = 0\nuint8 category",
    "msg/EntityInfo.msg": "EntityCategory category\nstring description\nstring[] tags",
    "msg/TagsFilter.msg": "string[] tags\nuint8 filter_mode",
    "msg/Bounds.msg": """
        uint8 TYPE_EMPTY = 0
        uint8 TYPE_BOX = 1
        uint8 TYPE_CONVEX_HULL = 2
        uint8 TYPE_SPHERE = 3
        uint8 type
        geometry_msgs/Vector3[] points
    """,
    "msg/EntityFilters.msg": """
        string filter
        EntityCategory[] categories
        TagsFilter tags
        Bounds bounds
    """,
    "msg/EntityState.msg": """
        std_msgs/Header header
        geometry_msgs/Pose pose
        geometry_msgs/Twist twist
        geometry_msgs/Accel acceleration
    """,
    "srv/GetSimulatorFeatures.srv": "---\nSimulatorFeatures features",
    "srv/GetSimulationState.srv": "---\nSimulationState state\nResult result",
    "srv/SetSimulationState.srv": """
        SimulationState state
        ---
        uint8 ALREADY_IN_TARGET_STATE = 101
        uint8 STATE_TRANSITION_ERROR = 102
        uint8 INCORRECT_TRANSITION = 103
        Result result
    """,
    "srv/StepSimulation.srv": "uint64 steps 1\n---\nResult result",
    "srv/ResetSimulation.srv": """
        uint8 SCOPE_DEFAULT = 0
        uint8 SCOPE_TIME = 1
        uint8 SCOPE_STATE = 2
        uint8 SCOPE_SPAWNED = 4
        uint8 SCOPE_ALL = 255
        uint8 scope
        ---
        Result result
    """,
    "srv/GetEntities.srv": "EntityFilters filters\n---\nResult result\nstring[] entities",
    "srv/GetEntityInfo.srv": "string entity\n---\nResult result\nEntityInfo info",
    "srv/GetEntityState.srv": "string entity\n---\nResult result\nEntityState state",
    "srv/SetEntityState.srv": """
        string entity
        EntityState state
        ---
        uint8 INVALID_POSE = 101
        Result result
    """,
    "action/SimulateSteps.action": """
        uint64 steps
        ---
        Result result
        ---
        uint64 completed_steps
        uint64 remaining_steps
    """,
}
ACTUATORS = "actuator_msgs"
OF_ACTUATORS = {
    "msg/Actuators.msg": """
        std_msgs/Header header
        float64[] position
        float64[] velocity
        float64[] normalized
    """
}

FASTRTPS, INTROSPECTION = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
LINKED = ("rosidl_generator_c", "rosidl_generator_py", "rosidl_typesupport_c", FASTRTPS, INTROSPECTION)
RUNTIME = ("rosidl_runtime_c", "rosidl_typesupport_c", FASTRTPS, INTROSPECTION, "rcutils", "rmw", "fastcdr", "stdc++")


def build(folder: Path, name: str = PACKAGE, interfaces: Mapping[str, str] = INTERFACES) -> Path:
    """Make the package in ``folder``, which takes a quarter of a minute; returns the folder to put on PYTHONPATH."""
    package, introspection = folder / name, folder / "introspection" / name
    names = _translate(package, interfaces)
    _generate(package, introspection, names)
    (package / "__init__.py").touch()
    objects = _compile([package, introspection])
    # The middleware looks both libraries up by these names, and the first is the Python module as well.
    library = package / f"lib{name}__{INTROSPECTION}.so"
    module = package / f"{name}_s__rosidl_typesupport_c{sysconfig.get_config_var('EXT_SUFFIX')}"
    _link(library, library.name, objects[introspection])
    _link(module, f"lib{name}__{FASTRTPS}.so", [*objects[package], library])
    return folder


def _translate(package: Path, interfaces: Mapping[str, str]) -> list[str]:
    """Write the interfaces and their translations into IDL; returns the names of the latter."""
    from rosidl_adapter import convert_to_idl

    for name, text in interfaces.items():
        file = package / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("\n".join(map(str.strip, text.strip().splitlines())) + "\n")
        convert_to_idl(package, package.name, Path(name), package)
    return [str(Path(name).with_suffix(".idl")) for name in interfaces]


def _generate(package: Path, introspection: Path, names: list[str]) -> None:
    """Write the sources: types and their functions in C, how they go over DDS, and their Python side."""
    from rosidl_generator_type_description import generate_type_hash

    generate_type_hash(_arguments(package, names, "rosidl_generator_c", package))

    def generate(generator: str, function: str, output: Path = package, *more: list[str]) -> None:
        told = (_arguments(package, names, generator, output), *more)
        call = f"from {generator} import {function}; {function}{told!r}"
        subprocess.run([sys.executable, "-c", call], check=True, stdout=subprocess.DEVNULL)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        done = [
            pool.submit(generate, "rosidl_generator_py", "generate_py", package, ["rosidl_typesupport_c"]),
            pool.submit(generate, "rosidl_generator_c", "generate_c"),
            pool.submit(generate, FASTRTPS, "generate_typesupport_fastrtps_c"),
            pool.submit(generate, INTROSPECTION, "generate_c", introspection),
            pool.submit(generate, "rosidl_typesupport_c", "generate_c", package, [FASTRTPS, INTROSPECTION]),
        ]
    for each in done:
        each.result()


def _arguments(package: Path, names: list[str], generator: str, output: Path) -> str:
    """File with what a generator is told, beside the header that says which of its symbols are seen outside."""
    resource = _prefix(generator) / "share" / generator / "resource"
    project = package.name
    for template in resource.glob("*visibility_control.h.in"):
        text = template.read_text().replace("@PROJECT_NAME@", project).replace("@PROJECT_NAME_UPPER@", project.upper())
        (output / "msg").mkdir(parents=True, exist_ok=True)
        (output / "msg" / template.stem).write_text(text)
    described = [f"{name}:{(package / name).with_suffix('.json')}" for name in names]
    file = package.parent / f"{generator}.json"
    values = {
        "package_name": project,
        "output_dir": str(output),
        "template_dir": str(resource),
        "idl_tuples": [f"{package}:{name}" for name in names],
        "include_paths": [f"{name}:{_prefix(name) / 'share' / name}" for name in DEPENDENCIES],
        "type_description_tuples": described,
        "target_dependencies": [],
    }
    file.write_text(json.dumps(values))
    return str(file)


def _prefix(name: str) -> Path:
    """Where a package of ROS is installed: where a sourced ROS says, or by pip beside Python."""
    for root in [*filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]:
        if (Path(root) / "share" / name).is_dir():
            return Path(root)
    raise FileNotFoundError(f"no package {name} of ROS under AMENT_PREFIX_PATH or {sys.prefix}")


def _compile(trees: list[Path]) -> dict[Path, list[Path]]:
    """Object files of the sources in each tree."""
    import numpy

    headers = [sysconfig.get_paths()["include"], numpy.get_include(), *(tree.parent for tree in trees)]
    for include in {_prefix(name) / "include" for name in ("rosidl_runtime_c", *DEPENDENCIES)}:
        headers += [include, *(path for path in include.iterdir() if path.is_dir())]
    command = ["gcc", "-c", "-fPIC", "-O0", "-w", *(f"-I{path}" for path in headers)]

    def compiled(source: Path) -> Path:
        target = source.with_name(f"{source.name}.o")
        subprocess.run([*command, str(source), "-o", str(target)], check=True)
        return target

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return {tree: list(pool.map(compiled, _units(tree))) for tree in trees}


def _units(tree: Path) -> list[Path]:
    """What to compile: all sources of a language as one, which reads the headers once, but for those that forbid it."""
    alone = sorted(tree.rglob("*__description.c"))  # all define the same names, each for itself
    units = []
    for language in ("c", "cpp"):
        sources = [source for source in sorted(tree.rglob(f"*.{language}")) if source not in alone]
        if sources:
            units.append(tree / f"all.{language}")
            units[-1].write_text("".join(f'#include "{source}"\n' for source in sources))
    return units + alone


def _link(target: Path, name: str, objects: list[Path]) -> None:
    """Shared library that others load by ``name``; it finds its neighbours beside itself."""
    folder = _prefix("rosidl_runtime_c") / "lib"
    libraries = [f"{package}__{kind}" for package in DEPENDENCIES for kind in LINKED] + list(RUNTIME)
    options = ["-Wl,--no-as-needed", f"-Wl,-soname,{name}", f"-Wl,-rpath,$ORIGIN:{folder}", f"-L{folder}"]
    linked = [f"-l{library}" for library in libraries]
    subprocess.run(["gcc", "-shared", *options, *map(str, objects), "-o", str(target), *linked], check=True)
