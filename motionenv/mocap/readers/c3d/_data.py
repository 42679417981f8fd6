"""The header and the data section of a C3D file: points and analog samples."""

from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.readers.c3d._parameters import BLOCK, Encoding, Parameters

_EVENTS_KEY, _EVENTS = 12345, 18
_FULL = 0xFFFF  # where a 16-bit counter stands still, or starts again


@dataclass(frozen=True)
class Layout:
    """Layout of the data section."""

    first: int  # number of the first frame
    points: int
    analog: int  # values of all channels per frame
    frames: int
    per_frame: int  # analog samples of each channel per frame
    start: int  # first byte
    real: bool  # whether the values are floats
    scale: float  # file units per step of integer points
    rate: float  # frames per second of the header
    events: tuple[tuple[float, str], ...] = ()  # seconds since frame 1 and label of the header's events


def read_layout(path: str | Path, raw: bytes, encoding: Encoding, parameters: Parameters) -> Layout:
    """The layout of the data, from the header and the parameters.

    The two may disagree: counters of 16 bits overflow, some programs count analog values per sample and not per frame.
    The numbers that account for the file's length are right; if none do, the header's, if the file is long enough.

    Raises:
        FormatError: no point, no frame, or less data than any of the numbers ask for.
    """
    counts = encoding.counts(raw[:BLOCK]).astype(int)
    points, analog, first, last = counts[1:5]
    start_field, end_field = (_frame(parameters, f"TRIAL:ACTUAL_{which}_FIELD") for which in ("START", "END"))
    start = (counts[8] or int(parameters.number("POINT:DATA_START", 0))) - 1
    scale, rate = encoding.reals(raw[12:16])[0], encoding.reals(raw[20:24])[0]
    if start < 1:
        raise FormatError(path, "doesn't say in which block its data start", "block 1")
    size = 4 if scale < 0 else 2
    room = len(raw) - start * BLOCK
    frame_counts = [
        last - first + 1, end_field - start_field + 1 if start_field and end_field else 0,
        _first(parameters, "POINT:LONG_FRAMES"), _first(parameters, "POINT:FRAMES"),
    ]  # fmt: skip
    if last == _FULL:  # the header's count may stand still: trust it least
        frame_counts = frame_counts[1:] + frame_counts[:1]
    every = list(product(
        _distinct(*frame_counts), _distinct(points, _first(parameters, "POINT:USED")),
        _distinct(analog, _analog(parameters), least=0),
    ))  # fmt: skip
    if not every:
        what = "frames" if not _distinct(*frame_counts) else "points"
        problem = f"has no {what}: {points} points, frames {first} to {last}; there is no motion in it"
        raise FormatError(path, problem, "block 1")
    need = {choice: choice[0] * (4 * choice[1] + choice[2]) * size for choice in every}
    fitting = [choice for choice in every if need[choice] <= room]
    if not fitting:
        least = start * BLOCK + min(need.values())
        raise FormatError(path, f"is truncated: its header gives {least} bytes, it has {len(raw)}", f"byte {len(raw)}")
    exact = [choice for choice in fitting if room - need[choice] < BLOCK]
    frames, points, analog = (exact or fitting)[0]
    if not exact and last == _FULL:
        frames = room // (size * (4 * points + analog))
    channels = _first(parameters, "ANALOG:USED")
    per_frame = analog // channels if channels and analog % channels == 0 else 0
    return Layout(
        _first_frame(int(first), start_field, end_field, frames), points, analog, frames, per_frame, start * BLOCK,
        size == 4, abs(float(scale)), float(rate), _events(raw, encoding),
    )  # fmt: skip


def _events(raw: bytes, encoding: Encoding) -> tuple[tuple[float, str], ...]:
    """The header's events: up to 18 times, and labels of four letters."""
    key, many = encoding.counts(raw[298:302])
    if key != _EVENTS_KEY or not 0 < many <= _EVENTS:
        return ()
    labels = [raw[396 + 4 * i : 400 + 4 * i].decode("latin-1").strip("\0 ") for i in range(many)]
    return tuple(zip(map(float, encoding.reals(raw[304 : 304 + 4 * many])), labels, strict=True))


