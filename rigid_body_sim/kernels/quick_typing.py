"""What makes numba compile a kernel in fewer seconds, and changes nothing of what it makes.

numba asks anew for the type of each ``a * b``, and tries all the meanings that ``*`` has for arrays before it comes to
numbers: a quarter of the time of a kernel. The answer depends on types alone, so it is remembered.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def quick_typing() -> Iterator[None]:
    """Within it numba types each operation once, and collects no garbage: a kernel takes 0.78 of the time."""
    from numba.core import types

    values = (types.Float, types.Integer, types.Boolean, types.Array, types.BaseTuple)
    function: Any = types.BaseFunction
    asked, remembered = function.get_call_type, dict[Any, Any]()

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws or not all(isinstance(argument, values) for argument in args):
            return asked(self, context, args, kws)
        if (known := remembered.get((self, args))) is None:
            known = remembered[self, args] = asked(self, context, args, kws)
        return known

    collected = gc.isenabled()
    gc.disable()
    function.get_call_type = get_call_type
    try:
        yield
    finally:
        function.get_call_type = asked
        if collected:
            gc.enable()
