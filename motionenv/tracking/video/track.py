"""Track a person in a real video, without ground truth: `track_video`.

    video → background → foreground → camera (if unknown) → start → filter, forwards and backwards; the best of several

The camera must be static, and one person must walk through the image. Poses are NaN before the first and after the last
frame in which the person is completely visible.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_fps, checked_number, checked_whole, random_generator
from motionenv.body import from_height
from motionenv.errors import FormatError
from motionenv.likelihoods.appearance import colour_bins
from motionenv.likelihoods.background import picture
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.tracking.particle_filter import check_options
from motionenv.tracking.priors.base import Prior
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.mixture import MixturePrior
from motionenv.tracking.priors.velocity import VelocityPrior
from motionenv.tracking.video.detection import departure_frame, detections, resized, side_camera, span, standing_height
from motionenv.tracking.video.foreground import FilmBackground
from motionenv.tracking.video.multi_start import MultiStart
from motionenv.types import Camera, Motion, Skeleton

_SIDE = 192  # [pixels] longer side of the images in the first pass
_TALL = 90.0  # [pixels] desired height of the person; images are enlarged for small people
_MOST_LARGER = 2.5  # greatest enlargement
_MOST_PIXELS = 1.2e8  # most pixels of the whole video, which also limits enlargement
_MOST_FPS = 31.0  # videos with a higher rate are decimated by a whole number
_USUAL = 1.75  # [m] default body height
_MISSES, _ALARMS = 0.25, 0.1  # miss and false-alarm rates: the foreground of videos has holes and clutter
#: Makes a prior for a body and a frame rate.
MakePrior = Callable[[Skeleton, float], Prior]


@dataclass(frozen=True, eq=False)
class VideoTrack:
    """Result of `track_video`.

    Attributes:
        motion: expected poses (T, 25) at the video's frames; NaN where the person isn't tracked.
        particles: (T, particles, 25), equally weighted; NaN as above.
        effective: (T,) effective sample sizes.
        overlap: (T,) intersection over union of the expected silhouette and the foreground, from 0 to 1.
        camera: given or guessed, for the video's own image size.
        guessed: whether the camera is a guess; lengths are then relative to the assumed height.
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
    """Track the person in a video.

    Args:
        path: of the video, in any format that ffmpeg reads.
        camera: static camera of the video, with the ground at z = 0; None guesses a camera at the side.
        height: body height [m]; None estimates it if the camera is known, and assumes 1.75 m otherwise.
        prior: makes the prior of a body and a rate; None uses the `FPCAPrior`.
        particles: number of particles of the filter.
        layers: annealing layers.
        attempts: number of tracks of the whole video, of which the best is returned. Every second one starts from a
            mirror image, see `motionenv.tracking.video.multi_start`.
        fps: frame rate to track at [Hz], by nearest frames; None uses the video's own rate divided by the smallest
            whole number that gives at most 31.
        seconds: most seconds of the video to use.
        background: video, or at least three images uint8 (T, h, w, 3) with the video's aspect ratio, of the same view
            without the person. None uses the median over the video, which is correct where the person stands in fewer
            than half of the frames.
        seed: int or Generator.
        threads: threads of the likelihood, which don't change the result; None uses one per core.
        progress: called with the number of frames processed and the total.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: no moving person, a camera with another aspect ratio, or an argument out of range.
    """
    attempts = checked_whole(attempts, "attempts", 1)
    checked_number(seconds, "seconds", above=0)
    check_options(particles, layers=layers)
    fps = _rate(path) if fps is None else checked_fps(fps)
    skeleton, rng = from_height(_USUAL if height is None else height), random_generator(seed)
    foregrounds, colours, size = _looked(path, fps, seconds, background)
    boxes = detections(foregrounds)
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
    likelihood = SilhouetteLikelihood(
        view, skeleton, misses=_MISSES, false_alarms=_ALARMS, distance=float(far), threads=threads
    )
    made = FPCAPrior(skeleton=skeleton, fps=fps) if prior is None else prior(skeleton, fps)
    walker = FPCAPrior(skeleton=skeleton, fps=fps, backwards=True)
    back = MixturePrior(walker, VelocityPrior(skeleton=skeleton, fps=fps))
    begin = departure_frame(boxes[first:last], fps)
    looked = foregrounds[first:last], colours[first:last]
    follower = MultiStart(made, back, likelihood, *looked, begin, particles, layers, rng)
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
    """The video's frame rate, divided by the smallest whole number that gives at most `_MOST_FPS`."""
    from motionenv.render.video.decode import video_info

    own = video_info(path).fps
    return own / np.ceil(own / _MOST_FPS)


def _looked(path, fps: float, seconds: float, background) -> tuple[np.ndarray, np.ndarray, tuple[int, int]]:
    """`_foregrounds` at a resolution that suits the person's size."""
    foregrounds, colours, size = _foregrounds(path, fps, seconds, background, _SIDE)
    boxes = detections(foregrounds)
    first, last = span(boxes, foregrounds.shape[2])
    side = _larger(boxes[first:last], foregrounds.shape, max(size))
    if side <= _SIDE:
        return foregrounds, colours, size
    return _foregrounds(path, fps, seconds, background, side)


def _larger(boxes: np.ndarray, shape: tuple[int, ...], own: int) -> int:
    """Longer image side [pixels] at which the person is `_TALL` pixels high, but at most `own`, the video's.

    The boxes (T, 4) and the shape (T, rows, columns) are those at `_SIDE`.
    """
    tall = float(np.nanmedian(boxes[:, 3] - boxes[:, 2]))
    factor = min(_TALL / tall, _MOST_LARGER, np.sqrt(_MOST_PIXELS / np.prod(shape, dtype=float)))
    return min(own, round(_SIDE * factor))


def _foregrounds(
    path, fps: float, seconds: float, background, side: int
) -> tuple[np.ndarray, np.ndarray, tuple[int, int]]:
    """Foreground and `colour_bins` (T, rows, columns) at a longer image side, and the video's (width, height)."""
    from motionenv.render.video.decode import narrowed, read_frames, video_info

    info = video_info(path)
    width = max(16, round(info.width * min(1.0, side / max(info.width, info.height))))
    frames = list(read_frames(path, fps=fps, width=width, seconds=seconds))
    if len(frames) < 3:
        raise FormatError(path, f"holds {len(frames)} frames at {fps:.4g} fps, too few to track a person")
    if background is None:
        without = frames
    elif isinstance(background, np.ndarray):
        without = [narrowed(picture(p), width) for p in background]
    else:
        without = list(read_frames(background, fps=fps, width=width, seconds=seconds))
    film = FilmBackground(without)
    foregrounds = np.stack([film.foreground(f).astype(np.float32) for f in frames])
    return foregrounds, np.stack([colour_bins(f).astype(np.uint16) for f in frames]), (info.width, info.height)
