"""The `bench` command, which runs the benchmarks of a checkout."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

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
