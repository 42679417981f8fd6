"""A film, and two looks at it: a small one at what moves in it, and one cropped to the way of whom to follow."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionenv._core.validation import checked_fps, checked_number
from motionenv.errors import FormatError, MotionError
from motionenv.lifting import camera_motion
from motionenv.likelihoods.background import picture
from motionenv.render.video.decode import VideoInfo, narrowed, read_frames, video_info
from motionenv.tracking.video.candidates import Candidate, candidates
from motionenv.tracking.video.detection import resized
from motionenv.tracking.video.foreground import FilmBackground
from motionenv.tracking.video.movers import components, linked, window
from motionenv.types import Camera, Points

_SIDE = 256  # [pixels] longer side of the images of the first look
_TALL = 90.0  # [pixels] desired height of the person in the second
_MOST_PIXELS = 1.2e8  # most pixels of the whole second look
_BESIDE = 0.6  # space around the person's way, in heights
_MOST_FPS = 31.0  # videos with a higher rate are decimated by a whole number
_LOOKED, _SHAKES = 0.1, 0.3  # [s] between frames that tell of the camera; [degrees] by which it may turn
_BINS = 8  # of each colour channel
COLOURS = _BINS**3  # bins of a histogram


@dataclass(frozen=True, eq=False)
class Film:
    """A film of people, by a camera that stands still, and what is known of it.

    Attributes:
        path: of the video, in any format that ffmpeg reads.
        fps: frame rate to track at [Hz], by nearest frames; None uses the video's own rate divided by the smallest
            whole number that gives at most 31.
        seconds: most seconds of the video to use.
        background: video, or at least three images uint8 (T, h, w, 3) with the video's aspect ratio, of the same view
            without the person. None estimates it from the video, correctly where the person stands in fewer than half
            of the frames.
        region: (x, y, width, height) [pixels of the film] outside of which nothing is looked at; None is everywhere.
        detections: 2D keypoints of everybody in the film, with a frame for each of the film's: a detector's file or
            folder as of `motionenv.read_points`, or Points in the film's pixels, one for each person. They choose whom
            to follow, best and largest seen first, and which side is left; the motion lifted from them guides the
            tracker (`motionenv.tracking.video.guide`). Where they end, silhouettes go on.

    Raises:
        MotionError: a number out of range.
    """

    path: str | Path
    fps: float | None = None
    seconds: float = 60.0
    background: np.ndarray | str | Path | None = None
    region: Sequence[float] | None = None
    detections: str | Path | Points | Sequence[Points] | None = None

    def __post_init__(self) -> None:
        checked_number(self.seconds, "seconds", above=0)
        if self.fps is not None:
            checked_fps(self.fps)
        check_area("region", self.region, "x, y, width, height")

    def __repr__(self) -> str:
        return f"Film({str(self.path)!r}, {self.seconds:g} s)"

    def frames(self, fps: float, width: int) -> Iterator[np.ndarray]:
        """The frames at a rate `fps` [Hz], uint8 (height, width, 3) of another `width`."""
        return read_frames(self.path, fps=fps, width=width, seconds=self.seconds)

    def model(self, frames: Sequence[np.ndarray], fps: float, width: int, cut: Any = ...) -> FilmBackground:
        """The background model of the film's `frames`, or of its `background` at `fps` [Hz], `width` and `cut`."""
        if self.background is None:
            return FilmBackground(frames)
        if isinstance(self.background, np.ndarray):
            return FilmBackground([narrowed(picture(p), width)[cut] for p in self.background])
        return FilmBackground([f[cut] for f in replace(self, path=self.background).frames(fps, width)])


@dataclass(frozen=True, eq=False)
class Survey:
    """What a first look at a `film` found: its `info`, and at the rate `fps` [Hz] the following.

    Attributes:
        labels: of the outlines (T, height, width).
        found: candidates, the likeliest walker first.
    """

    film: Film
    info: VideoInfo
    fps: float
    labels: np.ndarray
    found: list[Candidate]


@dataclass(frozen=True, eq=False)
class Look:
    """The second look at one person, in a crop of the film's frames at the rate `fps` [Hz].

    Attributes:
        camera: of the crop.
        foreground: probabilities (T, height, width), 0 where others are.
        colours: of `colour_bins` (T, height, width).
        boxes: (T, 4) of the person [pixels of the crop], as of `Candidate`.
        merged: (T,) bool, whether the outline is also somebody else's.
    """

    fps: float
    camera: Camera
    foreground: np.ndarray
    colours: np.ndarray
    boxes: np.ndarray
    merged: np.ndarray


