"""Encode videos: MP4 (also streamed), GIF, animated WebP or PNGs, with PyAV, whose wheels include ffmpeg.

The caller's thread makes the frames while another encodes, at most a few frames behind, so that memory doesn't grow
with the video's length. The same frames give the same bytes: encoders are single-threaded and write neither dates nor
versions.
"""

import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

from motionenv._core.files import atomic_write
from motionenv._core.validation import checked_number, checked_whole
from motionenv.errors import MotionError

__all__ = ["png", "stream_video", "write_image", "write_video"]

_AHEAD = 8  # most frames waiting for the encoder
_WEBP_QUALITY = 80
# Players slow down GIF frames of less than 1/50 s; WebP's time unit is a millisecond; the other limits are arbitrary.
_MOST_FPS = {".mp4": 1000, ".gif": 50, ".webp": 1000, "": 1000}
_LEAST_FPS = 0.01
_FRAGMENT = 0.5  # [s] between key frames of a stream


def write_video(
    path: str | Path, frames: Iterable, fps: float, *, crf: int = 20, progress: Callable[[int], None] | None = None
) -> None:
    """Write frames to a video, atomically; the suffix of `path` selects the format.

    - `.mp4`: H.264 that plays everywhere; odd sizes are padded with a copy of the last row or column.
    - `.gif`: one palette for all frames, at most 50 frames per second, endless loop.
    - `.webp`: animated, lossy, endless loop.
    - no suffix: a folder of lossless `frame_000000.png`, `frame_000001.png`, ...

    Args:
        path: of the file; an existing file is replaced, an existing folder must be empty.
        frames: uint8 (H, W, 3), all of one size: an array (T, H, W, 3) or any iterable, consumed one at a time.
        fps: frame rate, from 0.01 to 1000 (GIF: 50) [Hz].
        crf: quality of MP4, from 0 (lossless in luma and chroma) over 18 (visually lossless) to 51 (worst).
        progress: called with the number of frames consumed so far, after each.

    Raises:
        MotionError: an unknown suffix, fps, crf or frames out of range, no frames, or a full or read-only disk.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    rate = _checked_request(path, suffix, fps, crf)
    pictures = _checked_frames(frames, progress)
    if not suffix:
        _write_folder(path, pictures)
        return
    with atomic_write(path) as part:
        try:
            if suffix == ".mp4":
                _write_mp4(part, pictures, rate, crf)
            elif suffix == ".gif":
                _write_gif(part, pictures, rate)
            else:
                _write_webp(part, pictures, rate)
        except OSError:
            raise  # `atomic_write` reports disk errors
        except av.FFmpegError as error:
            raise MotionError(f"can't encode {path}: {error.strerror}; try another size or another format") from error


def stream_video(frames: Iterable, fps: float, *, crf: int = 20) -> Iterator[bytes]:
    """Encode an MP4 incrementally, for streaming: H.264 in fragments of half a second.

    Yields the available bytes after each frame, often none, so that the consumer can stop at any frame with `close()`.
    Nothing is rendered or encoded ahead. `frames`, `fps` and `crf` are as in `write_video`, and so are the errors.
    """
    rate = _checked_rate(".mp4", fps, crf)
    return _streamed(_checked_frames(frames, None), rate, crf)


def _streamed(frames: Iterator[av.VideoFrame], rate: Fraction, crf: int) -> Iterator[bytes]:
    sink = _Sink()
    muxer = {"movflags": "+frag_keyframe+empty_moov+default_base_moof"}
    every = str(max(1, round(_FRAGMENT * rate)))
    how = {"preset": "superfast", "tune": "animation,zerolatency", "g": every, "keyint_min": every, "sc_threshold": "0"}
    try:
        with _encoder(sink, "libx264", "yuv420p", rate, muxer, container="mp4", crf=str(crf), **how) as add:
            for frame in frames:
                add(_yuv(frame))
                yield sink.taken()
        yield sink.taken()
    except av.FFmpegError as error:
        raise MotionError(f"can't encode this video: {error.strerror}; try another size") from error


class _Sink:
    """A write-only, unseekable file whose bytes are read while it is written."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def write(self, data: bytes) -> int:
        self._parts.append(bytes(data))
        return len(data)

    def taken(self) -> bytes:
        data = b"".join(self._parts)
        self._parts.clear()
        return data


def png(rgb: np.ndarray) -> bytes:
    """Encode one image `rgb`, uint8 (H, W, 3), as PNG; a MotionError if it is none."""
    (picture,) = _checked_frames([rgb], None)
    return _png(picture)


