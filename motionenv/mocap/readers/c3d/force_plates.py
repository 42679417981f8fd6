"""Force plates of types 1 to 4 (C3D user guide, chapter "Force platform"), in the world frame.

A plate's own frame has its origin at the centre of the surface, x from the second corner to the first, y from the
fourth to the first, and z = x × y, usually down. With the force F and the moment M about the centre of the surface, the
centre of pressure is at x = −M_y/F_z, y = M_x/F_z.

Files differ from this in three ways, which their data tell: forces are the ground's or the foot's, but feet can't pull;
plates that nobody stands on show a load; corners are listed in another order, so that the pressure isn't below feet.
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
_EXTREMES, _END = (0.5, 99.5), 0.25  # percentiles of the vertical force, and share of their range at either end
_AT_REST = 0.1  # least share of samples without a load
_OFFSET = 50.0  # [N] of load that an empty plate may show; half the range of the force, if that is more
_LOW = 0.2  # [m] above the plate of points on feet
_FEW = 200  # samples that are compared with points
_AWAY, _CLOSER = 0.1, 0.5  # [m] of such points from the centre of pressure, and the share of it in a better order
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
    points: np.ndarray  # (frames, n, 3) [m], z up


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
    if len(columns) < n or columns.min() < 0 or columns.max() >= analog.channels.shape[1]:
        return None
    if _axes(own["CORNERS"]) is None:
        return None
    values = _without_baseline(analog, analog.channels[:, columns])
    units = [_unit(analog.parameters, int(column)) for column in columns]
    force, moment, at = _loads(kind, values, units, own, analog.metres)
    if (empty := _empty(force[:, 2])).any():
        force, moment = force - force[empty].mean(0), moment - moment[empty].mean(0)
    if at is None:
        at = _centre(force, moment)
    at[~(np.abs(force[:, 2]) >= _UNLOADED)] = np.nan
    plates = []
    for corners in _orders(own["CORNERS"]):
        axes = _axes(corners)
        world = upright(force @ axes, analog.up)
        if (world[:, 2] * np.abs(world[:, 2])).sum() < 0:  # feet can't pull: it is the force on the plate
            world = -world
        centre = upright(at @ axes + corners.mean(1) * analog.metres, analog.up)
        fps = analog.fps * analog.layout.per_frame
        plates.append(ForcePlate(upright(corners.T * analog.metres, analog.up), world, centre, fps))
    return _below_feet(plates, analog)


def _empty(normal: np.ndarray) -> np.ndarray:
    """Samples (n,) without a load, from the force [N] across the plate; none if somebody stands on it throughout.

    Their level is at one end of the range of the force: the one closer to zero.
    """
    if not np.isfinite(normal).all():
        return np.zeros(len(normal), dtype=bool)
    low, high = np.percentile(normal, _EXTREMES)
    near = _END * (high - low)
    level = min(np.median(normal[normal <= low + near]), np.median(normal[normal >= high - near]), key=abs)
    empty = np.abs(normal - level) < _UNLOADED
    return empty & (empty.mean() >= _AT_REST) & (abs(level) <= max(_OFFSET, 0.5 * (high - low)))


def _orders(corners: np.ndarray) -> list[np.ndarray]:
    """The corners (3, 4) as they are listed, and in the seven other orders in which they follow each other around."""
    crossing = [corners[:, order] for order in ([0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 1, 3])]
    around = min(crossing, key=lambda c: float(np.linalg.norm(c[:, 0] + c[:, 2] - c[:, 1] - c[:, 3])))
    return [np.roll(way, k, axis=1) for way in (around, around[:, ::-1]) for k in range(4)]


def _below_feet(plates: list[ForcePlate], analog: Analog) -> ForcePlate:
    """The first of the `plates`, which differ in the order of corners, or one that has its pressure below feet."""
    up, first = plates[0].force[:, 2], plates[0]
    loaded = np.flatnonzero((up > 0.5 * up.max()) & np.isfinite(first.centre).all(-1))
    loaded = loaded[:: len(loaded) // _FEW + 1]
    points = analog.points[loaded // analog.layout.per_frame]
    high = ~(points[..., 2] - first.corners[:, 2].mean() < _LOW)

    def away(plate: ForcePlate) -> float:
        """Root mean square distance [m] of the centre of pressure from the closest point."""
        apart = np.linalg.norm((points - plate.centre[loaded, None])[..., :2], axis=-1)
        closest = np.where(high, np.inf, apart).min(1, initial=np.inf)
        return float(np.sqrt((closest[np.isfinite(closest)] ** 2).mean())) if np.isfinite(closest).any() else np.inf

    best = min(plates, key=away)
    return best if away(first) > _AWAY and away(best) < _CLOSER * away(first) else first


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
