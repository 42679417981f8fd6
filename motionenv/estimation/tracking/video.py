"""Following a person through a real film, without any truth: `track_video`.

    film → background → foreground → camera (if unknown) → start → filter

The camera stands still, and one person walks through the picture. Where the film begins before anybody is seen whole,
or ends after, poses are NaN.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from motionenv.body import from_height
from motionenv.errors import FormatError, MotionError
from motionenv.estimation.background import picture
from motionenv.estimation.observation import ObservationModel
from motionenv.estimation.tracking.filters import ParticleFilter, check_options
from motionenv.estimation.tracking.foreground import FilmBackground
from motionenv.estimation.tracking.fpca_prior import FPCAPrior
from motionenv.estimation.tracking.priors import Prior, systematic
from motionenv.estimation.tracking.sightings import resized, side_camera, sightings, span
from motionenv.estimation.tracking.start import automatic_start
from motionenv.types import Camera, Motion, Skeleton, checked_fps

_SIDE = 192  # pixels of the longer side of the pictures that are looked at
_START = 1.0  # [s] of the film that tell where the track begins
_WIDE = 6000  # hypotheses of each attempt's start
_SHOWN = 30  # particles that are kept of each frame
_MISSES, _ALARMS = 0.25, 0.1  # foreground of films has holes, and clutter around
#: Makes a prior for a body and frames per second.
MakePrior = Callable[[Skeleton, float], Prior]


@dataclass(frozen=True, eq=False)
class VideoTrack:
    """What `track_video` found.

    Attributes:
        motion: expected poses (T, 25) at the film's frames; NaN where nobody is followed.
        particles: (T, particles, 25), as likely as each other; NaN too.
        effective: (T,) effective sample sizes.
        overlap: (T,) of the expected silhouette with the foreground: intersection over union, 0 to 1.
        camera: given or guessed, of the film's own picture size.
        guessed: whether the camera is a guess, so that lengths are relative to the assumed height.
    """

    motion: Motion
    particles: np.ndarray
    effective: np.ndarray
    overlap: np.ndarray
    camera: Camera
    guessed: bool

    @property
    def followed(self) -> np.ndarray:
        """(T,) whether a frame has a pose."""
        return np.isfinite(self.motion.poses[:, 0])


def track_video(
    path,
    camera: Camera | None = None,
    *,
    height: float = 1.75,
    prior: MakePrior | None = None,
    particles: int = 2000,
    layers: int = 2,
    attempts: int = 3,
    fps: float = 30.0,
    seconds: float = 60.0,
    background=None,
    seed=None,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> VideoTrack:
    """Follow the person in a film.

    Args:
        path: of the film, anything that ffmpeg reads.
        camera: that made it, standing still, the ground at z = 0; None guesses one that stands at the side.
        height: of the person [m].
        prior: makes the prior of a body and a rate; None is the `FPCAPrior`.
        particles: of the filter.
        layers: of annealing.
        attempts: how often to start and follow anew; the one with the highest evidence is returned. Silhouettes from
            the side hardly tell left from right, and the whole film says more of that than its beginning.
        fps: frames per second to track at; the film's nearest ones are taken.
        seconds: how much of the film.
        background: film, or pictures uint8 (T, h, w, 3), three at least and of the film's proportions, of the same view
            without the person, noise and all; None takes the median over the film, which is right where the person
            stands in fewer than half of the frames.
        seed: int or Generator.
        threads: of the likelihood, the same results with any number; None is one per core.
        progress: called with the number of frames followed, and of all that will be.

    Raises:
        FormatError: not a film, or broken.
        MotionError: nobody moves in it, a camera of other proportions, or an argument out of range.
    """
    if isinstance(attempts, bool) or attempts != int(attempts) or attempts < 1:
        raise MotionError(f"attempts must be a whole number from 1, got {attempts!r}")
    check_options(particles, layers=layers)
    fps, skeleton, rng = checked_fps(fps), from_height(height), np.random.default_rng(seed)
    foregrounds, size = _foregrounds(path, fps, seconds, background)
    rows, columns = foregrounds.shape[1:]
    boxes = sightings(foregrounds)
    first, last = span(boxes, columns)
    full = side_camera(boxes[first:last], skeleton, columns, rows) if camera is None else camera
    view = resized(full, columns, rows)
    far = (
        np.sqrt(abs(np.linalg.det(view.K[:2, :2]))) * height / np.nanmedian(boxes[first:last, 3] - boxes[first:last, 2])
    )
    likelihood = ObservationModel(
        view, skeleton, misses=_MISSES, false_alarms=_ALARMS, distance=float(far), threads=threads
    )
    made = FPCAPrior(skeleton=skeleton, fps=fps) if prior is None else prior(skeleton, fps)
    film = foregrounds[first:last]
    total = attempts * len(film)
    ticks = (lambda done: None) if progress is None else (lambda done: progress(done, total))
    best = max(
        (_followed(made, likelihood, film, particles, layers, rng, lambda n, k=k: ticks(k * len(film) + n))
         for k in range(int(attempts))),
        key=lambda found: found.evidence,
    )  # fmt: skip
    frames = (first, len(foregrounds) - last)
    poses, shown, effective, overlap = (
        np.pad(part, (frames, *[(0, 0)] * (part.ndim - 1)), constant_values=np.nan)
        for part in (best.poses, best.particles, best.effective, best.overlap)
    )
    motion = Motion(poses, skeleton, fps, f"{path}")
    return VideoTrack(motion, shown, effective, overlap, resized(full, *size), camera is None)


@dataclass(frozen=True, eq=False)
class _Followed:
    """One attempt: expected poses (T, 25), particles (T, _SHOWN, 25), and what they are worth."""

    poses: np.ndarray
    particles: np.ndarray
    effective: np.ndarray
    overlap: np.ndarray
    evidence: float


def _followed(prior: Prior, likelihood: ObservationModel, film, particles: int, layers: int, rng, tick) -> _Followed:
    """Find where to start and follow to the end of the `film` (T, rows, columns) of foregrounds."""
    observations = [{"mask": f} for f in film]
    looked = observations[: max(1, round(_START * prior.fps))]
    start = automatic_start(likelihood, looked, fps=prior.fps, n=_WIDE, seed=rng)
    tracker = ParticleFilter(prior, likelihood, particles, layers=layers, seed=rng)
    tracker.start(start)
    poses, overlap = np.empty((len(film), 25)), np.empty(len(film))
    shown, effective = np.empty((len(film), _SHOWN, 25)), np.empty(len(film))
    evidence = 0.0
    for i, observation in enumerate(observations):
        belief = tracker.step(**observation)
        evidence += belief.log_evidence
        poses[i], effective[i] = belief.mean, belief.effective
        shown[i] = belief.poses[systematic(np.exp(belief.log_weights), _SHOWN, rng)]
        overlap[i] = _overlap(poses[i], likelihood.skeleton, likelihood.camera, film[i])
        tick(i + 1)
    return _Followed(poses, shown, effective, overlap, evidence)


def _foregrounds(path, fps: float, seconds: float, background) -> tuple[np.ndarray, tuple[int, int]]:
    """Probabilities (T, rows, columns) of the film in small, and the film's own (width, height)."""
    from motionenv.render.reading import narrowed, read_frames, video_info

    info = video_info(path)
    width = max(16, round(info.width * min(1.0, _SIDE / max(info.width, info.height))))
    frames = list(read_frames(path, fps=fps, width=width, seconds=seconds))
    if len(frames) < 3:
        raise FormatError(path, f"holds {len(frames)} frames at {fps:g} fps, too few to follow anybody")
    if background is None:
        without = frames
    elif isinstance(background, np.ndarray):
        without = [narrowed(picture(p), width) for p in background]
    else:
        without = list(read_frames(background, fps=fps, width=width, seconds=seconds))
    film = FilmBackground(without)
    return np.stack([film.foreground(f) for f in frames]), (info.width, info.height)


def _overlap(pose: np.ndarray, skeleton: Skeleton, camera: Camera, foreground: np.ndarray) -> float:
    """Intersection over union of a pose's silhouette and the foreground (height, width)."""
    from motionenv.render import render

    body, seen = render(pose, skeleton, camera).limbs > 0, foreground > 0.5
    return float((body & seen).sum() / max((body | seen).sum(), 1))