def write_image(path: str | Path, rgb: np.ndarray) -> None:
    """Write one image `rgb`, uint8 (H, W, 3), to a PNG file at `path`, atomically; an existing file is replaced.

    Raises:
        MotionError: another suffix than .png, not an image, or a full or read-only disk.
    """
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise MotionError(f"can't write an image to {path}: the suffix must be .png")
    data = png(rgb)
    with atomic_write(path) as part:
        part.write_bytes(data)


def _checked_request(path: Path, suffix: str, fps, crf) -> Fraction:
    if suffix not in _MOST_FPS:
        raise MotionError(
            f"can't write a video to {path}: the suffix must be .mp4, .gif or .webp, or none for a folder of PNGs"
        )
    rate = _checked_rate(suffix, fps, crf)
    if suffix and path.is_dir():
        raise MotionError(f"can't write {path}: a folder has that name; choose another")
    return rate


def _checked_rate(suffix: str, fps, crf) -> Fraction:
    checked_number(fps, f"fps of {suffix or 'a folder of PNGs'}", _LEAST_FPS, _MOST_FPS[suffix])
    checked_whole(crf, "crf", 0, 51)
    return Fraction(fps).limit_denominator(1001)


def _checked_frames(frames: Iterable, progress: Callable[[int], None] | None) -> Iterator[av.VideoFrame]:
    """Frames for PyAV, copied so that the caller may reuse the arrays."""
    shape = None
    number = 0
    for number, picture in enumerate(frames, 1):
        rgb: np.ndarray = np.asarray(picture)
        if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[-1] != 3 or not rgb.size:
            raise MotionError(f"frame {number - 1} must be uint8 (height, width, 3), got {rgb.dtype} {rgb.shape}")
        shape = shape or rgb.shape
        if rgb.shape != shape:
            raise MotionError(f"frame {number - 1} has shape {rgb.shape}, the first {shape}: all must have one size")
        yield av.VideoFrame.from_ndarray(np.ascontiguousarray(rgb, dtype=np.uint8), format="rgb24")
        if progress is not None:
            progress(number)
    if not number:
        raise MotionError("frames must hold at least one frame")


def _in_background(items: Iterable, work: Callable) -> None:
    """Call `work` on each item, in order, in another thread, while this one produces items."""

    def step(before: Future | None, item) -> None:
        if before is not None:
            before.result()  # raises its error: encoders crash if they get more frames after one
        work(item)

    waiting: deque[Future] = deque()
    with ThreadPoolExecutor(1, thread_name_prefix="motionenv-video") as worker:
        for item in items:
            waiting.append(worker.submit(step, waiting[-1] if waiting else None, item))
            if len(waiting) > _AHEAD:
                waiting.popleft().result()
        for future in waiting:
            future.result()


@contextmanager
def _encoder(
    to: Path | _Sink, codec: str, pixels: str, rate: Fraction, muxer=None, container: str | None = None, **options: str
) -> Iterator[Callable]:
    """A context manager that yields a function to append one `av.VideoFrame` to a file or sink."""
    file: Any = to if isinstance(to, _Sink) else str(to)
    with av.open(file, "w", format=container, options={"fflags": "+bitexact", **(muxer or {})}) as output:
        stream = cast(av.VideoStream, output.add_stream(codec, rate=rate, options=options))
        context = stream.codec_context
        context.thread_count = 1
        context.flags |= av.codec.context.Flags.bitexact
        stream.pix_fmt = pixels
        if pixels == "yuv420p":
            context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
            context.color_primaries, context.color_trc = ColorPrimaries.BT709, ColorTrc.BT709
        count = 0

        def add(frame: av.VideoFrame) -> None:
            nonlocal count
            if not count:
                stream.width, stream.height = frame.width, frame.height
            frame.pts, frame.time_base = count, 1 / rate
            count += 1
            output.mux(stream.encode(frame))

        yield add
        output.mux(stream.encode())


def _write_mp4(path: Path, frames: Iterator[av.VideoFrame], rate: Fraction, crf: int) -> None:
    """H.264 with its index in front, so that browsers can start immediately.

    Of x264's presets only superfast and ultrafast disable the macroblock tree, which makes output irreproducible for
    small images and for sizes that aren't multiples of 128, even on one thread.
    """
    muxer = {"movflags": "+faststart"}
    with _encoder(path, "libx264", "yuv420p", rate, muxer, preset="superfast", tune="animation", crf=str(crf)) as add:
        _in_background(frames, lambda frame: add(_yuv(frame)))


