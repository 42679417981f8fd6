"""Force plates of types 1 to 4 (C3D user guide, chapter "Force platform"), in the world frame.

A plate's own frame has its origin at the centre of the surface, x from the second corner to the first, y from the
fourth to the first, and z = x × y, usually down. With the force F and the moment M about the centre of the surface, the
centre of pressure is at x = −M_y/F_z, y = M_x/F_z.
"""

import re
from dataclasses import dataclass

import numpy as np

from motionenv.mocap.readers.c3d._data import Layout
from motionenv.mocap.readers.c3d._parameters import Parameters
from motionenv.mocap.units_axes import file_metres, upright
from motionenv.types import ForcePlate

_LEVEL = 0.95  # cosine between the normal of a plate in the floor and the vertical, at least
_UNLOADED = 10.0  # [N] below which the centre of pressure is noise
_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}  # by type
_NEWTONS = {"kn": 1000.0, "lbf": 4.4482216, "lb": 4.4482216}


@dataclass(frozen=True)
class Analog:
    """The analog data of a trial."""

    parameters: Parameters  # of the file
    layout: Layout  # of its data
    channels: np.ndarray  # (samples, channels), in their units
    metres: float  # per unit of length
    up: str  # the file's vertical axis
    fps: float  # frames per second


def read_plates(analog: Analog) -> tuple[ForcePlate, ...]:
    """The plates whose description and data are whole; a damaged one, or one of another type, is left out."""
    parameters = analog.parameters
    shapes = {"CORNERS": (3, 4), "ORIGIN": (3,), "CHANNEL": (None,), "CAL_MATRIX": (6, 6)}
    described = {name: _by_plate(parameters, name, shape) for name, shape in shapes.items()}
    found = []
    for i, kind in enumerate(parameters.counts("FORCE_PLATFORM:TYPE").ravel()[: _used(parameters)]):
        own = {name: value[..., i] for name, value in described.items() if value is not None and i < value.shape[-1]}
        with np.errstate(all="ignore"):  # damaged numbers, which make no plate
            plate = _plate(int(kind), own, analog)
        if plate is not None:
            found.append(plate)
    return tuple(found)


def plates_up(parameters: Parameters) -> str | None:
    """The axis of the file, "x", "y" or "z", to which all plates are perpendicular; None without."""
    corners = _by_plate(parameters, "CORNERS", (3, 4))
    with np.errstate(all="ignore"):
        found = [_axes(corners[..., i]) for i in range(corners.shape[-1])] if corners is not None else []
    normals = [np.abs(axes[2]) for axes in found[: _used(parameters)] if axes is not None]
    if not normals or min(normal.max() for normal in normals) < _LEVEL:
        return None
    axes = {"xyz"[normal.argmax()] for normal in normals}
    return axes.pop() if len(axes) == 1 else None


def _used(parameters: Parameters) -> int:
    return int(parameters.number("FORCE_PLATFORM:USED", 0) or 0)


def _by_plate(parameters: Parameters, name: str, shape: tuple[int | None, ...]) -> np.ndarray | None:
    """A parameter with the plates on its last axis, which files of one plate leave out; None in another shape."""
    value = parameters.numbers(f"FORCE_PLATFORM:{name}")
    if value.ndim == len(shape):
        value = value[..., None]
    fits = value.ndim == len(shape) + 1 and all(w in (None, h) for w, h in zip(shape, value.shape, strict=False))
    return value if fits else None


