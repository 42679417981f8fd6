"""The `fit` and `models` commands."""

from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import (
    Fill,
    Fps,
    Map,
    Person,
    Unit,
    Up,
    check_folder,
    check_picture,
    err,
    marker_map,
    note,
    progress,
)
from motionenv.errors import MotionError


def fit(
    model: Annotated[str, typer.Argument(help="tree, walk/fpca, walk/eigenwalkers or walk/prior.")],
    mocap: Annotated[Path, typer.Option(help="Folder of capture files, including subfolders.")],
    out: Annotated[Path, typer.Option(help="Model file to write (.npz).")], fps: Fps = None, unit: Unit = None,
    up: Up = None, person: Person = None, map_: Map = None, fill: Fill = False,
    mirrored: Annotated[bool, typer.Option("--mirrored", help="Tree: add mirror images of the clips.")] = False,
    group: Annotated[list[str] | None, typer.Option(
        help="Eigenwalkers: NAME=PERSON,PERSON,… twice, for the axis between two groups of people.")] = None,
    activity: Annotated[str | None, typer.Option(help="Tree: activity of all clips; by default from names.")] = None,
    straight: Annotated[bool, typer.Option("--straight", help="Walks: only long, straight and steady ones.")] = False,
) -> None:  # fmt: skip
    """Fit a walking model, or a tree of any motion, to motion capture.

    Example: motionenv fit walk/fpca --mocap cmu-walks --fps 120 --out my-walk.npz
    """
    from motionenv.models import training

    if group and model != "walk/eigenwalkers":
        raise MotionError(f"--group is only for walk/eigenwalkers, not for {model}: omit it")
    if model != "tree":
        training.check_name(model)
        if mirrored or activity is not None:
            raise MotionError(f"--mirrored and --activity are only for tree, not for {model}: omit them")
    elif straight:
        raise MotionError("--straight is only for walking models, not for tree: omit it")
    check_folder(out)
    asked = {
        "--fps": None if fps is None else f"{fps:g}", "--unit": unit, "--up": up, "--person": person, "--map": map_,
        "--activity": activity,
    }  # fmt: skip
    options = "".join(f" {key} {value}" for key, value in asked.items() if value)
    flags = {"--fill": fill, "--straight": straight, "--mirrored": mirrored}
    options += "".join(f" {flag}" for flag, given in flags.items() if given)
    options += "".join(f" --group {one}" for one in group or ())
    command = f"motionenv fit {model} --mocap {mocap.name}{options} --out {out.name}"
    reading = {"fps": fps, "unit": unit, "up": up, "person": person, "marker_map": marker_map(map_), "fill": fill}
    if model == "tree":
        _fit_tree(mocap, out, command, activity=activity, mirrored=mirrored, **reading)
    else:
        _fit_walk(model, mocap, out, command, _groups(group), straight, **reading)


def models(context: typer.Context) -> None:
    """List the models of all installed packages, with their model cards.

    Example: motionenv models
    """
    from motionenv.models import card, names

    if context.invoked_subcommand is not None:
        return
    for name in names():
        typer.echo(name)
        try:
            told = card(name)
        except MotionError as error:
            told = {"unavailable": error}
        for key, value in told.items():
            typer.echo(f"    {key}: {value}")


def describe(
    model: Annotated[str, typer.Argument(help="Name or file of the model.")],
    out: Annotated[Path | None, typer.Option(help="Picture to draw of components (.png, .pdf, .svg).")] = None,
) -> None:
    """Describe one model: its card, what it learned, and the share of variance of its components.

    Example: motionenv models describe walk/fpca --out components.png
    """
    from motionenv._core.files import atomic_write
    from motionenv.models import load
    from motionenv.models.fpca import FunctionalPCA, plots

    if out is not None:
        check_picture(out, "--out")
    made = load(model)
    fpca = getattr(made, "fpca_", made)
    if out is not None and not isinstance(fpca, FunctionalPCA):
        raise MotionError(f"--out draws components of angle curves, which {made.kind} models don't have: omit it")
    told = {key: value for key, value in made.describe().items() if value not in (None, [], {}, "")}
    for part in told.pop("components", []):
        share, deviation = part["share"], part["deviation"]
        told[part["name"]] = f"{share:.1%} of variance, standard deviation {deviation:.3g}"
    for key, value in told.items():
        if isinstance(value, dict):
            typer.echo(f"{key}:")
            for name, what in value.items():
                typer.echo(f"    {name}: {_number(what)}")
        else:
            typer.echo(f"{key}: {', '.join(value) if isinstance(value, list) else _number(value)}")
    if out is not None:
        with atomic_write(out) as temporary:
            plots.components(fpca).savefig(temporary)


def _number(value) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _groups(given: list[str] | None) -> dict[str, list[str]] | None:
    """The groups of people by their names."""
    if not given:
        return None
    parts = [one.partition("=") for one in given]
    if len({name for name, _, _ in parts}) != 2 or not all(name and people for name, _, people in parts):
        raise MotionError(f"--group is NAME=PERSON,PERSON,… with two names, got {' '.join(given)}")
    return {name: [who.strip() for who in people.split(",")] for name, _, people in parts}


def _fit_walk(model, mocap, out, command, groups, straight, **reading) -> None:
    from motionenv.models import training

    with progress("reading walks", None) as step:
        walks = training.read_walks(mocap, on_file=step, **reading)
    walks = walks.straight() if straight else walks
    for name, why in walks.left_out.items():
        note(f"left out {name}: {why}")
    with err.status(f"fitting {model} to {len(walks.motions)} walks of {len(set(walks.subjects))} people"):
        fitted = training.fit(model, walks, command, groups)
        fitted.save(out)
    for trait in fitted.own_traits():
        note(trait.note)
    told = walks.summary()
    note("learned from " + ", ".join(f"{told.pop(name)} {name}" for name in list(told) if isinstance(told[name], int)))
    for name, what in told.items():
        note(f"{name} of strides: {what}")
    typer.echo(f"{out}  {len(walks.motions)} walks of {len(set(walks.subjects))} people")


def _fit_tree(mocap, out, command, **how) -> None:
    from motionenv.models.motion_tree.training import fit_tree

    with progress("reading clips", None) as step:
        tree = fit_tree(
            mocap, command=command, **how, on_file=step, on_left_out=lambda name, why: note(f"left out {name}: {why}"),
        )  # fmt: skip
    tree.save(out)
    card = tree.card_
    kept = f"{card['components']} components keep {card['variance kept']} of the variance"
    typer.echo(f"{out}  {card['clips']} clips, {card['frames']} frames, {card['windows']} windows; {kept}")
