"""Read calibrated cameras from files: our own JSON, and the TOML of anipose and Pose2Sim."""

import json
import tomllib
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError, MotionError
from motionenv.types import Camera


def read_camera(path: str | Path, name: str | None = None) -> Camera:
    """Read a camera, by `name` if there are several: a TOML table's name, or its `name` entry.

    - `.json`: an object with K (3 × 3), R (3 × 3), t (3) [m], width and height, as in `motionenv.types.Camera`.
    - `.toml`: a table per camera with size, matrix, rotation (a rotation vector) and translation [m]; for the lens see
      `read_distortion`.

    Raises:
        FormatError: not such a file.
        MotionError: no camera of that name, or several and no name.
    """
    path = Path(path)
    table = _table(path, name)
    try:
        if path.suffix.lower() == ".json":
            return Camera(table["K"], table["R"], table["t"], table["width"], table["height"])
        return _of_table(table)
    except KeyError as error:
        raise FormatError(path, f"lacks {error.args[0]!r}") from None
    except (TypeError, IndexError, ValueError) as error:
        raise FormatError(path, f"isn't a valid camera: {error}") from error


def read_distortion(path: str | Path, name: str | None = None) -> list[float] | None:
    """OpenCV's coefficients of a camera's lens: `distortions` of a TOML table or JSON object; None if it has none.

    Raises:
        FormatError: not such a file, or a fisheye lens, whose model is another.
        MotionError: as in `read_camera`.
    """
    table = _table(Path(path), name)
    if table.get("fisheye"):
        raise FormatError(path, "has a fisheye lens: undistort points or pictures first, and set fisheye = false")
    return table.get("distortions")


def _table(path: Path, name: str | None) -> dict:
    """What a file says of one camera."""
    if path.suffix.lower() not in (".json", ".toml"):
        raise FormatError(path, "isn't a camera file: the suffix must be .json or .toml")
    try:
        text = path.read_text(encoding="utf-8")
        found = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except (OSError, ValueError) as error:
        raise FormatError(path, f"can't be read as a camera: {getattr(error, 'strerror', None) or error}") from error
    if not isinstance(found, dict):
        raise FormatError(path, "must hold an object with K, R, t, width and height")
    return found if path.suffix.lower() == ".json" else _chosen(path, found, name)


def _chosen(path: Path, tables: dict, name: str | None) -> dict:
    cameras = {k: t for k, t in tables.items() if isinstance(t, dict) and "matrix" in t}
    if not cameras:
        raise FormatError(path, "has no camera: no table with a matrix")
    names = [str(n) for k, t in cameras.items() for n in (k, t.get("name")) if n]
    if name is None and len(cameras) > 1:
        raise MotionError(f"{path} has {len(cameras)} cameras; select one by name: {', '.join(cameras)}")
    for key, table in cameras.items():
        if name is None or name in (key, table.get("name")):
            return table
    raise MotionError(f"{path} has no camera {name!r}; it has {', '.join(dict.fromkeys(names))}")


def _of_table(table: dict) -> Camera:
    from scipy.spatial.transform import Rotation

    width, height = (int(n) for n in table["size"])
    rotation = Rotation.from_rotvec(np.asarray(table["rotation"], dtype=np.float64)).as_matrix()
    return Camera(table["matrix"], rotation, table["translation"], width, height)