def _plate(kind: int, own: dict[str, np.ndarray], analog: Analog) -> ForcePlate | None:
    """The plate of type `kind` that `own` parameters describe; None if it isn't whole."""
    n = _CHANNELS.get(kind)
    if n is None or not {"CORNERS", "ORIGIN", "CHANNEL"} <= set(own) or (kind == 4 and "CAL_MATRIX" not in own):
        return None
    columns = own["CHANNEL"][:n].astype(int) - 1
    axes = _axes(own["CORNERS"])
    if len(columns) < n or columns.min() < 0 or columns.max() >= analog.channels.shape[1] or axes is None:
        return None
    values = _without_baseline(analog, analog.channels[:, columns])
    units = [_unit(analog.parameters, int(column)) for column in columns]
    force, moment, at = _loads(kind, values, units, own, analog.metres)
    if at is None:
        at = _centre(force, moment)
    at[~(np.abs(force[:, 2]) >= _UNLOADED)] = np.nan
    world = upright(force @ axes, analog.up)
    if np.sign(world[np.abs(world[:, 2]) >= _UNLOADED, 2]).sum() < 0:  # feet can't pull: it is the force on the plate
        world = -world
    centre = upright(at @ axes + own["CORNERS"].mean(1) * analog.metres, analog.up)
    corners = upright(own["CORNERS"].T * analog.metres, analog.up)
    return ForcePlate(corners, world, centre, analog.fps * analog.layout.per_frame)


def _axes(corners: np.ndarray) -> np.ndarray | None:
    """The plate's x, y, z in the file's frame, (3, 3), one per row; None if the corners (3, 4) span no surface."""
    x, y = corners[:, 0] - corners[:, 1], corners[:, 0] - corners[:, 3]
    z = np.cross(x, y)
    if not np.isfinite(corners).all() or not 0 < np.linalg.norm(z) < np.inf:
        return None
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])


def _without_baseline(analog: Analog, values: np.ndarray) -> np.ndarray:
    """Values less their mean over the unloaded frames of FORCE_PLATFORM:ZERO; (1, 0) or (0, 0) means none."""
    layout = analog.layout
    zero = analog.parameters.numbers("FORCE_PLATFORM:ZERO").ravel()
    if len(zero) != 2 or not 1 <= zero[0] <= zero[1] <= layout.frames:
        return values
    first, last = (zero - [1, 0]).astype(int) * layout.per_frame
    return values - values[first:last].mean(0)


def _unit(parameters: Parameters, column: int) -> str:
    units = parameters.texts("ANALOG:UNITS")
    return "".join(c for c in units[column].lower() if c.isalpha()) if column < len(units) else ""


def _loads(
    kind: int, values: np.ndarray, units: list[str], own: dict[str, np.ndarray], metres: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Force (samples, 3) [N], moment about the surface's centre [N m], and centre of pressure [m] if it is measured."""
    newtons = _NEWTONS.get(units[0], 1.0)
    origin = own["ORIGIN"] * metres
    if kind == 1:
        at = np.zeros((len(values), 3))
        at[:, :2] = values[:, 3:5] * (file_metres(units[3]) or metres)
        return values[:, :3] * newtons, np.zeros((len(values), 3)), at
    if kind == 3:
        return *_kistler(values * newtons, origin), None
    if kind == 4:
        values = values @ own["CAL_MATRIX"].T
    force = values[:, :3] * newtons
    # A moment's unit is such as "nmm"; without one, it is in newtons times the file's unit of length.
    arm = metres if kind == 4 else file_metres(re.sub("^(newtons?|nt?)", "", units[3])) or metres
    below = -origin if origin[2] > 0 else origin  # from the transducer to the surface; some files give the reverse
    return force, values[:, 3:] * arm + np.cross(force, below), None


def _kistler(values: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment of type 3: fx12, fx34, fy14, fy23, fz1 to fz4; the sensors are at (±a, ±b), a, b = `origin`."""
    x12, x34, y14, y23, z1, z2, z3, z4 = values.T
    a, b, _ = origin
    force = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], -1)
    moment = np.stack([b * (z1 + z2 - z3 - z4), a * (-z1 + z2 + z3 - z4), b * (x34 - x12) + a * (y14 - y23)], -1)
    depth = -abs(origin[2]) * np.array([0.0, 0.0, 1.0])
    return force, moment + np.cross(force, depth)


def _centre(force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    at = np.zeros_like(force)
    at[:, 0], at[:, 1] = -moment[:, 1] / force[:, 2], moment[:, 0] / force[:, 2]
    return at
