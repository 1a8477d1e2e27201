"""What makes numba compile a kernel in fewer seconds, and changes nothing of what it computes.

numba asks anew for the type of each ``a * b``, and tries all the meanings that ``*`` has for arrays before it comes to
numbers: a quarter of the time of a kernel. The answer depends on types alone, so it is remembered. And it optimises
and assembles each kernel by itself, then once more in each that it is inlined into; here only the outermost is, with
all inside.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any


@contextmanager
def quick_compiling(entry: str) -> Iterator[None]:
    """Within it the kernel whose qualified name is ``entry`` is compiled, in about half of the time that it takes else.

    Other threads that have numba compile something wait until then: what is theirs is compiled as ever.
    """
    from numba.core import codegen, types
    from numba.core.compiler_lock import global_compiler_lock

    library = codegen.CPUCodeLibrary
    with (
        global_compiler_lock,
        _without_collecting(),
        _replaced(types.BaseFunction, "get_call_type", partial(_remembering, types)),
        _replaced(library, "_optimize_functions", partial(_of, entry, _only_laid_out)),
        _replaced(library, "_optimize_final_module", partial(_of, entry, _left)),
        _replaced(library, "_finalize_final_module", partial(_of, entry, _counted_as_final)),
        _replaced(codegen.JITCPUCodegen, "set_env", _where_assembled),
    ):
        yield


@contextmanager
def _replaced(owner: Any, name: str, made_of: Callable[[Any], Any]) -> Iterator[None]:
    """Within it a method is what ``made_of`` makes of it."""
    before = getattr(owner, name)
    setattr(owner, name, made_of(before))
    try:
        yield
    finally:
        setattr(owner, name, before)


@contextmanager
def _without_collecting() -> Iterator[None]:
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
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


def _of(entry: str, otherwise: Any, act: Any) -> Any:
    def act_on_entry(self: Any, *arguments: Any) -> None:
        (act if self.name == entry else otherwise)(self, *arguments)

    return act_on_entry


def _only_laid_out(library: Any, module: Any) -> None:
    module.data_layout = library._codegen._data_layout


def _left(library: Any) -> None:
    pass


def _counted_as_final(library: Any) -> None:
    library._finalized = True


def _where_assembled(set_env: Any) -> Any:
    """numba's pointer to what a function needs of Python goes where its machine code is: an inner kernel has none."""

    def set_env_of_entry(self: Any, name: str, env: Any) -> None:
        if self._engine.get_global_value_address(name):
            set_env(self, name, env)

    return set_env_of_entry
