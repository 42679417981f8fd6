"""Following a person through a real film, without any truth: `track_video`.

    film → background → foreground → camera (if unknown) → start → filter, there and back; the best of some attempts

The camera stands still, and one person walks through the picture. Where the film begins before anybody is seen whole,
or ends after, poses are NaN.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from motionenv.body import from_height
from motionenv.errors import FormatError, MotionError
from motionenv.estimation.appearance import colour_bins
from motionenv.estimation.background import picture
from motionenv.estimation.numeric import as_number, checked_whole
from motionenv.estimation.observation import ObservationModel
from motionenv.estimation.tracking.filters import check_options
from motionenv.estimation.tracking.following import Follower
from motionenv.estimation.tracking.foreground import FilmBackground
from motionenv.estimation.tracking.fpca_prior import FPCAPrior
from motionenv.estimation.tracking.mixture import MixturePrior
from motionenv.estimation.tracking.priors import Prior
from motionenv.estimation.tracking.sightings import departure, resized, side_camera, sightings, span, standing_height
from motionenv.estimation.tracking.velocity_prior import VelocityPrior
from motionenv.types import Camera, Motion, Skeleton, checked_fps

_SIDE = 192  # pixels of the longer side of the pictures that are looked at at first
_TALL = 90.0  # [pixels] that a person should be high; in larger films of small people the pictures are made larger
_MOST_LARGER = 2.5  # by no more than this,
_MOST_PIXELS = 1.2e8  # and by no more than holds so many in all of the film
_MOST_FPS = 31.0  # films of more are thinned out by a whole number
_USUAL = 1.75  # [m] height of a person of whom nothing is known
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
    height: float | None = None,
    prior: MakePrior | None = None,
    particles: int = 2000,
    layers: int = 2,
    attempts: int = 4,
    fps: float | None = None,
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
        height: of the person [m]; None is what the outlines say with a known camera, and 1.75 m without one.
        prior: makes the prior of a body and a rate; None is the `FPCAPrior`.
        particles: of the filter.
        layers: of annealing.
        attempts: how often to follow the whole film; the one that shows it best is returned. Every second one starts
            with left and right exchanged, see `motionenv.estimation.tracking.following`.
        fps: frames per second to track at, of the film's nearest ones; None is the film's own rate, or the largest
            whole fraction of it up to 31.
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
    attempts = checked_whole(attempts, "attempts", 1)
    if not 0 < as_number(seconds) < np.inf:
        raise MotionError(f"seconds must be a finite number above 0, got {seconds!r}")
    check_options(particles, layers=layers)
    fps = _rate(path) if fps is None else checked_fps(fps)
    skeleton, rng = from_height(_USUAL if height is None else height), np.random.default_rng(seed)
    foregrounds, colours, size = _looked(path, fps, seconds, background)
    boxes = sightings(foregrounds)
    first, last = span(boxes, foregrounds.shape[2])
    rows, columns = foregrounds.shape[1:]
    if camera is not None and height is None:
        skeleton = from_height(standing_height(boxes[first:last], resized(camera, columns, rows)))
    full = side_camera(boxes[first:last], skeleton, columns, rows) if camera is None else camera
    view = resized(full, columns, rows)
    far = (
        np.sqrt(abs(np.linalg.det(view.K[:2, :2])))
        * skeleton.height
        / np.nanmedian(boxes[first:last, 3] - boxes[first:last, 2])
    )
    likelihood = ObservationModel(
        view, skeleton, misses=_MISSES, false_alarms=_ALARMS, distance=float(far), threads=threads
    )
    made = FPCAPrior(skeleton=skeleton, fps=fps) if prior is None else prior(skeleton, fps)
    walker = FPCAPrior(skeleton=skeleton, fps=fps, backwards=True)
    back = MixturePrior(walker, VelocityPrior(skeleton=skeleton, fps=fps))
    begin = departure(boxes[first:last], fps)
    looked = foregrounds[first:last], colours[first:last]
    follower = Follower(made, back, likelihood, *looked, begin, particles, layers, rng)
    total = attempts * (last - first)
    best = follower.best(attempts, lambda done: None if progress is None else progress(done, total))
    frames = (first, len(foregrounds) - last)
    poses, shown, effective, overlap = (
        np.pad(part, (frames, *[(0, 0)] * (part.ndim - 1)), constant_values=np.nan)
        for part in (best.poses, best.particles, best.effective, best.overlap)
    )
    motion = Motion(poses, skeleton, fps, f"{path}")
    return VideoTrack(motion, shown, effective, overlap, resized(full, *size), camera is None)


def _rate(path) -> float:
    """The film's own frames per second, or the largest whole fraction of them that isn't above `_MOST_FPS`."""
    from motionenv.render.reading import video_info

    own = video_info(path).fps
    return own / np.ceil(own / _MOST_FPS)


def _looked(path, fps: float, seconds: float, background) -> tuple[np.ndarray, np.ndarray, tuple[int, int]]:
    """`_foregrounds` in pictures as large as the person in them needs."""
    foregrounds, colours, size = _foregrounds(path, fps, seconds, background, _SIDE)
    boxes = sightings(foregrounds)
    first, last = span(boxes, foregrounds.shape[2])
    side = _larger(boxes[first:last], foregrounds.shape, max(size))
    if side <= _SIDE:
        return foregrounds, colours, size
    return _foregrounds(path, fps, seconds, background, side)


def _larger(boxes: np.ndarray, shape: tuple[int, ...], own: int) -> int:
    """Longer side of pictures [pixels] in which the person of `boxes` (T, 4) is `_TALL`, as far as that goes.

    Args:
        boxes: in pictures of `_SIDE`.
        shape: (T, rows, columns) of these.
        own: longer side of the film.
    """
    tall = float(np.nanmedian(boxes[:, 3] - boxes[:, 2]))
    factor = min(_TALL / tall, _MOST_LARGER, np.sqrt(_MOST_PIXELS / np.prod(shape, dtype=float)))
    return min(own, round(_SIDE * factor))


def _foregrounds(
    path, fps: float, seconds: float, background, side: int
) -> tuple[np.ndarray, np.ndarray, tuple[int, int]]:
    """Of the film in pictures with that longer side.

    Returns:
        Probabilities (T, rows, columns) of foreground, numbers (T, rows, columns) of `colour_bins`, and the film's own
        (width, height).
    """
    from motionenv.render.reading import narrowed, read_frames, video_info

    info = video_info(path)
    width = max(16, round(info.width * min(1.0, side / max(info.width, info.height))))
    frames = list(read_frames(path, fps=fps, width=width, seconds=seconds))
    if len(frames) < 3:
        raise FormatError(path, f"holds {len(frames)} frames at {fps:.4g} fps, too few to follow anybody")
    if background is None:
        without = frames
    elif isinstance(background, np.ndarray):
        without = [narrowed(picture(p), width) for p in background]
    else:
        without = list(read_frames(background, fps=fps, width=width, seconds=seconds))
    film = FilmBackground(without)
    foregrounds = np.stack([film.foreground(f).astype(np.float32) for f in frames])
    return foregrounds, np.stack([colour_bins(f).astype(np.uint16) for f in frames]), (info.width, info.height)
