"""The `evaluate` command."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from motionenv._core.files import atomic_write
from motionenv.cli._shared import Fps, Unit, check_folder


def evaluate(
    agent: Annotated[str, typer.Argument(
        help="mean-pose, blob, kalman, particle-filter, oracle, or module:factory, where factory(env) makes an "
        "agent. In ActiveTracking: still, sweep, greedy, planner, oracle.")],
    task: Annotated[str, typer.Option(help="Id of a task, such as motionenv/WalkerTracking-Easy-v1.")],
    split: Annotated[str, typer.Option(help="eval, ood, or train, on which to choose settings.")] = "eval",
    motion: Annotated[Path | None, typer.Option(help="Folder of motion capture, for split ood.")] = None,
    fps: Fps = None, unit: Unit = None,
    episodes: Annotated[int, typer.Option(min=1, help="Number of episodes; their seeds are fixed.")] = 100,
    out: Annotated[Path | None, typer.Option(help="JSON file of the results.")] = None,
) -> None:  # fmt: skip
    """Score an agent on a named task.

    Example: motionenv evaluate blob --task motionenv/WalkerTracking-Easy-v1 --out results.json
    """
    import motionenv.envs  # noqa: F401 (registers the tasks)
    from motionenv.envs.agents import score

    if out is not None:
        check_folder(out)
    sys.path.insert(0, "")  # so that module:factory is found in this folder
    captured = str(motion) if motion else None
    result = score(task, agent, episodes, split=split, motion=captured, file_fps=fps, unit=unit)
    if out is not None:
        with atomic_write(out) as part:
            part.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    low, high = (1000 * bound for bound in result["error_interval"])
    what, least = ("person", "still") if "ActiveTracking" in task else ("joint", "mean pose")
    typer.echo(f"{1000 * result['mean_error']:.1f} mm per {what} (95 %: {low:.1f} to {high:.1f}), {episodes} episodes")
    low, high = result["normalised_interval"]
    typer.echo(f"{result['normalised_return']:.3f} of the way from {least} to oracle ({low:.3f} to {high:.3f})")
