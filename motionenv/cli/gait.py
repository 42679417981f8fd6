"""The `report` command."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motionenv._core.representation import counted
from motionenv.cli._shared import Fps, Map, Person, Static, Unit, Up, Wands, check_folder, marker_map, note, progress
from motionenv.errors import MotionError

if TYPE_CHECKING:
    from motionenv.gait import Band


def report(
    files: Annotated[list[Path], typer.Argument(help="Captures of one person: .c3d, .trc, .bvh, .amc or .npz.")],
    out: Annotated[Path, typer.Option(help="Output page, .html; .json and .csv are written beside it.")],
    fps: Fps = None, unit: Unit = None, up: Up = None, person: Person = None, map_: Map = None, static: Static = None,
    wands: Wands = "auto",
    group: Annotated[
        Path | None,
        typer.Option(help="Reference: a folder of captures, or a file of --save-group; by default CMU's people."),
    ] = None,
    save_group: Annotated[Path | None, typer.Option(help="Write the band of --group to this file, .json.")] = None,
    age: Annotated[
        float | None, typer.Option(help="Age [years], to show published norms beside step parameters.")
    ] = None,
    sex: Annotated[str | None, typer.Option(help="female or male, for norms that part them.")] = None,
) -> None:  # fmt: skip
    """Write a gait report: step parameters, and joint angles over the gait cycle against a reference.

    In a folder of captures a file's name up to the first "_" is the person's label.

    Example: motionenv report walk1.c3d walk2.c3d --static standing.c3d --out report.html
    """
    from motionenv.gait import norms_for, write_report

    if save_group is not None and group is None:
        raise MotionError("--save-group writes the band of --group: give the folder of captures with --group")
    check_folder(out)
    norms_for(age, sex)
    chosen = marker_map(map_)
    band = None if group is None else _band(group, marker_map=chosen, fps=fps, unit=unit, wands=wands)
    if band is not None and save_group is not None:
        band.save(save_group)
    with progress("analysing", len(files)) as step:
        session = write_report(
            files, out, static=static, marker_map=chosen, fps=fps, unit=unit, up=up, person=person, wands=wands,
            band=band, age=age, sex=sex, on_step=step,
        )  # fmt: skip
    for trial in session.trials:
        for doubt in trial.doubts:
            note(f"{trial.name} is not plausible: {doubt}")
    for name, why in session.left_out.items():
        note(f"{name} was left out: {why}")
    typer.echo(f"{out}  {counted(len(session.strides), 'stride')} of {session.person}")


def _band(group: Path, **how: Any) -> "Band":
    """The band of a folder of captures, or of a file of one."""
    from motionenv.gait import load_band, read_group

    if not group.is_dir():
        return load_band(group)
    with progress("reading the group", None) as step:
        band, left_out = read_group(group, on_file=step, **how)
    for name, why in left_out.items():
        note(f"{name} is not in the group: {why}")
    return band
