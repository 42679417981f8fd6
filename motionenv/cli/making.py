"""Commands that make motion and pictures: demo, synth, sample, render."""

from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import Fps, Height, Seed, Speed, Unit, parsed_size, parsed_view, progress


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
) -> None:
    """Synthesise a walk into a motion file.

    Example: motionenv synth walk/fpca --seconds 5 --speed 1.4 --seed 3 --out walk.bvh
    """
    from motionenv.mocap import write
    from motionenv.models.synthesis import synthesize

    motion = synthesize(model, seconds, fps, seed=seed, speed=speed, height=height, phase=phase, variation=variation)
    write(motion, out)
    typer.echo(f"{out}  {motion.poses.shape[0]} frames, {motion.seconds:g} s at {motion.fps:g} fps")


def render(
    motion: Annotated[Path, typer.Argument(help="A motion file: ours (.npz), or capture to retarget.")],
    out: Annotated[Path, typer.Option(help="Where to: .mp4, .gif, .webp, or a folder name for PNG frames.")],
    view: Annotated[str, typer.Option(help="side, front, oblique, or an angle in degrees.")] = "side",
    size: Annotated[str, typer.Option(help="Picture size, WIDTHxHEIGHT.")] = "640x480",
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
    from motionenv.render.film import film
    from motionenv.render.video import write_video

    width, height = parsed_size(size)
    alpha = parsed_view(view)
    loaded = read_motion(motion, fps=fps, unit=unit)
    frames = film(loaded, alpha, width=width, height=height, points=points, engine=engine, follow=not still)
    with progress("rendering", len(loaded.poses)) as step:
        write_video(out, frames, loaded.fps, progress=step)
    typer.echo(f"{out}  {len(loaded.poses)} frames")