def check_area(name: str, values: Sequence[float] | None, what: str) -> None:
    """Raise MotionError unless the argument `name` is None, or the numbers that `what` lists, such as "x, y"."""
    if values is None:
        return
    numbers = np.asarray(values, dtype=float)
    if numbers.shape != (len(what.split()),) or not np.isfinite(numbers).all() or (numbers[2:] <= 0).any():
        raise MotionError(f"{name} must be {what} in the film's pixels, got {values!r}")


def survey(film: Film) -> Survey:
    """Look at what moves in a `film`.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: the camera moves, or the region is outside the picture.
    """
    info = video_info(film.path)
    fps = info.fps / np.ceil(info.fps / _MOST_FPS) if film.fps is None else float(film.fps)
    width = max(16, round(info.width * min(1.0, _SIDE / max(info.width, info.height))))
    frames = list(film.frames(fps, width))
    if len(frames) < 3:
        raise FormatError(film.path, f"holds {len(frames)} frames at {fps:.4g} fps, too few to track a person")
    refuse_moving(frames, fps)
    background, scale = film.model(frames, fps, width), info.width / width
    allowed = _inside(film.region, frames[0].shape[:2], scale)
    labels = np.stack([components(background.foreground(f) * allowed) for f in frames])
    return Survey(film, info, fps, labels, candidates(linked(labels, fps), labels, fps, scale))


def refuse_moving(frames: Sequence[np.ndarray], fps: float) -> None:
    """Raise MotionError if the camera of a film moves: `frames` are uint8 (height, width, 3) at `fps` [Hz]."""
    motion = camera_motion(frames[:: max(1, round(_LOOKED * fps))])
    if motion.kind == "moves" or (motion.degrees > _SHAKES and motion.kind == "turns"):
        raise MotionError(
            f"the camera moves: it turns by {motion.degrees:.1f} degrees or does more. Tracking needs a camera that "
            "stands still: use a tripod, cut the film to where it stands, or stabilise it first"
        )


def look(at: Survey, who: Candidate, frames: slice, whole: Camera) -> Look:
    """The pixels of one person, `who` of the survey `at`, in some `frames`; `whole` is the film's camera."""
    boxes, info = who.boxes[frames], at.info
    seen = boxes[np.isfinite(boxes[:, 0])]
    space = _BESIDE * who.height
    low = np.maximum(seen[:, ::2].min(axis=0) - space, 0)
    high = np.minimum(seen[:, 1::2].max(axis=0) + 1 + space, [info.width, info.height])
    most = np.sqrt(_MOST_PIXELS / (len(boxes) * np.prod(high - low)))
    width = max(16, round(info.width * min(1.0, _TALL / who.height, most)))
    scale = width / info.width
    size = (width, max(1, round(info.height * scale)))
    corner, end = np.floor(low * scale).astype(int), np.minimum(np.ceil(high * scale).astype(int), size)
    cut = (slice(corner[1], end[1]), slice(corner[0], end[0]))
    pictures = [f[cut] for f in at.film.frames(at.fps, width)]
    background = at.film.model(pictures, at.fps, width, cut)
    allowed = window(at.labels, who.mover, [c.mover for c in at.found])[frames]
    rows, columns = (
        np.minimum(((np.arange(s.start, s.stop) + 0.5) * n / total).astype(int), n - 1)
        for s, n, total in zip(cut, allowed.shape[1:], size[::-1], strict=True)
    )
    mine = [background.foreground(f) * a[np.ix_(rows, columns)] for f, a in zip(pictures[frames], allowed, strict=True)]
    colours = np.stack([colour_bins(f).astype(np.uint16) for f in pictures[frames]])
    camera = resized(whole, *size)
    K = camera.K.copy()
    K[:2, 2] -= corner
    camera = Camera(K, camera.R, camera.t, *(end - corner).tolist())
    boxes = (boxes + 0.5) * scale - 0.5 - np.repeat(corner, 2)
    return Look(at.fps, camera, np.stack(mine).astype(np.float32), colours, boxes, who.mover.merged[frames])


def colour_bins(rgb: np.ndarray) -> np.ndarray:
    """Histogram bin (height, width), below `COLOURS`, of each pixel of `rgb`, uint8 (height, width, 3)."""
    r, g, b = np.moveaxis(rgb.astype(np.int64) * _BINS // 256, -1, 0)
    return (r * _BINS + g) * _BINS + b


def _inside(region, shape: tuple[int, int], scale: float) -> np.ndarray:
    """1 (height, width) inside a region of the film, given in its pixels, and 0 outside."""
    if region is None:
        return np.ones(shape)
    x, y, wide, tall = (float(v) / scale for v in region)
    rows, columns = np.mgrid[: shape[0], : shape[1]] + 0.5
    inside = (columns > x) & (columns < x + wide) & (rows > y) & (rows < y + tall)
    if not inside.any():
        raise MotionError(f"region must be x, y, width, height inside the picture, got {tuple(region)}")
    return inside.astype(float)
