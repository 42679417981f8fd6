"""The `demo`, `synth`, `sample` and `render` commands."""

import math
from pathlib import Path
from typing import Annotated, Unpack

import typer

from motionenv.arguments import WalkArguments
from motionenv.cli._shared import (
    Fill,
    Fps,
    Map,
    Seed,
    Size,
    Unit,
    View,
    check_folder,
    err,
    marker_map,
    parsed_numbers,
    parsed_path,
    parsed_size,
    parsed_speed,
    parsed_view,
    progress,
    walk_options,
)  # fmt: skip
from motionenv.errors import MotionError

_FILMS = (".mp4", ".gif", ".webp")
Out = Annotated[Path, typer.Option(
    help="Output file: a film (.mp4, .gif, .webp) or .bvh, .c3d, .csv, .glb, .mot, .npz, .trc.")]  # fmt: skip


def demo(
    out: Annotated[Path, typer.Option(help="Output folder; created if necessary.")] = Path("motionenv-demo"),
    seed: Seed = 1,
) -> None:
    """Synthesise a walking person, and film it beside its point-light display.

    Needs no data and no graphics library. Example: motionenv demo --seed 7
    """
    from motionenv.cli.demo import SECONDS, make_demo

    with progress("rendering", SECONDS * 30) as step:
        made = make_demo(out, seed=seed, on_frame=step)
    for path, what in made.items():
        typer.echo(f"{path}  {what}")


@walk_options
def synth(
    model: Annotated[str, typer.Argument(help="Name or file of the model: see `motionenv models`.")],
    out: Out,
    seconds: Annotated[float, typer.Option(help="Duration in seconds.")] = 10.0,
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 30.0,
    seed: Seed = 0,
    speed: Annotated[str | None, typer.Option(
        help="Speed [m/s], or TIME:SPEED ..., as '0:0 1:1.3 6:1.3 7:0'; by default the walker's.")] = None,
    path: Annotated[str | None, typer.Option(
        help="arc:RADIUS,DEGREES; points 'X,Y X,Y ...' [m]; or a file of them (.csv).")] = None,
    deviations: Annotated[str | None, typer.Option(
        help="The walker, in standard deviations per component, as 1,0,-2; by default random.")] = None,
    view: View = "side",
    size: Size = "640x480",
    **walk: Unpack[WalkArguments],
) -> None:  # fmt: skip
    """Synthesise a walk, as a film or a motion file.

    Example: motionenv synth walk/fpca --seconds 5 --speed 1.4 --path arc:3,90 --seed 3 --out walk.bvh
    """
    from motionenv.models.synthesis import synthesize

    how = _checked(out, view, size)
    motion = synthesize(
        model, seconds, fps, seed=seed, speed=parsed_speed(speed), path=parsed_path(path),
        deviations=parsed_numbers(deviations, "--deviations"), **walk,
    )  # fmt: skip
    _save(motion, out, how)


def sample(
    out: Out,
    tree: Annotated[str, typer.Option(help="Name or file of the tree: see `motionenv fit tree`.")] = "mixed/tree",
    start: Annotated[str | None, typer.Option(help="Initial activity; by default any.")] = None,
    seconds: Annotated[float, typer.Option(help="Duration in seconds.")] = 10.0,
    temperature: Annotated[float, typer.Option(help="Near 0 the most similar motion follows, at 1 almost any.")] = 0.05,
    seed: Seed = 0, method: Annotated[str, typer.Option(help="Search: exact, or tree as in the paper.")] = "exact",
    activity: Annotated[str | None, typer.Option(help="Target activity.")] = None,
    heading: Annotated[float | None, typer.Option(help="Target heading in degrees; 90 is left.")] = None,
    speed: Annotated[float | None, typer.Option(help="Target speed [m/s].")] = None,
    blend: Annotated[bool, typer.Option("--blend/--no-blend", help="Blend transitions between clips.")] = True,
    contact: Annotated[bool, typer.Option("--contact/--no-contact", help="Keep stance feet in place.")] = True,
    view: View = "side", size: Size = "640x480",
) -> None:  # fmt: skip
    """Synthesise motion of any length from a motion tree, as a film or a motion file.

    Example: motionenv sample --tree mixed/tree --start walk --seconds 10 --temperature 0.5 --out run.mp4
    """
    from motionenv._core.precompilation import precompile
    from motionenv.models import Target, gait_model
    from motionenv.models.motion_tree import Options

    precompile("sample")
    how = _checked(out, view, size)
    target = Target(activity, None if heading is None else math.radians(heading), speed)
    with err.status(f"loading {tree}; the first time mixed/tree is made"):
        loaded = gait_model(tree)
    if not loaded.steerable:
        raise MotionError(f"{tree} is a {loaded.kind} model, not a motion tree: use `motionenv synth {tree}`")
    motion = loaded.generator(
        start, temperature=temperature, seed=seed, method=method, target=target, contact=contact,
        blend=Options.blend if blend else 0.0,
    ).motion(seconds)  # fmt: skip
    _save(motion, out, how)


def render(
    motion: Annotated[Path, typer.Argument(help="Motion file: .npz, or motion capture, which is retargeted.")],
    out: Annotated[Path, typer.Option(help="Output file: .mp4, .gif, .webp, or a folder for PNG frames.")],
    view: View = "side", size: Size = "640x480",
    points: Annotated[bool, typer.Option("--points", help="Point lights instead of a body.")] = False,
    still: Annotated[bool, typer.Option("--still", help="Use a static camera instead of a following one.")] = False,
    fps: Fps = None, unit: Unit = None, map_: Map = None, fill: Fill = False,
) -> None:  # fmt: skip
    """Render a motion to a film.

    Limbs that the capture doesn't show aren't drawn; --fill estimates them.
    Example: motionenv render walk.npz --view oblique --out walk.mp4
    """
    from motionenv.mocap import read_motion
    from motionenv.models import filling

    width, height = parsed_size(size)
    alpha = parsed_view(view)
    loaded = read_motion(motion, fps=fps, unit=unit, marker_map=marker_map(map_))
    loaded = filling.fill(loaded) if fill else loaded
    _film(loaded, out, alpha, width=width, height=height, points=points, follow=not still)
    typer.echo(f"{out}  {len(loaded.poses)} frames")


def _checked(out: Path, view: str, size: str) -> tuple[float, int, int]:
    """Angle, width and height of a film, before anything takes long: raises if `out` can't be written, too."""
    from motionenv.mocap.writing import check_suffix

    check_suffix(out, _FILMS)
    check_folder(out)
    return parsed_view(view), *parsed_size(size)


def _save(motion, out: Path, how: tuple[float, int, int]) -> None:
    """Write a motion as a film or a motion file."""
    from motionenv.mocap import write

    if out.suffix.lower() in _FILMS:
        alpha, width, height = how
        _film(motion, out, alpha, width=width, height=height)
    else:
        write(motion, out)
    typer.echo(f"{out}  {len(motion.poses)} frames, {motion.seconds:g} s at {motion.fps:g} fps")


def _film(motion, out: Path, alpha: float, **how) -> None:
    """Render a motion to a file."""
    from motionenv.render.video.encode import write_video
    from motionenv.render.video.film import film

    with progress("rendering", len(motion.poses)) as step:
        write_video(out, film(motion, alpha, **how), motion.fps, progress=step)
