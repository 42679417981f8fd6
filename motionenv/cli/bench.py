"""The `bench` and `compile` commands: run the benchmarks of a checkout; compile kernels beforehand."""

import os
import subprocess
import sys
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import err, note
from motionenv.errors import MotionError


def bench(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="Name of the benchmark; without it, all are listed.")] = "",
) -> None:
    """Run a benchmark of the checkout. Arguments after its name are passed on (use -- before options of this command).

    Example: motionenv bench tree --mocap ../shared/mocap
    """
    root = Path(__file__).parents[2]
    known = benchmarks(root)
    if not known:
        raise MotionError(
            f"there is no benchmark in {root / 'benchmarks'}: they are not installed with the package, so clone the "
            "repository and `pip install -e '.[bench]'` there"
        )
    if name not in known and name:
        raise MotionError(f"no benchmark is called {name!r}; there are: {', '.join(known)}")
    if not name:
        typer.echo("\n".join(known))
        return
    path = os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-P", "-m", f"benchmarks.{name}", *context.args]  # -P: whatever lies in this folder
    raise typer.Exit(subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, check=False).returncode)


def benchmarks(root: Path) -> list[str]:
    """Names of the modules below `root`/benchmarks that have a `main`, without the name of that folder."""
    folder = root / "benchmarks"
    runnable = [p for p in folder.rglob("*.py") if "\ndef main() -> None:" in p.read_text(encoding="utf-8")]
    parts = [p.relative_to(folder).with_suffix("").parts for p in runnable]
    return sorted(".".join(part for part in name if part != "__main__") for name in parts)


def compile_kernels(
    tasks: Annotated[list[str] | None, typer.Argument(
        help="demo, env, film, lift, page, render, report, sample or synth; by default all of them.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Processes; by default as many as cores.")] = None,
) -> None:  # fmt: skip
    """Compile kernels beforehand, such as in an image for containers or on a cluster's shared disk.

    Kernels serve the kind of processor that compiled them. They lie in the user's cache, or in NUMBA_CACHE_DIR.
    Example: motionenv compile demo lift --processes 4
    """
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
    note(f"kernels compiled: {made}")