def _yuv(frame: av.VideoFrame) -> av.VideoFrame:
    """Convert a frame to H.264's usual colours (BT.709, 4:2:0), which need even sizes."""
    if frame.width % 2 or frame.height % 2:
        padding = ((0, frame.height % 2), (0, frame.width % 2), (0, 0))
        padded: np.ndarray = np.pad(frame.to_ndarray(), padding, mode="edge")
        frame = av.VideoFrame.from_ndarray(padded, format="rgb24")
    return frame.reformat(
        format="yuv420p", dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG, interpolation="BILINEAR"
    )


def _write_webp(path: Path, frames: Iterator[av.VideoFrame], rate: Fraction) -> None:
    with _encoder(path, "libwebp_anim", "bgra", rate, {"loop": "0"}, quality=str(_WEBP_QUALITY)) as add:
        _in_background(frames, lambda frame: add(frame.reformat(format="bgra")))


def _write_gif(path: Path, frames: Iterator[av.VideoFrame], rate: Fraction) -> None:
    """GIF in two passes: frames wait on disk, losslessly, until the palette is known."""
    first = next(frames)
    colours = _Filter("palettegen", "stats_mode=full", first)
    with tempfile.TemporaryDirectory(prefix="motionenv-") as folder:
        waiting = Path(folder) / "frames.mkv"
        with _encoder(waiting, "libx264rgb", "rgb24", rate, preset="ultrafast", qp="0") as store:

            def count_and_store(frame: av.VideoFrame) -> None:
                store(frame)
                colours.push(frame)
                deque(colours.pull(), 0)  # no palette yet, but filters run only on demand: else all frames would queue

            _in_background(chain([first], frames), count_and_store)
        colours.push(None)
        (palette,) = colours.pull()
        with av.open(str(waiting)) as source, _encoder(path, "gif", "pal8", rate, {"loop": "0"}) as add:
            _in_background(_in_palette(source.decode(video=0), first, palette), add)


def _in_palette(
    frames: Iterator[av.VideoFrame], like: av.VideoFrame, palette: av.VideoFrame
) -> Iterator[av.VideoFrame]:
    """Frames in the colours of `palette`, with ordered dithering, which doesn't flicker in static areas."""
    paint = _Filter("paletteuse", "dither=bayer:bayer_scale=4:diff_mode=rectangle", like, palette)
    paint.push(palette, 1)
    paint.push(None, 1)
    for frame in frames:
        paint.push(frame.reformat(format="rgb24"))
        yield from paint.pull()
    paint.push(None)
    yield from paint.pull()


class _Filter:
    """An ffmpeg filter with one input for each frame format in `like`."""

    def __init__(self, name: str, options: str, *like: av.VideoFrame):
        self._graph = av.filter.Graph()  # keeps the graph alive; its nodes don't
        node, self._output = self._graph.add(name, options), self._graph.add("buffersink")
        self._inputs = [
            self._graph.add_buffer(width=f.width, height=f.height, format=f.format, time_base=Fraction(1, 1000))
            for f in like
        ]
        for i, source in enumerate(self._inputs):
            source.link_to(node, 0, i)
        node.link_to(self._output)
        self._graph.configure()

    def push(self, frame: av.VideoFrame | None, to: int = 0) -> None:
        """Pass a frame to input `to`; None ends the input."""
        self._inputs[to].push(frame)

    def pull(self) -> Iterator[av.VideoFrame]:
        while True:
            try:
                frame = cast(av.VideoFrame, self._output.pull())
            except (av.BlockingIOError, av.EOFError):
                return
            yield frame


def _write_folder(path: Path, frames: Iterator[av.VideoFrame]) -> None:
    """Write a folder of PNGs under a temporary name, and rename it when complete."""
    if path.exists() and not (path.is_dir() and not any(path.iterdir())):
        raise MotionError(f"can't write frames to {path}: it exists and isn't an empty folder; choose another")
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as beside:
            folder = Path(beside) / path.name
            folder.mkdir()
            numbered = ((folder / f"frame_{i:06d}.png", frame) for i, frame in enumerate(frames))
            _in_background(numbered, lambda item: item[0].write_bytes(_png(item[1])))
            folder.replace(path)
    except OSError as error:
        raise MotionError(f"can't write frames to {path}: {error.strerror or error}; nothing was left") from error


def _png(frame: av.VideoFrame) -> bytes:
    context = av.CodecContext.create("png", "w")
    context.width, context.height, context.pix_fmt = frame.width, frame.height, "rgb24"
    context.time_base, context.thread_count = Fraction(1, 1), 1
    return b"".join(bytes(packet) for packet in (*context.encode(frame), *context.encode()))
