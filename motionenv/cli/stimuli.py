"""The `stimuli` command: point-light walkers for experiments on perception."""

from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import progress


def stimuli(
    source: Annotated[Path, typer.Argument(help="What to show: .toml or .json, also the stimuli.json of a set.")],
    out: Annotated[Path, typer.Option(help="Folder that is new or empty.")],
) -> None:
    """Make a set of point-light stimuli: films or frames, tables of the dots, and stimuli.json, which makes it again.

    Example: motionenv stimuli masked.toml --out masked
    """
    from motionenv.data.stimuli import StimulusSet, write_stimuli

    asked = StimulusSet.read(source)
    with progress("drawing", asked.stimuli * asked.frames) as step:
        told = write_stimuli(asked, out, step=step)
    typer.echo(f"{told.parent}  {asked.stimuli} stimuli of {asked.frames} frames")
