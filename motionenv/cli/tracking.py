"""The `track` command."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from motionenv._core.validation import checked_choice, random_generator
from motionenv.cli._shared import Detector, Seed, Weights, check_folder, detected, note, parsed_numbers, progress
from motionenv.errors import GapError, MotionError

if TYPE_CHECKING:
    from motionenv.tracking import Film

_FILMS = {".mp4", ".gif", ".webp"}
_ENVS = {"walker": "motionenv/WalkerTracking-v1", "arm": "motionenv/ArmTracking-v1"}
_TRACKERS = ("fpca", "tree", "constant-velocity")
_SIZE, _FILMED = 128, 384  # image side of an environment without a level, and about that of its film [pixels]
_FILM_SIDE = 640  # [pixels] longest side of a video in the film; smaller videos are enlarged by a whole number
_LOST = 3  # exit code of a track that was lost at times
_OFF, _OFTEN = 0.5, 0.1  # [m] error from which a frame of an environment is lost, and share of such frames
_SHOWN = 30  # particles shown in the film


def track(
    out: Annotated[Path, typer.Option(help="Film of the track: .mp4, .gif or .webp.")],
    env: Annotated[str | None, typer.Option(
        help="Environment: walker, arm, or an id such as motionenv/WalkerTracking-Hard-v2.")] = None,
    video: Annotated[Path | None, typer.Option(
        help="Video to track instead: somebody who walks, a static camera.")] = None,
    camera: Annotated[Path | None, typer.Option(help="Camera of the video (.json, .toml); by default guessed.")] = None,
    which: Annotated[str | None, typer.Option(help="Name of the camera in a .toml file.")] = None,
    background: Annotated[Path | None, typer.Option(help="Video of the background without the person.")] = None,
    height: Annotated[float | None, typer.Option(
        help="Body height in a video [m]; by default estimated with --camera, else 1.75.")] = None,
    tracker: Annotated[str | None, typer.Option(
         help="Motion prior; of videos, in gaps: fpca (default), tree, constant-velocity (default of arms)." )] = None,
    model: Annotated[str | None, typer.Option(
        help="Name or file of the prior's model; by default a packaged one.")] = None,
    particles: Annotated[int, typer.Option(min=2, help="Number of particles.")] = 2000,
    start: Annotated[str | None, typer.Option(
        help="First pose in an environment: automatic (default), or given by the truth (arms).")] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Frames of an environment; by default its own.")] = None,
    smooth: Annotated[bool, typer.Option(
        "--smooth", help="Show and write what all frames together tell about each: fpca only.")] = False,
    seconds: Annotated[float | None, typer.Option(help="Longest duration of a video [s]; by default 60.")] = None,
    person: Annotated[str | None, typer.Option(
        help="Whom to follow in a video: a number, all in turn, or list (only print who is seen).")] = None,
    box: Annotated[str | None, typer.Option(help="X,Y,W,H in pixels: follow who is in this box of a video.")] = None,
    point: Annotated[str | None, typer.Option(help="X,Y in pixels: follow who is at this point of a video.")] = None,
    at: Annotated[float | None, typer.Option(help="Moment of --box or --point [s]; by default any.")] = None,
    region: Annotated[str | None, typer.Option(help="X,Y,W,H in pixels: follow only who is in this part.")] = None,
    detections: Annotated[Path | None, typer.Option(
        help="Keypoints of everybody in a video, a file or a folder; else detected.")] = None,
    detector: Detector = "blazepose",
    weights: Weights = None,
    fps: Annotated[float | None, typer.Option(
        help="Frame rate at which to track a video; by default its own, up to 31.")] = None,
    motion: Annotated[Path | None, typer.Option(
        help="Also write the track: .npz, .bvh, .c3d, .csv, .glb, .mot or .trc.")] = None,
    seed: Seed = 0,
) -> None:  # fmt: skip
    """Track a person with a particle filter, and film the track.

    In an environment the tracker observes what the id says, in walker and arm exact silhouettes, and is the agent of
    motionenv evaluate unless options say otherwise; in a video it is the moving foreground, and the keypoints that a
    detector sees (pip install 'motionenv[detect]'), which choose whom to follow and which side is left. The film shows
    the particles as thin lines, the expected pose, the body from another view, and the error; for a video, the overlap
    of pose and outline instead of the error, and LOST in frames in which the person isn't followed.
    Exit codes: 0, followed wherever the person is wholly in the picture; 3, lost at times (of a video, the file of
    --motion has NaN there, or the longest stretch if its format has no gaps; in an environment, joints are off by half
    a metre in a tenth of the frames), with the reasons on stderr; 2, nothing could be tracked.
    Example: motionenv track --env walker --particles 1000 --out track.mp4
    """
    if (env is None) == (video is None):
        raise MotionError("give either --env, such as walker, or --video: exactly one of them")
    if tracker is not None:
        checked_choice(tracker, "--tracker", _TRACKERS)
    if smooth and tracker not in (None, "fpca"):
        raise MotionError(f"--smooth needs --tracker fpca, got {tracker}")
    _check_outputs(out, motion)
    if video is None:
        of_videos = {
            "camera": camera, "which": which, "background": background, "height": height, "seconds": seconds,
            "fps": fps, "person": person, "box": box, "point": point, "at": at, "region": region,
            "detections": detections, "weights": weights,
        }  # fmt: skip
        _refuse(of_videos, "for --video only")
        _track_env(_Episode(str(env), tracker, model, particles, start, frames, smooth, seed), out, motion)
        return
    from motionenv.tracking import Film

    _refuse({"start": start, "frames": frames}, "for --env only; a video is tracked as a whole")
    areas = {
        name: parsed_numbers(text, f"--{name}") for name, text in (("box", box), ("point", point), ("region", region))
    }
    seconds = 60.0 if seconds is None else seconds
    film = Film(video, fps, seconds, background, areas["region"], detections)
    known = _camera(camera, which)
    film = _seen(film, detector, weights)
    choice = {"height": height, "box": areas["box"], "point": areas["point"], "at": at}
    choice |= {"particles": particles, "smooth": smooth, "seed": seed}
    people = _people(film, person)
    lost = [
        _track_video(film, known, _made(tracker or "fpca", model), choice | {"person": number}, *files)
        for number, files in ((number, _named(out, motion, number, people)) for number in people)
    ]
    if any(lost):
        raise typer.Exit(_LOST)


def _camera(path: Path | None, which: str | None) -> Any:
    from motionenv.render.cameras import read_camera

    if path is None:
        _refuse({"which": which}, "needs --camera")
        return None
    return read_camera(path, which)


def _seen(film: "Film", detector: str, weights: Path | None) -> "Film":
    """The film with its detections, or those of the detector."""
    from motionenv.mocap.keypoints.points2d import points_of

    if film.detections is not None:
        return film
    found = detected(Path(film.path), detector, weights, film.seconds)
    return replace(film, detections=points_of(film.path, *found))


def _people(film: "Film", person: str | None) -> list[int | None]:
    """Numbers of everybody whom --person asks for, None for the best seen; prints who is seen and ends for "list"."""
    from motionenv.tracking import find_people

    if person is None or person.isdecimal():
        return [None if person is None else int(person)]
    if person not in ("all", "list"):
        raise MotionError(f"--person must be a number, all or list, got {person!r}")
    found = find_people(film)
    if person == "list":
        typer.echo("\n".join(str(one) for one in found) or "nobody is seen for long")
        raise typer.Exit
    if not found:
        raise MotionError("--person all: nobody is seen for long enough to follow")
    return [one.number for one in found]


def _named(out: Path, motion: Path | None, number: int | None, people: list) -> tuple[Path, Path | None]:
    """The output files of one of several people: with the person's number."""
    if len(people) == 1:
        return out, motion
    return out.with_stem(f"{out.stem}-{number}"), motion and motion.with_stem(f"{motion.stem}-{number}")


