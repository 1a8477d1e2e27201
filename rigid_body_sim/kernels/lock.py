"""Python's lock in a kernel that advances: kept for a few steps, given up for many, so that other threads run then.

To give it up costs 0.1 µs. Where another thread waits for it, each time also one thread is put to sleep and one woken,
which takes longer than a few steps do.
"""

from typing import Any

from .arrays import Floats
from .compiled import ENABLED, Steps, kernel


def giving_way(steps: Steps, few: int) -> Steps:
    """The same kernel, which gives up Python's lock for as long as it does more than ``few`` steps."""
    if not ENABLED:
        return steps
    inner = kernel(steps)

    def entry(state: Floats, model: Floats, work: Floats, h: float, n: int) -> int:
        thread = give_up_lock() if n > few else 0
        done = inner(state, model, work, h, n)
        if n > few:
            take_back_lock(thread)
        return done

    return entry


if ENABLED:
    from numba import types
    from numba.extending import intrinsic

    # As numba's own ``nogil`` does around every call. No kernel raises, so what was given up is always taken back.

    def _saving(typing: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            thread = context.get_python_api(builder).save_thread()
            return builder.ptrtoint(thread, context.get_value_type(types.intp))

        return types.intp(), generate

    def _restoring(typing: Any, thread: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            api = context.get_python_api(builder)
            api.restore_thread(builder.inttoptr(arguments[0], api.voidptr))
            return context.get_dummy_value()

        return types.void(types.intp), generate

    give_up_lock, take_back_lock = intrinsic(_saving), intrinsic(_restoring)

else:

    def give_up_lock() -> int:
        """Let other threads run from here on; returns what ``take_back_lock`` needs."""
        return 0

    def take_back_lock(thread: int) -> None:
        """Wait for the others."""
