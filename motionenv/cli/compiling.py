"""The `compile` command."""

from typing import Annotated

import typer

from motionenv.cli._shared import err, note
from motionenv.errors import MotionError


def compile_kernels(
    tasks: Annotated[
        list[str] | None, typer.Argument(help="demo, env, film, lift, render or report; by default all of them.")
    ] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Processes; by default as many as cores.")] = None,
) -> None:
    """Compile kernels beforehand, such as in an image for containers or on a cluster's shared disk.

    Kernels serve the kind of processor that compiled them. They lie in the user's cache, or in NUMBA_CACHE_DIR.
    Example: motionenv compile demo lift --processes 4
    """
    from difflib import get_close_matches

    from rich.progress import Progress

    from motionenv._core.precompilation import compile_tasks, cores, recorded_tasks

    known = recorded_tasks()
    for task in tasks or ():
        if task not in known:
            near = get_close_matches(task, known, 1, 0.0)[0]
            raise MotionError(f"tasks must be of {', '.join(known)}; did you mean {near}? Got {task!r}")
    with Progress(console=err, disable=not err.is_terminal) as bar:
        row = bar.add_task("compiling", total=None)
        made = compile_tasks(
            tasks or known, processes or cores(), lambda done, total: bar.update(row, completed=done, total=total)
        )
    note(f"{made} kernels compiled")
