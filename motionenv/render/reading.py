"""Videos in: frames of any file that ffmpeg reads, upright, at the rate and the size that are asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np

from motionenv.errors import FormatError, MotionError
from motionenv.types import checked_fps

_MOST_PIXELS = 8192 * 8192
_WHOLE = 0.9  # share of the pictures that a file announces that must be there


@dataclass(frozen=True)
class VideoInfo:
    """What a video is.

    Attributes:
        width: of its upright pictures [pixels].
        height: of its upright pictures [pixels].
        fps: mean frames per second, as the file says.
    """

    width: int
    height: int
    fps: float


def video_info(path) -> VideoInfo:
    """Size and rate of a video, from its first picture.

    Args:
        path: the file.

    Raises:
        FormatError: not a video, or nothing in it can be decoded.
    """
    for picture, fps in _decoded(Path(path)):
        height, width = _upright_size(picture)
        return VideoInfo(width, height, fps)
    raise FormatError(path, "holds no picture")


def read_frames(path, *, fps: float | None = None, width: int | None = None, seconds: float = 60.0) -> Iterator:
    """Frames of a video, uint8 (height, width, 3), one at a time.

    Args:
        path: the file.
        fps: frames per second to return: of the file's, the ones nearest in time; None takes all of them as they come.
        width: of the pictures [pixels]; the height follows, odd or even. None keeps the file's.
        seconds: where to stop.

    Raises:
        FormatError: not a video, or it breaks off before a picture is whole.
        MotionError: arguments out of range.
    """
    if fps is not None:
        fps = checked_fps(fps)
    if width is not None and (isinstance(width, bool) or width != int(width) or not 16 <= width <= 8192):
        raise MotionError(f"width must be a whole number of pixels from 16 to 8192, got {width!r}")
    if not 0 < seconds < np.inf:
        raise MotionError(f"seconds must be a number above 0, got {seconds!r}")
    return _read(Path(path), fps, width, seconds)


def narrowed(picture: np.ndarray, width: int) -> np.ndarray:
    """A picture, uint8 (height, width, 3), in another width, as `read_frames` makes it of a film's pictures.

    Args:
        picture: uint8 (height, width, 3).
        width: [pixels]; the height follows.
    """
    return _rgb(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24"), width)


def _read(path: Path, fps: float | None, width: int | None, seconds: float) -> Iterator:
    """`read_frames`, its arguments checked."""
    began: float | None = None
    last: tuple[float, av.VideoFrame] | None = None
    count, rate, shape = 0, 1.0, None
    for number, (picture, rate) in enumerate(_decoded(path)):
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
            yield _rgb(picture, width)
            continue
        while last is not None and count / fps <= (last[0] + after) / 2:  # nearer to the picture before
            yield _rgb(last[1], width)
            count += 1
        last = (after, picture)
    while last is not None and fps is not None and count / fps < last[0] + 0.5 / rate:
        yield _rgb(last[1], width)
        count += 1
    if began is None:
        raise FormatError(path, "holds no picture")


def _decoded(path: Path) -> Iterator[tuple[av.VideoFrame, float]]:
    """Pictures and the file's mean rate.

    Raises:
        FormatError: not a video, or broken.
    """
    if not path.is_file():
        raise FormatError(path, "can't be read: there is no such file")
    number = 0
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise FormatError(path, "holds no video")
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            fps = float(stream.average_rate or stream.guessed_rate or 0)
            if not fps > 0:
                raise FormatError(path, "doesn't say how many frames per second it has")
            for picture in container.decode(stream):
                if not 0 < picture.width * picture.height <= _MOST_PIXELS:
                    raise FormatError(path, f"has pictures of {picture.width} x {picture.height}")
                yield picture, fps
                number += 1
            if number < _WHOLE * stream.frames:
                raise FormatError(path, f"breaks off: it should hold {stream.frames} pictures", f"after {number}")
    except (av.FFmpegError, EOFError, UnicodeDecodeError) as error:
        what = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise FormatError(path, f"isn't a video, or is broken ({what})", f"after {number} frames") from error


def _upright_size(picture: av.VideoFrame) -> tuple[int, int]:
    """Height and width of the picture turned upright."""
    sideways = picture.rotation % 180 == 90
    return (picture.width, picture.height) if sideways else (picture.height, picture.width)


def _rgb(picture: av.VideoFrame, width: int | None) -> np.ndarray:
    """The picture as uint8 (height, width, 3), upright and of the width asked for."""
    height, full = _upright_size(picture)
    columns = full if width is None else int(width)
    rows = max(1, round(height * columns / full))
    turns = picture.rotation // 90
    size = (rows, columns) if turns % 2 else (columns, rows)
    rgb = picture.reformat(width=size[0], height=size[1], format="rgb24", interpolation="AREA").to_ndarray()
    return np.ascontiguousarray(np.rot90(rgb, turns)) if turns % 4 else rgb
