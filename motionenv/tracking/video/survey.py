"""Two looks at a film: a small one at what moves in it, and one cropped to the way of whom to follow."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError, MotionError
from motionenv.likelihoods.appearance import colour_bins
from motionenv.likelihoods.background import picture
from motionenv.render.video.decode import VideoInfo, narrowed, read_frames, video_info
from motionenv.tracking.video.candidates import Candidate, candidates
from motionenv.tracking.video.foreground import FilmBackground
from motionenv.tracking.video.movers import components, linked, window
from motionenv.tracking.video.stillness import refuse_moving
from motionenv.types import Camera

_SIDE = 256  # [pixels] longer side of the images of the first look
_TALL = 90.0  # [pixels] desired height of the person in the second
_MOST_PIXELS = 1.2e8  # most pixels of the whole second look
_BESIDE = 0.6  # space around the person's way, in heights
_MOST_FPS = 31.0  # videos with a higher rate are decimated by a whole number


@dataclass(frozen=True, eq=False)
class Survey:
    """What a first look found.

    Attributes:
        path: of the video.
        info: its size and rate.
        fps: rate of the frames [Hz].
        seconds: most seconds that are used.
        background: as in `track_video`.
        labels: of the outlines (T, height, width).
        found: candidates, the likeliest walker first.
    """

    path: str | Path
    info: VideoInfo
    fps: float
    seconds: float
    background: object
    labels: np.ndarray
    found: list[Candidate]


@dataclass(frozen=True, eq=False)
class Look:
    """The second look at one person.

    Attributes:
        foreground: probabilities (T, height, width), 0 where others are.
        colours: of `colour_bins` (T, height, width).
        scale: pixels per pixel of the film.
        corner: first column and row (2,) of the crop, in scaled pixels.
        size: width and height of the whole scaled picture.
    """

    foreground: np.ndarray
    colours: np.ndarray
    scale: float
    corner: np.ndarray
    size: tuple[int, int]

    def boxes(self, of: Candidate) -> np.ndarray:
        """A candidate's boxes (T, 4) in the crop's pixels."""
        return (of.boxes + 0.5) * self.scale - 0.5 - np.repeat(self.corner, 2)

    def camera(self, whole: Camera) -> Camera:
        """The crop's camera, from that of the whole scaled picture."""
        K = whole.K.copy()
        K[:2, 2] -= self.corner
        return Camera(K, whole.R, whole.t, *self.foreground.shape[:0:-1])


def survey(
    path: str | Path,
    *,
    fps: float | None,
    seconds: float,
    background: np.ndarray | None = None,
    region: Sequence[float] | None = None,
) -> Survey:
    """Look at the film at `path`.

    Args:
        fps: rate to look at [Hz]; None uses the video's own, divided by a whole number.
        seconds, background: most seconds to use, and as in `track_video`.
        region: (x, y, width, height) [pixels of the film] outside of which nothing is looked at; None is everywhere.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: the camera moves, or the region is outside the picture.
    """
    info = video_info(path)
    fps = info.fps / np.ceil(info.fps / _MOST_FPS) if fps is None else fps
    width = max(16, round(info.width * min(1.0, _SIDE / max(info.width, info.height))))
    frames = list(read_frames(path, fps=fps, width=width, seconds=seconds))
    if len(frames) < 3:
        raise FormatError(path, f"holds {len(frames)} frames at {fps:.4g} fps, too few to track a person")
    refuse_moving(np.stack(frames), fps)
    film, scale = _background(frames, background, width, fps, seconds), info.width / width
    allowed = _inside(region, frames[0].shape[:2], scale)
    labels = np.stack([components(film.foreground(f) * allowed) for f in frames])
    return Survey(path, info, fps, seconds, background, labels, candidates(linked(labels, fps), labels, fps, scale))


def look(at: Survey, who: Candidate, first: int, last: int) -> Look:
    """The pixels of one person, `who` of the survey `at`, from frame `first` to `last`, which is excluded."""
    boxes, info = who.boxes[first:last], at.info
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
    frames = [f[cut] for f in read_frames(at.path, fps=at.fps, width=width, seconds=at.seconds)]
    film = _background(frames, at.background, width, at.fps, at.seconds, cut)
    allowed = window(at.labels, who.mover, [c.mover for c in at.found])[first:last]
    rows, columns = (
        np.minimum(((np.arange(s.start, s.stop) + 0.5) * n / whole).astype(int), n - 1)
        for s, n, whole in zip(cut, allowed.shape[1:], size[::-1], strict=True)
    )
    mine = [film.foreground(f) * a[np.ix_(rows, columns)] for f, a in zip(frames[first:last], allowed, strict=True)]
    colours = np.stack([colour_bins(f).astype(np.uint16) for f in frames[first:last]])
    return Look(np.stack(mine).astype(np.float32), colours, scale, corner, size)


def _background(frames, background, width: int, fps: float, seconds: float, cut=...) -> FilmBackground:
    """The background model of a film's `frames`, or of a `background` of its own, cropped by `cut`."""
    if background is None:
        return FilmBackground(frames)
    if isinstance(background, np.ndarray):
        return FilmBackground([narrowed(picture(p), width)[cut] for p in background])
    return FilmBackground([f[cut] for f in read_frames(background, fps=fps, width=width, seconds=seconds)])


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
