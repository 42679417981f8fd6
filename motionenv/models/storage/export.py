"""Export of a model's parameters: its Fourier series, traits and body."""

from typing import Any

import numpy as np

from motionenv.body import limbs, skeleton
from motionenv.models.base import GaitModel
from motionenv.models.registry import gait_model
from motionenv.types import MARKERS, POSE

_SHOWN = ("name", "low", "high", "mean", "gain", "unit", "share", "note")  # of a trait


def parameters(model: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Arrays and a JSON-serialisable description of a model's Fourier series, traits and body.

    All models have the body's `offsets` (16, 3), `limb_shifts` (limbs, 2, 3) and `limb_radii` (limbs, 2), in body
    heights. Models with components add `mean_scores` (q,), `deviations` (q,) and `traits` (n, q): the standard
    deviations along each component for one step of a trait. The rest depends on the treadmill:

    - "poses": Fourier coefficients `mean` (columns, 24) and `components` (q, columns, 24) of the channels of
      `motionenv.models.walking.preprocessing`. The columns are a constant, the cosines and the sines; of limbs that no
      walk of the model shows, `mean` is NaN and `components` 0. The log stride
      time [s] is `log_seconds_mean` () plus `log_seconds_weights` (q,) · standard deviations.
    - "markers": `mean` (5, 15, 3) [m], `components` (q, 5, 15, 3) and, likewise, the log frequency [Hz].

    Args:
        model: a name or path for `motionenv.load`, or a fitted model.

    Returns:
        The arrays by name, and the description. Its `treadmill` is None if motion has no cycles, its `activities` are
        those of a steerable model, and `learned_speeds` [m/s] are the least and the greatest that it learned from, None
        for any.

    Raises:
        MotionError: a model that makes no motion.
    """
    walkable = gait_model(model)
    treadmill = walkable.treadmill()
    if treadmill is None:
        body = walkable.body() or limbs.from_height()
        offsets, height, numbers = body.offsets / body.height, body.height, dict[str, np.ndarray]()
    else:
        offsets, height, numbers = treadmill.offsets, treadmill.height, treadmill.arrays
    components, found = walkable.components(), walkable.traits()
    if len(components):
        directions = np.array([trait.direction for trait in found])
        shown = {"mean_scores": components.means, "deviations": components.deviations, "traits": directions}
        numbers = shown | numbers
    description = {
        **_described(walkable, height), "components": len(components), "shares": components.shares.tolist(),
        "traits": [{name: getattr(trait, name) for name in _SHOWN} for trait in found],
        "activities": list(walkable.activities),
    }  # fmt: skip
    radii = limbs.limb_radii(1.0)
    shape = {"offsets": np.asarray(offsets), "limb_shifts": limbs.LIMB_SHIFTS, "limb_radii": radii}
    return shape | numbers, description


def _described(model: GaitModel, height: float) -> dict[str, Any]:
    treadmill = model.treadmill()
    return {
        "kind": model.kind, "about": model.about, "treadmill": None if treadmill is None else treadmill.frame,
        "steerable": model.steerable,
        "learned_speeds": [float(v) if np.isfinite(v) else None for v in model.learned_speeds()], "height": height,
        "ankle_height": skeleton.ANKLE_HEIGHT, "limb_segments": limbs.LIMB_SEGMENT.tolist(),
        "limb_nodes": limbs.LIMB_NODES.tolist(), "limbs": limbs.LIMBS,
        "head_radius": limbs.HEAD_RADIUS, "clothes": limbs.CLOTHES, "colours": limbs.COLOURS,
        "edges": skeleton.EDGES, "markers": MARKERS, "pose": POSE,
    }  # fmt: skip
