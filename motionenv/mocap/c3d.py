"""C3D: optical markers in binary (the C3D file format user guide, c3d.org), read with ezc3d.

ezc3d runs in a process of its own, where a damaged file that crashes it can't take the caller along.
"""

import io
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.text import read_bytes, unique
from motionenv.mocap.world import metres_per, upright
from motionenv.types import Markers, checked_fps

_BLOCK = 512
_INTEL, _DEC, _MIPS = 84, 85, 86
_SECONDS, _PER_MEGABYTE = 20, 4  # time allowed; ezc3d takes 0.2 s with its start, and 0.03 s per MB
_CHILD = Path(__file__).with_name("_ezc3d.py")
_NOT_POSITIONS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")


def read(path, fps: float | None = None, unit: str | float | None = None, up: str | None = None) -> Markers:
    """The markers and virtual points of a C3D file, without the angles, forces and the like that it stores as points.

    A subject's name in front of a label ("Subject:NAME") is left out; labels that repeat get "_2", "_3". Negative
    residuals and points at exactly (0, 0, 0) are gaps: NaN.

    Args:
        path: the file.
        fps: frames per second, in place of the file's POINT:RATE.
        unit: a name in `motionenv.mocap.world.METRES` or metres per unit, in place of the file's POINT:UNITS.
        up: which of the file's axes points up, "x", "y" or "z"; None takes POINT:Y_SCREEN, or "z" where the file
            hasn't that either.

    Returns:
        Positions [m], z up.

    Raises:
        FormatError: not a whole C3D file, a byte order that ezc3d can't read (SGI/MIPS), or a frame rate, unit or
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
    """Points and frames by the header block, once it and the sizes make sense.

    Raises:
        FormatError: this is no C3D file, or one of another byte order, or one that is cut off.
    """
    start = (raw[0] - 1) * _BLOCK
    if raw[1:2] != b"\x50" or start < _BLOCK:
        raise FormatError(path, "is no C3D file: it must start with the parameter block's number and 0x50", "block 1")
    if len(raw) < start + _BLOCK:
        raise FormatError(path, f"is cut off: the parameters should start in block {raw[0]}", f"byte {len(raw)}")
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
    real = raw[13 if processor == _DEC else 15] >= 0x80  # the sign of the scale: negative means floats
    need = (data - 1) * _BLOCK + frames * (4 * points + analog) * (4 if real else 2)
    if len(raw) < need:
        raise FormatError(path, f"is cut off: its header speaks of {need} bytes, it has {len(raw)}", f"byte {len(raw)}")
    return points, frames


def _run_ezc3d(path) -> dict[str, np.ndarray]:
    """What `_ezc3d.py` finds in the file.

    Raises:
        FormatError: it fails, crashes or doesn't end.
    """
    seconds = _SECONDS + _PER_MEGABYTE * Path(path).stat().st_size / 1e6
    command = [sys.executable, "-P", str(_CHILD), str(path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        raise FormatError(path, f"ezc3d doesn't end within {seconds:.0f} s: the file is damaged") from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        why = f"ezc3d says: {said[-1][:200]}" if said and done.returncode > 0 else "ezc3d crashes on it"
        raise FormatError(path, f"can't be read, the file is damaged: {why}", "parameters or data")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as found:
        return dict(found)


def _labels(found: dict[str, np.ndarray], points: int) -> list[str]:
    """A label for each point; beyond 255 they go on in LABELS2, LABELS3, ..."""
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
    """The first text of a parameter; empty where it is missing."""
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
    """The file's axis that points up."""
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
    """Frames per second of the caller, the parameters or the header."""
    if fps is not None:
        return checked_fps(fps)
    rates = [*np.ravel(found.get("POINT:RATE", [])), float(found["header_rate"])]
    for rate in rates:
        if 0 < rate < np.inf:
            return float(rate)
    raise FormatError(path, "doesn't say its frame rate; pass fps= (--fps)", "POINT:RATE")
