"""The command that runs the benchmarks of a checkout."""

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from motionenv.errors import MotionError


def bench(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="Which; left out, they are listed.")] = "",
) -> None:
    """Run a benchmark of the checkout; what follows its name goes to it (after --, where it is an option of ours).

    Example: motionenv bench tree --mocap ../shared/mocap
    """
    folder = Path(__file__).parents[2] / "benchmarks"
    known = {p.stem: p for p in sorted(folder.glob("*.py")) if "__main__" in p.read_text(encoding="utf-8")}
    if not known:
        raise MotionError(
            f"there is no benchmark in {folder}: they are not installed with the package, so clone the repository and "
            "`pip install -e '.[bench]'` there"
        )
    if name not in known and name:
        raise MotionError(f"no benchmark is called {name!r}; there are: {', '.join(known)}")
    if not name:
        typer.echo("\n".join(known))
        return
    raise typer.Exit(subprocess.run([sys.executable, known[name], *context.args], check=False).returncode)