def _refuse(options: dict[str, Any], why: str) -> None:
    """Reject options that would have no effect."""
    if wrong := [f"--{name}" for name, value in options.items() if value is not None]:
        raise MotionError(f"{', '.join(wrong)}: {why}")


def _check_outputs(out: Path, motion: Path | None) -> None:
    """Validate output paths, before any work."""
    from motionenv.mocap.writing import check_suffix

    if out.suffix.lower() not in _FILMS:
        raise MotionError(f"--out must end in {', '.join(sorted(_FILMS))}, got {out}")
    check_folder(out)
    if motion is not None:
        check_suffix(motion)
        check_folder(motion)


def _made(tracker: str, model: str | None, *, arm: bool = False) -> Callable[..., Any]:
    """Factory of the tracker's prior, for a body and a frame rate."""
    from motionenv.tracking import FPCAPrior, TreePrior, VelocityPrior

    if arm and tracker == "fpca":
        raise MotionError("--tracker must be constant-velocity or tree for --env arm, got fpca")
    if arm and tracker == "tree" and model is None:
        raise MotionError("--tracker tree needs a tree of the right arm for --env arm: give its file as --model")
    part = "right_arm" if arm else "body"

    def make(skeleton, fps: float):
        if tracker == "tree":
            return TreePrior(model or "mixed/tree", skeleton=skeleton, fps=fps)
        if tracker == "constant-velocity":
            return VelocityPrior(skeleton=skeleton, fps=fps, part=part)
        return FPCAPrior(model or "walk/fpca", skeleton=skeleton, fps=fps)

    return make


