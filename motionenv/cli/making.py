"""Commands that make motion and pictures: demo, synth, sample, render."""

import math
from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import (
    Fps,
    Height,
    Seed,
    Size,
    Speed,
    Unit,
    View,
    check_folder,
    err,
    parsed_numbers,
    parsed_size,
    parsed_view,
    progress,
)  # fmt: skip
from motionenv.errors import MotionError

_FILMS = {".mp4", ".gif", ".webp"}


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the results; made when missing.")] = Path("motionenv-demo"),
    seed: Seed = 1,
) -> None:
    """Synthesise a person who walks, and film it beside its point-light twin.

    Needs no data and no graphics library. Example: motionenv demo --seed 7
    """
    from motionenv.demo import SECONDS, make_demo

    with progress("a person walks", SECONDS * 30) as step:
        made = make_demo(out, seed=seed, on_frame=step)
    for path, what in made.items():
        typer.echo(f"{path}  {what}")


def synth(
    model: Annotated[str, typer.Argument(help="A model's name or file: see `motionenv models`.")],
    out: Annotated[Path, typer.Option(help="Where to: .bvh, .c3d, .csv, .glb or .npz.")],
    seconds: Annotated[float, typer.Option(help="Duration in seconds.")] = 10.0,
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 60.0,
    seed: Seed = 0,
    speed: Speed = None,
    height: Height = None,
    phase: Annotated[float, typer.Option(help="Where in the cycle to start, in cycles.")] = 0.0,
    variation: Annotated[float, typer.Option(help="How much cycles differ; 0 repeats one exactly.")] = 1.0,
    deviations: Annotated[
        str | None, typer.Option(help="Who walks: standard deviations along each component, as 1,0,-2; else drawn.")
    ] = None,
) -> None:
    """Synthesise a walk into a motion file.

    Example: motionenv synth walk/fpca --seconds 5 --speed 1.4 --deviations 1,0,-2 --seed 3 --out walk.bvh
    """
    from motionenv.mocap import write
    from motionenv.mocap.writing import check_suffix
    from motionenv.models.synthesis import synthesize

    check_suffix(out)
    motion = synthesize(
        model, seconds, fps, seed=seed, speed=speed, height=height, phase=phase, variation=variation,
        deviations=parsed_numbers(deviations, "deviations"),
    )  # fmt: skip
    write(motion, out)
    typer.echo(f"{out}  {motion.poses.shape[0]} frames, {motion.seconds:g} s at {motion.fps:g} fps")


def sample(
    out: Annotated[Path, typer.Option(help="Where to: a film (.mp4, .gif, .webp) or .bvh, .c3d, .csv, .glb, .npz.")],
    tree: Annotated[str, typer.Option(help="A tree's name or file: see `motionenv fit tree`.")] = "mixed/tree",
    start: Annotated[str | None, typer.Option(help="Activity to begin with; by default any.")] = None,
    seconds: Annotated[float, typer.Option(help="Duration in seconds.")] = 10.0,
    temperature: Annotated[float, typer.Option(help="Near 0 the nearest motion follows; at 1 almost any.")] = 0.05,
    seed: Seed = 0,
    method: Annotated[str, typer.Option(help="exact, or tree: the paper's search.")] = "exact",
    activity: Annotated[str | None, typer.Option(help="Steer to this activity.")] = None,
    heading: Annotated[float | None, typer.Option(help="Steer to this heading in degrees; 90 is left.")] = None,
    speed: Annotated[float | None, typer.Option(help="Steer to this speed in m/s.")] = None,
    blend: Annotated[bool, typer.Option("--blend/--no-blend", help="Smooth over jumps between clips.")] = True,
    contact: Annotated[bool, typer.Option("--contact/--no-contact", help="Keep standing feet in place.")] = True,
    view: View = "side",
    size: Size = "640x480",
) -> None:
    """Let motion of any length grow from a tree, into a film or a motion file.

    Example: motionenv sample --tree mixed/tree --start walk --seconds 10 --temperature 0.5 --out run.mp4
    """
    from motionenv.mocap import write
    from motionenv.mocap.writing import check_suffix
    from motionenv.models.store import load
    from motionenv.models.tree.growth import Options, Target, synthesize

    filmed = out.suffix.lower() in _FILMS
    if not filmed:
        check_suffix(out)
    alpha, (width, height) = parsed_view(view), parsed_size(size)
    check_folder(out)
    target = Target(activity, None if heading is None else math.radians(heading), speed)
    with err.status(f"loading {tree}; the first time mixed/tree is made"):
        loaded = load(tree)
    if loaded.kind != "tree":
        raise MotionError(f"{tree} is no tree but a {loaded.kind} model: `motionenv synth {tree}` makes motion from it")
    motion = synthesize(
        loaded, seconds, start=start, temperature=temperature, seed=seed, method=method, target=target,
        contact=contact, blend=Options.blend if blend else 0.0,
    )  # fmt: skip
    if filmed:
        _film(motion, out, alpha, width=width, height=height)
    else:
        write(motion, out)
    typer.echo(f"{out}  {len(motion.poses)} frames, {motion.seconds:g} s at {motion.fps:g} fps")


def render(
    motion: Annotated[Path, typer.Argument(help="A motion file: ours (.npz), or capture to retarget.")],
    out: Annotated[Path, typer.Option(help="Where to: .mp4, .gif, .webp, or a folder name for PNG frames.")],
    view: View = "side",
    size: Size = "640x480",
    points: Annotated[bool, typer.Option("--points", help="Point lights instead of a body.")] = False,
    engine: Annotated[str, typer.Option(help="raycast, or pyrender (OpenGL).")] = "raycast",
    still: Annotated[bool, typer.Option("--still", help="Hold the camera still instead of following.")] = False,
    fps: Fps = None,
    unit: Unit = None,
) -> None:
    """Film a motion.

    Example: motionenv render walk.npz --view oblique --out walk.mp4
    """
    from motionenv.mocap import read_motion

    width, height = parsed_size(size)
    alpha = parsed_view(view)
    loaded = read_motion(motion, fps=fps, unit=unit)
    _film(loaded, out, alpha, width=width, height=height, points=points, engine=engine, follow=not still)
    typer.echo(f"{out}  {len(loaded.poses)} frames")


def _film(motion, out: Path, alpha: float, **how) -> None:
    """Film a motion into a file."""
    from motionenv.render.film import film
    from motionenv.render.video import write_video

    with progress("rendering", len(motion.poses)) as step:
        write_video(out, film(motion, alpha, **how), motion.fps, progress=step)
