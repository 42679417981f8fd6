"""Record which kernels a script compiles, with their types and times: a part of `benchmarks.startup --record`.

python -m benchmarks.recording OUT SCRIPT
"""

import json
import os
import sys
import time
from pathlib import Path
from typing import Any


def encoded(numba_type: Any) -> Any:
    """A numba type as `motionenv._core.precompilation.decoded` reads it."""
    from numba import types
    from numba.np.numpy_support import as_dtype

    if isinstance(numba_type, types.Array):
        return ["array", encoded(numba_type.dtype), numba_type.ndim, numba_type.layout, numba_type.mutable]
    if isinstance(numba_type, types.Record):
        return ["record", *map(list, as_dtype(numba_type).descr)]
    if isinstance(numba_type, types.BaseTuple):
        made = numba_type.instance_class if isinstance(numba_type, types.NamedTuple | types.NamedUniTuple) else None
        name = f"{made.__module__}:{made.__qualname__}" if made else ""
        elements: Any = numba_type
        return [name, *map(encoded, elements)]
    return str(numba_type)


def record(script: str, out: str) -> None:
    """Run a script, and write to `out` which kernels are compiled for its calls, with types and CPU times [s]."""
    from numba.core import event

    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})  # on one core `precompile` does nothing
    stack: list[float] = []
    found: list[tuple[str, list, float]] = []

    class Listener(event.Listener):
        """Notes what is compiled, but not what is compiled as a part of it."""

        def on_start(self, event: Any) -> None:
            stack.append(time.process_time())

        def on_end(self, event: Any) -> None:
            seconds = round(time.process_time() - stack.pop(), 2)
            if not stack:
                function, types = event.data["dispatcher"].py_func, event.data["args"]
                found.append((f"{function.__module__}:{function.__qualname__}", list(map(encoded, types)), seconds))

    event.register("numba:compile", Listener())
    exec(script, {})
    Path(out).write_text(json.dumps(found))


if __name__ == "__main__":
    record(sys.argv[2], sys.argv[1])
