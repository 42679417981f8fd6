"""A film, and two looks at it: at whom it shows, by detections, and one cropped to the way of whom to follow."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionenv._core.validation import checked_fps, checked_number
from motionenv.errors import FormatError, MotionError
from motionenv.lifting import camera_motion
from motionenv.likelihoods.background import picture
from motionenv.mocap.keypoints.detector import detect_people, detector
from motionenv.mocap.keypoints.points2d import points_of, read_people
from motionenv.render.video.decode import VideoInfo, narrowed, read_frames, rows_at, video_info
from motionenv.tracking.video.candidates import Candidate, areas, candidates, common_areas
from motionenv.tracking.video.detection import resized
from motionenv.tracking.video.foreground import FilmBackground
from motionenv.types import Camera, Points

_SIDE = 256  # [pixels] longer side of the images of the first look
_TALL = 90.0  # [pixels] desired height of the person in the second
_MOST_PIXELS = 1.2e8  # most pixels of the whole second look
_BESIDE = 0.6  # space around the person's way, in heights
_MARGIN = 0.15  # space around a person's box in which the outline is looked for, in its heights
_SHARED = 0.1  # part of a person's box that is also somebody else's, from which outlines are taken for one
_MOST_FPS = 31.0  # videos with a higher rate are decimated by a whole number
_LOOKED, _SHAKES = 0.1, 0.3  # [s] between frames that tell of the camera; [degrees] by which it may turn


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
        region: (x, y, width, height) [pixels of the film] of whom to look for; None is everywhere.
        detections: 2D keypoints of everybody in the film, with a frame for each of the film's: a detector's file or
            folder as of `motionenv.read_points`, or Points in the film's pixels, one for each person. None detects
            them, by `motionenv.mocap.keypoints.detector`. They tell whom to follow, who is largest and surest first,
            and which side is left; the motion lifted from them guides the tracker (`motionenv.tracking.video.guide`).

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
        frames: how many there are.
        found: people, best seen first.
    """

    film: Film
    info: VideoInfo
    fps: float
    frames: int
    found: list[Candidate]


@dataclass(frozen=True, eq=False)
class Look:
    """The second look at one person, in a crop of the film's frames at the rate `fps` [Hz].

    Attributes:
        camera: of the crop.
        foreground: probabilities (T, height, width), 0 where others are.
        boxes: (T, 4) of the person [pixels of the crop], as of `Candidate`.
        merged: (T,) bool, whether the outline may be one with somebody else's.
    """

    fps: float
    camera: Camera
    foreground: np.ndarray
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
    """Look at whom a `film` shows.

    Raises:
        FormatError: not a video, a damaged one, or one that shows nobody.
        MotionError: the camera moves, no detector, or no Points in pixels.
    """
    info = video_info(film.path)
    fps = info.fps / np.ceil(info.fps / _MOST_FPS) if film.fps is None else float(film.fps)
    width = max(16, round(info.width * min(1.0, _SIDE / max(info.width, info.height))))
    frames = list(film.frames(fps, width))
    if len(frames) < 3:
        raise FormatError(film.path, f"holds {len(frames)} frames at {fps:.4g} fps, too few to track a person")
    refuse_moving(frames, fps)
    film.model(frames, fps, width).foreground(frames[0])  # refuses a background of another shape
    found = candidates(_people(film, info), fps, len(frames), (info.width, info.height), film.region)
    return Survey(film, info, fps, len(frames), found)


def _people(film: Film, info: VideoInfo) -> list[Points]:
    """Everybody whom the detections of a film show, or the detector sees."""
    given = film.detections
    if given is None:
        tracks, frames = detect_people(read_frames(film.path, seconds=film.seconds), detector(), name=str(film.path))
        return points_of(film.path, tracks, frames, info.fps)
    if isinstance(given, str | Path):
        return read_people(given, info.fps, (info.width, info.height))
    people = [given] if isinstance(given, Points) else list(given)
    if not people or not all(isinstance(p, Points) and p.unit == "px" for p in people):
        raise MotionError("detections must be a file, or Points in the film's pixels, one for each person")
    return people


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
    size = (width, rows_at(width, info.height, info.width))
    corner, end = np.floor(low * scale).astype(int), np.minimum(np.ceil(high * scale).astype(int), size)
    cut = (slice(corner[1], end[1]), slice(corner[0], end[0]))
    pictures = [f[cut] for f in at.film.frames(at.fps, width)]
    background = at.film.model(pictures, at.fps, width, cut)
    others = [c.boxes[frames] for c in at.found if c is not who]
    mine = [background.foreground(f) for f in pictures[frames]]
    rows, columns = ((np.arange(s.start, s.stop) + 0.5) / scale - 0.5 for s in cut)
    for t, foreground in enumerate(mine):
        foreground *= _window(boxes[t], [b[t] for b in others], rows, columns)
    shared = np.reshape([common_areas(boxes, b) / areas(boxes) for b in others], (-1, len(boxes)))
    merged = np.any(shared > _SHARED, axis=0, keepdims=True)[0]
    camera = resized(whole, *size)
    K = camera.K.copy()
    K[:2, 2] -= corner
    camera = Camera(K, camera.R, camera.t, *(end - corner).tolist())
    boxes = (boxes + 0.5) * scale - 0.5 - np.repeat(corner, 2)
    return Look(at.fps, camera, np.stack(mine).astype(np.float32), boxes, merged)


def _window(box: np.ndarray, others: Sequence[np.ndarray], rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Where (rows, columns) somebody can be seen: near the own box (4,), and not in another's one only."""
    space = _MARGIN * (box[3] - box[2]) + 1
    within = lambda b, beyond: (
        (rows[:, None] >= b[2] - beyond) & (rows[:, None] <= b[3] + beyond)
        & (columns >= b[0] - beyond) & (columns <= b[1] + beyond)
    )  # fmt: skip
    theirs = np.any([within(other, 0.0) for other in others], axis=0) if others else False
    return within(box, space) & (within(box, 0.0) | ~np.asarray(theirs))
