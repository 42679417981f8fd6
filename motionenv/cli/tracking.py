"""The command that follows a person through pictures: track."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from motionenv.cli._shared import Seed, check_folder, progress
from motionenv.errors import MotionError

_FILMS = {".mp4", ".gif", ".webp"}
_ENVS = {"walker": "WalkerTracking", "arm": "ArmTracking"}
_TRACKERS = ("fpca", "tree", "constant-velocity", "mixture")
_SIZE, _ENLARGED = 128, 3  # pixels of an environment's pictures, and how many times larger the film shows them
_FILM_SIDE = 640  # pixels of the longer side of a video in the film; smaller ones grow by a whole number up to it
_SHOWN = 30  # particles in the film


def track(
    out: Annotated[Path, typer.Option(help="The film of the track: .mp4, .gif or .webp.")],
    env: Annotated[str | None, typer.Option(help="walker, arm, or an environment's id.")] = None,
    video: Annotated[
        Path | None, typer.Option(help="A real film instead: one person, a camera that stands still.")
    ] = None,
    camera: Annotated[Path | None, typer.Option(help="The video's camera (.json, .toml); by default guessed.")] = None,
    which: Annotated[str | None, typer.Option(help="Which of several cameras in a .toml.")] = None,
    background: Annotated[Path | None, typer.Option(help="Film of the video's background without the person.")] = None,
    height: Annotated[
        float | None, typer.Option(help="Of a video's person, in metres; by default measured with --camera, else 1.75.")
    ] = None,
    tracker: Annotated[str, typer.Option(help="fpca, tree, constant-velocity or mixture.")] = "fpca",
    model: Annotated[
        str | None, typer.Option(help="The tracker's model, a name or a file; by default its own.")
    ] = None,
    particles: Annotated[int, typer.Option(min=2, help="How many.")] = 2000,
    start: Annotated[
        str | None, typer.Option(help="Of an environment: automatic, the default, or given by its truth.")
    ] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Of an environment; by default 90.")] = None,
    seconds: Annotated[float | None, typer.Option(help="Of a video, at most; by default 60.")] = None,
    fps: Annotated[
        float | None, typer.Option(help="Frames per second at which a video is followed; by default its own, up to 31.")
    ] = None,
    motion: Annotated[Path | None, typer.Option(help="Write the track too: .npz, .bvh, .c3d, .csv or .glb.")] = None,
    seed: Seed = 0,
) -> None:
    """Follow a person through pictures with a particle filter, and film the track.

    Of an environment the tracker sees exact silhouettes, of a video what moves before its background. Shown are the
    particles, thin, the expected figure, the body from beside, and the error; of a video the overlap of figure and
    foreground, for its truth isn't known.
    Example: motionenv track --env walker --tracker fpca --particles 1000 --out track.mp4
    """
    if (env is None) == (video is None):
        raise MotionError("give --env, such as walker, or --video, a film: one of them")
    if tracker not in _TRACKERS:
        raise MotionError(f"tracker must be one of {', '.join(_TRACKERS)}, got {tracker!r}")
    _check_outputs(out, motion)
    if video is None:
        of_videos = {
            "camera": camera, "which": which, "background": background, "height": height, "seconds": seconds, "fps": fps
        }  # fmt: skip
        _refuse(of_videos, "for --video only; an environment knows its own")
        start, frames = "automatic" if start is None else start, 90 if frames is None else frames
        _track_env(str(env), tracker, model, particles, start, frames, out, motion, seed)
        return
    _refuse({"start": start, "frames": frames}, "for --env only; a video is followed from its beginning to its end")
    if camera is None:
        _refuse({"which": which}, "goes with --camera, a file of several")
    given = {"height": height, "seconds": seconds, "fps": fps, "background": background}
    options = {name: value for name, value in given.items() if value is not None}
    _track_video(video, camera, which, tracker, model, particles, options, out, motion, seed)


def _refuse(options: dict[str, Any], why: str) -> None:
    """Refuse options that would be without effect.

    Raises:
        MotionError: one of them was given; names it.
    """
    if wrong := [f"--{name}" for name, value in options.items() if value is not None]:
        raise MotionError(f"{', '.join(wrong)}: {why}")


def _check_outputs(out: Path, motion: Path | None) -> None:
    """Refuse files that can't be written, before any work.

    Raises:
        MotionError: another suffix, or no such folder.
    """
    from motionenv.mocap.writing import check_suffix

    if out.suffix.lower() not in _FILMS:
        raise MotionError(f"out must end in {', '.join(sorted(_FILMS))}, got {out}")
    check_folder(out)
    if motion is not None:
        check_suffix(motion)
        check_folder(motion)


def _made(tracker: str, model: str | None, *, arm: bool = False) -> Callable[..., Any]:
    """Makes the tracker's prior of a body and frames per second."""
    from motionenv.estimation.tracking import FPCAPrior, MixturePrior, TreePrior, VelocityPrior

    if arm and tracker in ("fpca", "mixture"):
        raise MotionError(f"--tracker {tracker} knows whole walkers, no arms: take constant-velocity, or tree")
    if arm and tracker == "tree" and model is None:
        raise MotionError("--tracker tree needs a tree of the right arm here: give its file as --model")
    part = "right_arm" if arm else "body"

    def make(skeleton, fps: float):
        if tracker == "tree":
            return TreePrior(model or "mixed/tree", skeleton=skeleton, fps=fps)
        if tracker == "constant-velocity":
            return VelocityPrior(skeleton=skeleton, fps=fps, part=part)
        learned = FPCAPrior(model or "walk/fpca", skeleton=skeleton, fps=fps)
        if tracker == "fpca":
            return learned
        return MixturePrior(learned, VelocityPrior(skeleton=learned.skeleton, fps=fps))

    return make


