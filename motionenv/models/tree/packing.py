"""A tree as plain arrays and what JSON can hold, and back: what lies in a model file."""

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from motionenv.errors import ModelError, MotionError
from motionenv.models.tree._descent_kernels import NODE
from motionenv.models.tree.basis import Basis
from motionenv.models.tree.database import Database
from motionenv.models.tree.descent import CoefficientTree
from motionenv.models.tree.exact import KernelIndex
from motionenv.models.tree.forecast import Forecast
from motionenv.types import Skeleton

if TYPE_CHECKING:
    from motionenv.models.tree.model import MotionTree

_PARTS = {"basis": Basis, "index": KernelIndex, "descent": CoefficientTree, "forecast": Forecast}
_LABELS = ("clips", "activities", "persons")


def pack(tree: "MotionTree") -> tuple[dict[str, np.ndarray], dict]:
    """Arrays and settings of a fitted `tree`."""
    arrays: dict[str, np.ndarray] = {"frames": tree.frames_}
    meta: dict[str, Any] = {"splits": tree.splits, "part": tree.part, "database": {}}
    for name in _PARTS:
        part = getattr(tree, f"{name}_")
        values = {field.name: getattr(part, field.name) for field in fields(part)}
        arrays |= {f"{name}_{key}": _plain(value) for key, value in values.items() if isinstance(value, np.ndarray)}
        meta[name] = {key: value for key, value in values.items() if not isinstance(value, np.ndarray)}
    database = tree.database_
    for name in ("poses", "starts", "mirrored"):
        arrays[f"database_{name}"] = getattr(database, name)
    for name in _LABELS:
        labels, which = np.unique(getattr(database, name), return_inverse=True)
        arrays[f"database_{name}"], meta["database"][name] = which.astype(np.int32), labels.tolist()
    skeleton = database.skeleton
    arrays |= {"skeleton_offsets": skeleton.offsets, "skeleton_radii": skeleton.radii}
    meta["skeleton"] = {"height": skeleton.height}
    return arrays, meta


def unpack(tree: "MotionTree", arrays: dict[str, np.ndarray], meta: dict) -> None:
    """Fill `tree` with what `pack` gave as `arrays` and `meta`; arrays are kept as they are, without a copy.

    Raises:
        ModelError: arrays that don't belong together.
    """
    try:
        tree.database_ = _database(arrays, meta)
        for name, kind in _PARTS.items():
            own = {key.removeprefix(f"{name}_"): value for key, value in arrays.items() if key.startswith(f"{name}_")}
            if name == "descent":
                own["nodes"] = own["nodes"].view(NODE)[:, 0]
            setattr(tree, f"{name}_", kind(**own, **meta[name]))
        tree.frames_ = arrays["frames"]
    except MotionError as error:
        raise ModelError(f"the database is damaged ({error}): build it again") from None
    n, b = len(tree.frames_), len(tree.basis_.deviation)
    sizes = {
        "index_blocks": (arrays["index_blocks"].shape, (-(-n // 32), b, 32)),
        "database_starts": (tree.database_.starts[-1:].tolist(), [len(tree.database_.poses)]),
        "descent_members": (arrays["descent_members"].shape, (n,)),
        "basis_components": (tree.basis_.components.shape, (b, 10, len(tree.basis_.channels))),
    }
    wrong = [f"{name} is of {have} where {want} belong" for name, (have, want) in sizes.items() if have != want]
    if wrong:
        raise ModelError(f"the database is damaged ({'; '.join(wrong)}): build it again")


def _plain(array: np.ndarray) -> np.ndarray:
    """`array` in one piece, or where it holds records their bytes (n, size): model files hold numbers only."""
    array = np.ascontiguousarray(array)
    if array.dtype.fields is None:
        return array
    return array.view(np.uint8).reshape(len(array), array.dtype.itemsize)


def _database(arrays: dict[str, np.ndarray], meta: dict) -> Database:
    labels = {
        name: tuple(np.array(meta["database"][name], dtype=object)[arrays[f"database_{name}"]]) for name in _LABELS
    }
    skeleton = Skeleton(arrays["skeleton_offsets"], arrays["skeleton_radii"], meta["skeleton"]["height"])
    return Database(
        arrays["database_poses"], arrays["database_starts"], mirrored=arrays["database_mirrored"], skeleton=skeleton,
        **labels,
    )  # fmt: skip
