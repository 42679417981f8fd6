"""Conversion of a tree to and from the arrays and JSON-serialisable settings of a model file."""

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from motionenv.body.limbs import current_radii
from motionenv.errors import ModelError, MotionError
from motionenv.models.motion_tree.database import Database
from motionenv.models.motion_tree.features import WINDOW
from motionenv.models.motion_tree.forecast import Forecast
from motionenv.models.motion_tree.search.basis import Basis
from motionenv.models.motion_tree.search.exact import BLOCK, ExactSampler
from motionenv.models.motion_tree.search.tree import CoefficientTree
from motionenv.models.motion_tree.search.tree_kernels import NODE, is_whole
from motionenv.types import Skeleton

if TYPE_CHECKING:
    from motionenv.models.motion_tree.model import MotionTree

_PARTS = {"basis": Basis, "index": ExactSampler, "descent": CoefficientTree, "forecast": Forecast}
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
    """Restore `tree` from `arrays` and `meta` as returned by `pack`; keeps the arrays without a copy.

    Raises:
        ModelError: arrays of inconsistent shapes, or with indices out of range.
    """
    try:
        tree.database_ = _database(arrays, meta)
        for name, kind in _PARTS.items():
            known = {f"{name}_{field.name}": field.name for field in fields(kind)}  # files of older versions have more
            own = {known[key]: value for key, value in arrays.items() if key in known}
            if name == "descent":
                own["nodes"] = own["nodes"].view(NODE)[:, 0]
            setattr(tree, f"{name}_", kind(**own, **meta[name]))
        tree.frames_ = arrays["frames"]
    except MotionError as error:
        raise ModelError(f"the database is damaged ({error}): build it again") from None
    wrong = _misshapen(tree) or _misplaced(tree)
    if wrong:
        raise ModelError(f"the database is damaged ({wrong}): build it again")


def _misshapen(tree: "MotionTree") -> str:
    """Message about the arrays of `tree` with inconsistent shapes or types; empty if there are none."""
    database, basis, index, descent = tree.database_, tree.basis_, tree.index_, tree.descent_
    n, b, p, sequences = len(tree.frames_), len(basis.deviation), len(basis.channels), len(database.clips)
    expected = {
        "frames": (tree.frames_, (n,), "i4"),
        "database_poses": (database.poses, (len(database.poses), 25), "f4"),
        "database_starts": (database.starts, (sequences + 1,), "i8"),
        "database_mirrored": (database.mirrored, (sequences,), "b1"),
        "basis_channels": (basis.channels, (p,), "i8"),
        "basis_mean": (basis.mean, (p,), "f8"),
        "basis_scale": (basis.scale, (p,), "f8"),
        "basis_components": (basis.components, (b, WINDOW, p), "f8"),
        "basis_centre": (basis.centre, (WINDOW, p), "f8"),
        "index_blocks": (index.blocks, (-(-n // BLOCK), b, BLOCK), "f4"),
        "descent_starts": (descent.starts, (len(descent.nodes) + 2,), "i4"),
        "descent_members": (descent.members, (n,), "i4"),
        **{
            f"forecast_{name}": (getattr(tree.forecast_, name), (25,), "f8")
            for name in ("pose", "velocity", "deviation", "plain_deviation")
        },
    }
    wrong = [
        f"{name} is {array.dtype} {array.shape}, expected {np.dtype(kind)} {shape}"
        for name, (array, shape, kind) in expected.items()
        if array.shape != shape or array.dtype != kind
    ]
    if index.n != n or descent.depth != b or n < 1:
        wrong.append(f"{index.n} points and depth {descent.depth}, expected {n} and {b}")
    return "; ".join(wrong)


def _misplaced(tree: "MotionTree") -> str:
    """Message about arrays with indices that would make kernels read out of bounds; empty if there are none."""
    database, n, b = tree.database_, len(tree.frames_), len(tree.basis_.deviation)
    lengths, channels = np.diff(database.starts), tree.basis_.channels
    inside = {
        "database_starts": database.starts[0] == 0
        and database.starts[-1] == len(database.poses)
        and lengths.min() > WINDOW
        and (lengths - WINDOW).sum() == n,
        "basis_channels": channels.size and channels.min() >= 0 and channels.max() < 50,
        "frames": tree.frames_.min() >= WINDOW - 1 and tree.frames_.max() < len(database.poses) - 1,
        "descent": is_whole(tree.descent_.nodes, tree.descent_.starts, tree.descent_.members, b),
        "index_blocks": np.isposinf(tree.index_.blocks[-1, :, n - n // BLOCK * BLOCK :]).all() or n % BLOCK == 0,
    }
    return "; ".join(f"{name} has indices out of range" for name, fine in inside.items() if not fine)


def _plain(array: np.ndarray) -> np.ndarray:
    """`array` made contiguous; records become bytes (n, size), as model files hold numbers only."""
    array = np.ascontiguousarray(array)
    if array.dtype.fields is None:
        return array
    return array.view(np.uint8).reshape(len(array), array.dtype.itemsize)


def _database(arrays: dict[str, np.ndarray], meta: dict) -> Database:
    labels = {
        name: tuple(np.array(meta["database"][name], dtype=object)[arrays[f"database_{name}"]]) for name in _LABELS
    }
    height = meta["skeleton"]["height"]
    skeleton = Skeleton(arrays["skeleton_offsets"], current_radii(arrays["skeleton_radii"], height), height)
    return Database(
        arrays["database_poses"], arrays["database_starts"], mirrored=arrays["database_mirrored"], skeleton=skeleton,
        **labels,
    )  # fmt: skip