def _track_video(video, camera, which, tracker, model, particles, options, out, motion_out, seed) -> None:
    """Follow somebody through a film, with the `options` of `track_video` that were given."""
    from motionenv.estimation.tracking.video import track_video
    from motionenv.mocap import write
    from motionenv.render.camera_files import read_camera
    from motionenv.render.trackfilm import track_film
    from motionenv.render.video import write_video
    from motionenv.types import Motion

    known = None if camera is None else read_camera(camera, which)
    with progress("following", None) as step:
        found = track_video(
            video, known, prior=_made(tracker, model), particles=particles, seed=seed,
            progress=lambda done, total: step(done), **options,
        )  # fmt: skip
    followed = np.flatnonzero(found.followed)
    first, last = int(followed[0]), int(followed[-1]) + 1
    walked = Motion(found.motion.poses[first:last], found.motion.skeleton, found.motion.fps, video.stem)
    pictures, seen = _pictures(video, found, options.get("seconds", 60.0))
    film = track_film(
        pictures, seen, found.motion.poses, found.particles, walked.skeleton, found.overlap,
        label="overlap of figure and foreground", most=1.0,
    )  # fmt: skip
    with progress("filming", len(found.overlap)) as step:
        write_video(out, film, walked.fps, progress=step)
    typer.echo(f"{out}  {len(walked.poses)} of {len(found.overlap)} frames followed, from frame {first} on")
    typer.echo(f"overlap of figure and foreground {np.nanmean(found.overlap):.2f} on average")
    if found.guessed:
        x, y, z = found.camera.centre
        person = f"for a person of {walked.skeleton.height:.2f} m"
        typer.echo(f"camera guessed: {np.hypot(x, y):.1f} m away, {z:.1f} m high, {person}")
    if motion_out is not None:
        write(walked, motion_out)
        typer.echo(f"{motion_out}  {len(walked.poses)} frames, {walked.seconds:.2f} s at {walked.fps:g} fps")


def _pictures(video: Path, found, seconds: float) -> tuple[Iterator[np.ndarray], Any]:
    """A video's pictures in the film's size, even ones of which suit all players, and their camera."""
    from motionenv.estimation.tracking.sightings import resized
    from motionenv.render.batch import enlarged
    from motionenv.render.reading import read_frames

    camera, share = found.camera, _FILM_SIDE / max(found.camera.width, found.camera.height)
    width = round(camera.width * min(1.0, share))
    width = max(16, width - width % 2)
    pictures = read_frames(video, fps=found.motion.fps, width=width, seconds=seconds)
    seen = resized(camera, width, round(camera.height * width / camera.width))
    return _enlarged(pictures, max(1, int(share))), enlarged(seen, max(1, int(share)))


