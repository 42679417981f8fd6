"""Decode videos: frames of any file that ffmpeg reads, upright, at a given rate and size."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np

from motionenv._core.validation import checked_fps, checked_number, checked_whole
from motionenv.errors import FormatError

_MOST_PIXELS = 8192 * 8192
_WHOLE = 0.9  # least fraction of a file's declared frames that must be present


@dataclass(frozen=True)
class VideoInfo:
    """`width` and `height` of a video's upright frames [pixels], and its mean `fps` according to the file [Hz]."""

    width: int
    height: int
    fps: float


def video_info(path: str | Path) -> VideoInfo:
    """Size and rate of the video at `path`, from its first frame.

    Raises:
        FormatError: not a video, or nothing in it can be decoded.
    """
    for picture, fps, ratio in _decoded(Path(path)):
        height, width = _upright_size(picture, ratio)
        return VideoInfo(width, height, fps)
    raise FormatError(path, "holds no picture")


def read_frames(
    path: str | Path, *, fps: float | None = None, width: int | None = None, seconds: float = 60.0
) -> Iterator:
    """Frames of a video, uint8 (height, width, 3), one at a time, upright and with square pixels.

    Args:
        path: the file.
        fps: frame rate [Hz], by nearest frames in time; None returns all frames.
        width: of the frames [pixels]; the height follows, odd or even. None keeps the file's.
        seconds: maximum duration [s].

    Raises:
        FormatError: not a video, or a truncated one.
        MotionError: arguments out of range.
    """
    if fps is not None:
        fps = checked_fps(fps)
    if width is not None:
        width = checked_whole(width, "width", 16, 8192, "pixels")
    checked_number(seconds, "seconds", above=0)
    return _read(Path(path), fps, width, seconds)


@dataclass(frozen=True)
class Film:
    """The frames of the video at `path`, scaled to a `width` [pixels], to be read as often as wanted."""

    path: str | Path
    width: int
    seconds: float = 3600.0

    def __iter__(self) -> Iterator[np.ndarray]:
        return read_frames(self.path, width=self.width, seconds=self.seconds)


def narrowed(picture: np.ndarray, width: int) -> np.ndarray:
    """An image, uint8 (height, width, 3), scaled to another width [pixels] like the frames of `read_frames`."""
    return _rgb(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24"), width, 1.0)


def rows_at(columns: int, height: int, width: int) -> int:
    """Rows of a picture of `height` × `width` pixels that is scaled to so many columns."""
    return max(1, round(height * columns / width))


def _read(path: Path, fps: float | None, width: int | None, seconds: float) -> Iterator:
    began: float | None = None
    last: tuple[float, av.VideoFrame] | None = None
    count, rate, ratio, shape = 0, 1.0, 1.0, None
    for number, (picture, rate, ratio) in enumerate(_decoded(path)):
        time = number / rate if picture.time is None else picture.time
        began = time if began is None else began
        after = time - began
        if after >= seconds:
            break
        shape = shape or (picture.width, picture.height)
        if (picture.width, picture.height) != shape:
            raise FormatError(
                path, f"changes size from {shape} to {(picture.width, picture.height)}", f"frame {number}"
            )
        if fps is None:
            yield _rgb(picture, width, ratio)
            continue
        while last is not None and count / fps <= (last[0] + after) / 2:  # nearer to the previous frame
            yield _rgb(last[1], width, ratio)
            count += 1
        last = (after, picture)
    while last is not None and fps is not None and count / fps < last[0] + 0.5 / rate:
        yield _rgb(last[1], width, ratio)
        count += 1
    if began is None:
        raise FormatError(path, "holds no picture")


def _decoded(path: Path) -> Iterator[tuple[av.VideoFrame, float, float]]:
    """Frames, the file's mean rate, and how much wider than high its pixels are."""
    if not path.is_file():
        raise FormatError(path, "can't be read: there is no such file")
    number = 0
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise FormatError(path, "has no video stream")
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            fps = float(stream.average_rate or stream.guessed_rate or 0)
            if not fps > 0:
                raise FormatError(path, "doesn't specify a frame rate")
            ratio = float(stream.sample_aspect_ratio or 1)
            for picture in container.decode(stream):
                if not 0 < picture.width * picture.height <= _MOST_PIXELS:
                    raise FormatError(path, f"has frames of {picture.width} x {picture.height}")
                yield picture, fps, ratio
                number += 1
            if number < _WHOLE * stream.frames:
                raise FormatError(path, f"is truncated: it should have {stream.frames} frames", f"after {number}")
    except (av.FFmpegError, EOFError, UnicodeDecodeError) as error:
        what = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise FormatError(path, f"isn't a video, or is damaged ({what})", f"after {number} frames") from error


def _upright_size(picture: av.VideoFrame, ratio: float) -> tuple[int, int]:
    """Height and width of the frame after rotation to upright, in square pixels."""
    height, width = picture.height, round(picture.width * ratio)
    return (width, height) if picture.rotation % 180 == 90 else (height, width)


def _rgb(picture: av.VideoFrame, width: int | None, ratio: float) -> np.ndarray:
    """The frame as uint8 (height, width, 3), upright and scaled to `width`."""
    height, full = _upright_size(picture, ratio)
    columns = full if width is None else int(width)
    rows = rows_at(columns, height, full)
    turns = picture.rotation // 90
    size = (rows, columns) if turns % 2 else (columns, rows)
    rgb = picture.reformat(width=size[0], height=size[1], format="rgb24", interpolation="AREA").to_ndarray()
    return np.ascontiguousarray(np.rot90(rgb, turns)) if turns % 4 else rgb