def _track_video(film: "Film", camera, prior, options: dict[str, Any], out: Path, motion_out) -> bool:
    """Track a person in a film, with the given `options` of `track_video`; returns whether the track was lost."""
    from motionenv.render.video.encode import write_video
    from motionenv.render.video.tracking_film import marked, track_film
    from motionenv.tracking import track_video

    with progress("following", None) as step:
        found = track_video(film, camera, prior=prior, progress=lambda done, total: step(done), **options)
    poses, skeleton, fps = found.motion.poses, found.motion.skeleton, found.motion.fps
    pictures, seen = _pictures(film, found)
    lost = ~found.followed
    for away in (loss for loss in found.losses if loss.left):
        lost[away.first : away.last + 1] = False
    shown = track_film(
        marked(pictures, lost, "LOST"), seen, poses, found.particles, skeleton, found.overlap,
        label="overlap of pose and outline", most=1.0,
    )  # fmt: skip
    with progress("filming", len(found.overlap)) as step:
        write_video(out, shown, fps, progress=step)
    followed = np.flatnonzero(found.followed)
    _report(out, found, followed)
    if motion_out is not None:
        _write_followed(motion_out, found, followed, Path(film.path).stem)
    return bool(found.lost)


def _write_followed(out: Path, found, followed: np.ndarray, name: str) -> None:
    """Write the track from its first to its last followed frame; its longest stretch, if the format has no gaps."""
    from motionenv.mocap import write
    from motionenv.types import Motion

    if not len(followed):
        note(f"{out} isn't written: nobody was followed")
        return
    poses, skeleton, fps = found.motion.poses, found.motion.skeleton, found.motion.fps
    walked = Motion(poses[followed[0] : followed[-1] + 1], skeleton, fps, name)
    try:
        write(walked, out)
    except GapError:
        longest = max(np.split(followed, np.flatnonzero(np.diff(followed) > 1) + 1), key=len)
        walked = Motion(poses[longest], skeleton, fps, name)
        write(walked, out)
        note(f"{out} can't hold gaps: it has only the longest stretch, from frame {longest[0]}")
    typer.echo(f"{out}  {len(walked.poses)} frames, {walked.seconds:.2f} s at {walked.fps:g} fps")


def _report(out: Path, found, followed: np.ndarray) -> None:
    """Print whom a track follows, where (frames, in order), and where it doesn't and why."""
    present = len(found.overlap) - sum(loss.last - loss.first + 1 for loss in found.losses if loss.left)
    typer.echo(f"{out}  {len(followed)} of {present} frames followed in which the person is wholly in the picture")
    typer.echo(f"followed {found.person}")
    if len(followed):
        typer.echo(f"mean overlap of pose and outline {found.overlap[followed].mean():.2f}")
    for loss in found.losses:
        if not loss.left:
            note(f"LOST in frames {loss.first} to {loss.last}: {loss.reason}")
    if found.guessed:
        x, y, z = found.camera.centre
        person = f"for a person of {found.motion.skeleton.height:.2f} m"
        typer.echo(f"camera guessed: {np.hypot(x, y):.1f} m away, {z:.1f} m high, {person}")


def _pictures(film: "Film", found) -> tuple[Iterator[np.ndarray], Any]:
    """A video's frames in the film's size (even, for all players), and their camera."""
    from motionenv.render.request import enlarged
    from motionenv.tracking.video.detection import resized

    camera, share = found.camera, _FILM_SIDE / max(found.camera.width, found.camera.height)
    width = round(camera.width * min(1.0, share))
    width = max(16, width - width % 2)
    pictures = film.frames(found.motion.fps, width)
    seen = resized(camera, width, round(camera.height * width / camera.width))
    return _enlarged(pictures, max(1, int(share))), enlarged(seen, max(1, int(share)))


def _enlarged(pictures: Iterable[np.ndarray], times: int) -> Iterator[np.ndarray]:
    """Images (height, width, 3) with `times` × `times` pixels for each one."""
    return (p.repeat(times, axis=0).repeat(times, axis=1) for p in pictures)