def _enlarged(pictures: Iterable[np.ndarray], times: int) -> Iterator[np.ndarray]:
    """Pictures (height, width, 3) with `times` × `times` pixels for each one."""
    return (p.repeat(times, axis=0).repeat(times, axis=1) for p in pictures)


def _track_env(env, tracker, model, particles, start, frames, out, motion_out, seed) -> None:
    """Play one episode of an environment."""
    from motionenv.mocap import write
    from motionenv.render.batch import enlarged
    from motionenv.render.trackfilm import track_film
    from motionenv.render.video import write_video
    from motionenv.types import Motion

    if start not in ("automatic", "given"):
        raise MotionError(f"start must be automatic or given, got {start!r}")
    played = _Episode(env, tracker, model, particles, start, frames, seed)
    with progress("following", frames) as step:
        played.play(step)
    poses, errors = np.array(played.poses), np.array(played.errors)
    cameras = [enlarged(c, _ENLARGED) for c in played.cameras]
    pictures = _enlarged(played.pictures, _ENLARGED)
    film = track_film(
        pictures, cameras, poses, played.particles, played.skeleton, 1000 * errors, label="error per joint [mm]"
    )
    with progress("filming", len(poses)) as step:
        write_video(out, film, played.fps, progress=step)
    typer.echo(f"{out}  {len(poses)} frames, {1000 * errors.mean():.0f} mm per joint on average")
    if motion_out is not None:
        write(Motion(poses, played.skeleton, played.fps, env), motion_out)
        typer.echo(f"{motion_out}  {len(poses)} frames at {played.fps:g} fps")


class _Episode:
    """One episode of an environment, and what is filmed of it.

    Args:
        env: walker, arm or an id.
        tracker: its prior.
        model: of the prior, or None.
        particles: how many.
        start: automatic or given.
        frames: horizon.
        seed: of environment and filter.
    """

    def __init__(self, env: str, tracker: str, model: str | None, particles: int, start: str, frames: int, seed: int):
        from motionenv import envs
        from motionenv.estimation.tracking import TrackingAgent, told

        kind = _ENVS.get(env, env.removeprefix("motionenv/").removesuffix("-v0"))
        if kind not in _ENVS.values():
            raise MotionError(f"no environment of pictures is called {env!r}: take walker, arm, or the id of one")
        make = _made(tracker, model, arm=kind == "ArmTracking")
        made: Any = getattr(envs, kind)(size=_SIZE, observation=("mask", "rgb"), horizon=frames)
        self.env, self.fps = made, made.unwrapped.world.fps
        prior = make(None, self.fps)
        self.skeleton = prior.skeleton
        self.agent = TrackingAgent(made, prior, particles, seed=seed, start=told if start == "given" else None)
        self.seed, self.rng = seed, np.random.default_rng(seed)
        self.poses: list[np.ndarray] = []
        self.particles: list[np.ndarray] = []
        self.pictures: list[np.ndarray] = []
        self.errors: list[float] = []
        self.cameras: list[Any] = []

    def play(self, step) -> None:
        """Play it, `step` after each frame."""
        from motionenv.estimation.tracking.priors import systematic

        observation, _ = self.env.reset(seed=self.seed)
        self.agent.reset(observation)
        ended = False
        while not ended:
            self.pictures.append(np.array(observation["rgb"]))
            self.cameras.append(self.env.unwrapped.truth()["camera"])
            action = self.agent.act(observation)
            (belief,) = self.agent.beliefs
            self.poses.append(belief.mean)
            self.particles.append(belief.poses[systematic(np.exp(belief.log_weights), _SHOWN, self.rng)])
            observation, _, terminated, truncated, info = self.env.step(action)
            self.errors.append(float(info["error"]))
            ended = terminated or truncated
            step()
