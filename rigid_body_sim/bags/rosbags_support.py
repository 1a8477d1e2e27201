"""The libraries rosbags and mcap, where they are installed, and what is said when a bag cannot be made or read."""

import functools
import importlib
from typing import Any

ACTUATORS = "actuator_msgs/msg/Actuators"  # which is in a package of its own
_OTHERS = {ACTUATORS: "std_msgs/Header header\nfloat64[] position\nfloat64[] velocity\nfloat64[] normalized\n"}
HOW_TO_INSTALL = "pip install '.[bag,fast]' in the folder of rigid_body_sim"


class BagError(Exception):
    """A bag that cannot be made, read or replayed; the text is one sentence that says what would be right."""


def require() -> None:
    """Raise BagError unless rosbags and mcap can be imported."""
    for library, module in (("rosbags", "rosbags.rosbag2"), ("mcap", "mcap.writer")):
        try:
            importlib.import_module(module)
        except ImportError as reason:
            raise BagError(
                f"bags need the library {library}, which cannot be imported ({reason}); {HOW_TO_INSTALL}"
            ) from None


@functools.cache
def typestore() -> Any:
    """The message types of ROS 2 Jazzy, and others that a node may take. Raises BagError without rosbags."""
    require()
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    for kind, definition in _OTHERS.items():
        store.register(get_types_from_msg(definition, kind))
    return store