def _track_env(played: "_Episode", out: Path, motion_out: Path | None) -> None:
    """Run one episode of an environment, and film it."""
    from motionenv.mocap import write
    from motionenv.render.request import enlarged
    from motionenv.render.video.encode import write_video
    from motionenv.render.video.tracking_film import track_film
    from motionenv.types import Motion

    with progress("following", played.env.world.horizon) as step:
        pictures, cameras, found, drawn, off = zip(*played.frames(step), strict=True)
    poses, errors, times = np.array(found), np.array(off), max(1, round(_FILMED / cameras[0].width))
    shown = list(drawn)
    if played.smooth:
        poses, shown, errors = played.smoothed(poses, shown, errors)
    film = track_film(
        _enlarged(pictures, times), [enlarged(c, times) for c in cameras], poses, shown, played.skeleton,
        1000 * errors, label="error per joint [mm]",
    )  # fmt: skip
    with progress("filming", len(poses)) as step:
        write_video(out, film, played.fps, progress=step)
    typer.echo(f"{out}  {len(poses)} frames, {1000 * errors.mean():.0f} mm per joint on average")
    if motion_out is not None:
        write(Motion(poses, played.skeleton, played.fps, played.name), motion_out)
        typer.echo(f"{motion_out}  {len(poses)} frames at {played.fps:g} fps")
    if (lost := int((errors > _OFF).sum())) > _OFTEN * len(errors):
        note(f"LOST in {lost} of {len(errors)} frames: joints are off by more than {_OFF:g} m on average")
        raise typer.Exit(_LOST)


def _environment(env: str, frames: int | None) -> Any:
    """The environment of pictures that --env names, which also gives colours for the film."""
    from motionenv import envs
    from motionenv.envs.tasks import ENVIRONMENTS, TASKS

    name, settings = _ENVS.get(env, env), {"size": _SIZE, "observation": "mask"}
    known = [one for one in (*ENVIRONMENTS, *TASKS) if "Walker" in one or "Arm" in one]
    checked_choice(env, "--env", (*_ENVS, *known))
    if name in TASKS:
        name, settings = TASKS[name].env, dict(TASKS[name].settings)
    if settings["observation"] == "mask":
        settings["observation"] = ("mask", "rgb")
    if frames is not None:
        settings["horizon"] = frames
    return getattr(envs, ENVIRONMENTS[name].partition(":")[2])(**settings)


class _Episode:
    """One episode of an environment (walker, arm or an id), and the data for its film."""

    def __init__(
        self, env: str, tracker: str | None, model: str | None, particles: int, start: str | None, frames: int | None,
        smooth: bool, seed: int,
    ):  # fmt: skip
        from motionenv import envs
        from motionenv.envs.agents import TrackingAgent, truth_start
        from motionenv.envs.agents.particle_filter import adults_prior

        self.env: Any = _environment(env, frames)
        arm = type(self.env) is envs.ArmTracking
        if start not in (None, "automatic", "given"):
            raise MotionError(f"--start must be automatic or given, got {start!r}")
        self.fps = self.env.world.fps
        if tracker or model or arm:
            prior = _made(tracker or ("constant-velocity" if arm else "fpca"), model, arm=arm)(None, self.fps)
        else:
            prior = adults_prior(self.fps)
        self.skeleton = prior.skeleton
        first = truth_start if start == "given" or (arm and start is None) else None
        self.agent = TrackingAgent(self.env, prior, particles, seed=seed, start=first, keep=smooth)
        self.name, self.smooth, self.seed, self.rng = env, smooth, seed, random_generator(seed)
        self.truths: list[dict[str, Any]] = []

    def frames(self, step) -> Iterator[tuple]:
        """Run the episode: picture, camera, expected pose, drawn poses and error [m] of each frame; calls `step`."""
        from motionenv.tracking.priors.base import systematic

        observation, _ = self.env.reset(seed=self.seed)
        self.agent.reset(observation)
        ended = False
        while not ended:
            picture = np.array(observation["rgb"] if isinstance(observation, dict) else observation)
            self.truths.append(truth := self.env.truth())
            camera, action = truth["camera"], self.agent.act(observation)
            (belief,) = self.agent.beliefs
            drawn = belief.poses[systematic(np.exp(belief.log_weights), _SHOWN, self.rng)]
            observation, _, terminated, truncated, info = self.env.step(action)
            yield picture, camera, belief.mean, drawn, float(info["error"])
            ended = terminated or truncated
            step()

    def smoothed(self, poses: np.ndarray, drawn: list, errors: np.ndarray) -> tuple[np.ndarray, list, np.ndarray]:
        """The poses (frames, 25), drawn poses and errors [m] that were filtered, smoothed since the track began."""
        (beliefs,) = self.agent.smoothed()
        first = len(poses) - len(beliefs)
        joints = np.array([belief.expected_joints(self.skeleton) for belief in beliefs])
        true = np.array([truth["joints"] for truth in self.truths[first:]])
        off = np.linalg.norm(joints - true, axis=-1).mean(axis=-1)
        means, shown = [belief.mean for belief in beliefs], [belief.poses[:_SHOWN] for belief in beliefs]
        return np.array([*poses[:first], *means]), drawn[:first] + shown, np.concatenate([errors[:first], off])
