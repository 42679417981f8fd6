"""C3D: binary optical marker data (the C3D file format user guide, c3d.org), read with ezc3d.

ezc3d runs in a separate process, so that a damaged file that crashes it doesn't crash the caller.
"""

import io
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np

from motionenv._core.validation import checked_fps
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.readers.text import read_bytes, unique
from motionenv.mocap.units_axes import metres_per, upright
from motionenv.types import Markers

_BLOCK = 512
_INTEL, _DEC, _MIPS = 84, 85, 86
_SECONDS, _PER_MEGABYTE = 20, 4  # time limit; ezc3d needs 0.2 s to start, and 0.03 s per MB
_CHILD = Path(__file__).with_name("_ezc3d.py")
_NOT_POSITIONS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")


def read(path, fps: float | None = None, unit: str | float | None = None, up: str | None = None) -> Markers:
    """Read the markers and virtual points of a C3D file, without angles, forces etc. that are stored as points.

    A subject's name in front of a label ("Subject:NAME") is removed; repeated labels get "_2", "_3". Negative residuals
    and points at exactly (0, 0, 0) are gaps: NaN.

    Args:
        path: the file.
        fps: frame rate; overrides the file's POINT:RATE.
        unit: a name in `motionenv.mocap.units_axes.METRES` or metres per unit; overrides the file's POINT:UNITS.
        up: the file's vertical axis, "x", "y" or "z"; None uses POINT:Y_SCREEN, or "z" if the file doesn't have it.

    Returns:
        Positions [m], z up.

    Raises:
        FormatError: not a complete C3D file, a byte order that ezc3d can't read (SGI/MIPS), or a frame rate, unit or
            axis that must be given; names the block.
    """
    points, frames = _check_header(path, read_bytes(path))
    found = _run_ezc3d(path)
    positions = found["points"]
    if positions.shape[0] != points or (positions.shape[1] != frames and frames < 0xFFFF):
        got = f"{positions.shape[0]} points over {positions.shape[1]} frames"
        raise FormatError(path, f"the header says {points} points over {frames} frames, the data hold {got}", "block 1")
    labels = _labels(found, points)
    left_out = {str(label).strip() for kind in _NOT_POSITIONS for label in found.get(f"POINT:{kind}", ())}
    kept = [i for i, label in enumerate(labels) if label not in left_out]
    names = unique(labels[i].rpartition(":")[2].strip() or "unlabelled" for i in kept)
    positions = _with_gaps(path, positions[kept], found["residuals"][kept])
    world = upright(positions.transpose(1, 0, 2) * _scale(path, found, unit), _up(path, found, up))
    return Markers(names, world, _fps(path, found, fps), name=Path(path).stem)


def _check_header(path, raw: bytes) -> tuple[int, int]:
    """Number of points and frames from the validated header block.

    Raises:
        FormatError: not a C3D file, another byte order, or a truncated file.
    """
    start = (raw[0] - 1) * _BLOCK
    if raw[1:2] != b"\x50" or start < _BLOCK:
        raise FormatError(path, "isn't a C3D file: it must start with the parameter block's number and 0x50", "block 1")
    if len(raw) < start + _BLOCK:
        raise FormatError(path, f"is truncated: the parameters should start in block {raw[0]}", f"byte {len(raw)}")
    processor = raw[start + 3]
    if processor == _MIPS:
        problem = "is in SGI/MIPS byte order, which can't be read here; save it again as Intel (PC)"
        raise FormatError(path, problem, f"block {raw[0]}")
    if processor not in (_INTEL, _DEC):
        problem = f"the processor type must be 84 (Intel) or 85 (DEC), got {processor}"
        raise FormatError(path, problem, f"block {raw[0]}")
    points, analog, first, last = struct.unpack("<4H", raw[2:10])
    (data,) = struct.unpack("<H", raw[16:18])
    frames = last - first + 1
    if points < 1 or frames < 1 or data < 2:
        raise FormatError(path, f"has no data: {points} points, frames {first} to {last}, block {data}", "block 1")
    real = raw[13 if processor == _DEC else 15] >= 0x80  # a negative scale means floats
    need = (data - 1) * _BLOCK + frames * (4 * points + analog) * (4 if real else 2)
    if len(raw) < need:
        raise FormatError(path, f"is truncated: its header gives {need} bytes, it has {len(raw)}", f"byte {len(raw)}")
    return points, frames


def _run_ezc3d(path) -> dict[str, np.ndarray]:
    """Output of `_ezc3d.py` for the file.

    Raises:
        FormatError: it fails, crashes or doesn't finish.
    """
    seconds = _SECONDS + _PER_MEGABYTE * Path(path).stat().st_size / 1e6
    command = [sys.executable, "-P", str(_CHILD), str(path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        raise FormatError(path, f"ezc3d didn't finish within {seconds:.0f} s: the file is damaged") from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        why = f"ezc3d reports: {said[-1][:200]}" if said and done.returncode > 0 else "ezc3d crashed"
        raise FormatError(path, f"can't be read, the file is damaged: {why}", "parameters or data")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as found:
        return dict(found)


def _labels(found: dict[str, np.ndarray], points: int) -> list[str]:
    """A label for each point; beyond 255 they continue in LABELS2, LABELS3, ..."""
    keys = ["POINT:LABELS", *(f"POINT:LABELS{i}" for i in range(2, 258))]
    labels = [str(label).strip() for key in keys for label in found.get(key, ())]
    return [*labels[:points], *[""] * (points - len(labels))]


def _with_gaps(path, positions: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Positions (points, frames, 3) with NaN for every kind of gap."""
    if np.isinf(positions).any():
        point, frame, _ = np.argwhere(np.isinf(positions))[0]
        raise FormatError(path, "a position is infinite: the data are damaged", f"point {point + 1}, frame {frame + 1}")
    gap = (residuals < 0) | (positions == 0).all(-1) | np.isnan(positions).any(-1)
    return np.where(gap[..., None], np.nan, positions)


def _text(found: dict[str, np.ndarray], key: str) -> str:
    """The first text of a parameter; empty if it is missing."""
    values = found.get(f"POINT:{key}", np.array([])).ravel()
    return str(values[0]).strip() if values.size else ""


def _scale(path, found: dict[str, np.ndarray], unit) -> float:
    """Metres per file unit."""
    if unit is not None:
        return metres_per(unit)
    written = _text(found, "UNITS")
    try:
        return metres_per(written)
    except MotionError:
        problem = f"the unit of length must be a known one, got {written!r}; pass unit= (--unit), e.g. 'mm'"
        raise FormatError(path, problem, "POINT:UNITS") from None


def _up(path, found: dict[str, np.ndarray], up: str | None) -> str:
    """The file's vertical axis."""
    if up is not None:
        return up
    written = _text(found, "Y_SCREEN").lower()
    if not written:
        return "z"
    if written.lstrip("+") not in ("x", "y", "z"):
        problem = f'the axis up the screen must be +X, +Y or +Z, got {written!r}; pass up=, e.g. up="z"'
        raise FormatError(path, problem, "POINT:Y_SCREEN")
    return written.lstrip("+")


def _fps(path, found: dict[str, np.ndarray], fps: float | None) -> float:
    """Frame rate from the caller, the parameters or the header."""
    if fps is not None:
        return checked_fps(fps)
    rates = [*np.ravel(found.get("POINT:RATE", [])), float(found["header_rate"])]
    for rate in rates:
        if 0 < rate < np.inf:
            return float(rate)
    raise FormatError(path, "doesn't specify its frame rate; pass fps= (--fps)", "POINT:RATE")
