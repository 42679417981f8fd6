"""The `report` command."""

from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import Fps, Map, Static, Unit, check_folder, marker_map, note, progress
from motionenv.errors import MotionError


def report(
    files: Annotated[list[Path], typer.Argument(help="Captures of one person: .c3d, .trc, .bvh, .amc or .npz.")],
    out: Annotated[Path, typer.Option(help="Output page, .html; .json and .csv are written beside it.")],
    fps: Fps = None,
    unit: Unit = None,
    map_: Map = None,
    static: Static = None,
    group: Annotated[
        Path | None,
        typer.Option(help="Reference: a folder of captures, or a file of --save-group; by default CMU's people."),
    ] = None,
    save_group: Annotated[Path | None, typer.Option(help="Write the band of --group to this file, .json.")] = None,
) -> None:
    """Write a gait report: step parameters, and joint angles over the gait cycle against a reference.

    In a folder of captures a file's name up to the first "_" is the person's label.

    Example: motionenv report walk1.c3d walk2.c3d --static standing.c3d --out report.html
    """
    from motionenv.gait import load_band, read_group, write_report

    if save_group is not None and group is None:
        raise MotionError("--save-group writes the band of --group: give the folder of captures with --group")
    check_folder(out)
    chosen = marker_map(map_)
    band = None
    if group is not None and group.is_dir():
        with progress("reading the group", None) as step:
            band, left_out = read_group(group, marker_map=chosen, fps=fps, unit=unit, on_file=step)
        for name, why in left_out.items():
            note(f"{name} is not in the group: {why}")
    elif group is not None:
        band = load_band(group)
    if band is not None and save_group is not None:
        band.save(save_group)
    with progress("analysing", len(files)) as step:
        session = write_report(
            files, out, static=static, marker_map=chosen, fps=fps, unit=unit, band=band, on_step=step
        )
    for name, why in session.left_out.items():
        note(f"{name} was left out: {why}")
    typer.echo(f"{out}  {len(session.strides)} strides of {session.person}")