def _distinct(*counts: int, least: int = 1) -> list[int]:
    return list(dict.fromkeys(int(c) for c in counts if c >= least))


def _first(parameters: Parameters, key: str) -> int:
    return int(next(iter(parameters.counts(key).ravel()), 0))


def _frame(parameters: Parameters, key: str) -> int:
    """The number of a frame that TRIAL gives as one number or as two 16-bit words, the lower first; 0 without."""
    words = parameters.counts(key).ravel(order="F")[:2]
    return int(words @ [1, _FULL + 1][: len(words)])


def _first_frame(header: int, start: int, end: int, frames: int) -> int:
    """Number of the first of `frames`: the header's, unless that stands still at 65535 or began again from 0.

    `start` and `end` are the numbers of the first and the last that TRIAL gives, 0 without.
    """
    start = start or max(end - frames + 1, 0)
    return start if start > _FULL and header in (_FULL, start & _FULL) else header


def _analog(parameters: Parameters) -> int:
    each = parameters.number("ANALOG:RATE", 0) / (parameters.number("POINT:RATE", 0) or np.inf)
    return _first(parameters, "ANALOG:USED") * max(round(each), 0) if np.isfinite(each) else -1


def read_points(path: str | Path, raw: bytes, encoding: Encoding, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Points (frames, points, 3) [file units], NaN in gaps, and analog values (frames, values) as stored.

    Gaps are a negative fourth word, points at exactly (0, 0, 0), and NaN.

    Raises:
        FormatError: an infinite position; names it.
    """
    width = 4 * layout.points + layout.analog
    raw = raw[layout.start : layout.start + layout.frames * width * (4 if layout.real else 2)]
    values = (encoding.reals(raw) if layout.real else encoding.words(raw)).reshape(layout.frames, width)
    with np.errstate(invalid="ignore"):  # signalling NaN
        words = values[:, : 4 * layout.points].reshape(layout.frames, layout.points, 4).astype(np.float64)
    points = words[..., :3] if layout.real else words[..., :3] * layout.scale
    gap = ~(words[..., 3] >= 0) | (points == 0).all(-1) | np.isnan(points).any(-1)
    lost = ~gap & np.isinf(points).any(-1)
    if lost.any():
        frame, point = np.argwhere(lost)[0]
        raise FormatError(path, "a position is infinite: the data are damaged", f"point {point + 1}, frame {frame + 1}")
    return np.where(gap[..., None], np.nan, points), values[:, 4 * layout.points :]


def analog_channels(parameters: Parameters, layout: Layout, stored: np.ndarray) -> np.ndarray | None:
    """Analog channels (samples, channels) in the units of ANALOG:UNITS, from values (frames, n) of `read_points`.

    None if there are none or they don't add up.
    """
    if not layout.per_frame:
        return None
    channels = layout.analog // layout.per_frame
    samples = stored.reshape(-1, channels)
    unsigned = parameters.text("ANALOG:FORMAT").upper() == "UNSIGNED"
    if unsigned and not layout.real:
        samples = samples.view(samples.dtype.str.replace("i", "u"))
    scale, offset = (_per_channel(parameters, name, channels) for name in ("SCALE", "OFFSET"))
    if scale is None or offset is None:
        return None
    if unsigned:
        offset = np.where(offset < 0, offset + 65536, offset)
    with np.errstate(invalid="ignore", over="ignore"):
        return (samples.astype(np.float64) - offset) * scale * parameters.number("ANALOG:GEN_SCALE", 1.0)


def _per_channel(parameters: Parameters, name: str, channels: int) -> np.ndarray | None:
    """ANALOG:`name` and its continuations (beyond 255), one number per channel; None if some are missing."""
    keys = [f"ANALOG:{name}", *(f"ANALOG:{name}{i}" for i in range(2, 258))]
    found = np.concatenate([parameters.numbers(key).ravel() for key in keys])
    return found[:channels] if len(found) >= channels else None
