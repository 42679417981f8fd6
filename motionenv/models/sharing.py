"""What others need to make a model's walks themselves: the page combines mean and components in the browser."""

from typing import Any

import numpy as np

from motionenv.body.skeleton import (
    ANKLE_HEIGHT,
    CLOTHES,
    COLOURS,
    EDGES,
    LIMB_NODES,
    LIMB_SEGMENT,
    LIMB_SHIFTS,
    from_height,
    limb_radii,
)
from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.synthesis import components
from motionenv.models.traits import traits
from motionenv.models.walking import WalkingModel
from motionenv.types import MARKERS, POSE


def parameters(model) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Arrays and a JSON-able description with which `motionenv.models.inplace` can be computed elsewhere.

    Every model: the body's `offsets` (16, 3), `limb_shifts` (limbs, 2, 3) and `limb_radii` (limbs, 2), all in body
    heights. Models with components: `mean_scores`, `deviations` (q,) and `traits` (n, q), standard deviations along
    each component for one step of a trait; and

    - a `WalkingModel`: Fourier coefficients `mean` (columns, 24) and `components` (q, columns, 24) of the channels of
      `motionenv.models.gait`, columns being a constant, cosines and sines; the log stride time [s] as
      `log_seconds_mean` () plus `log_seconds_weights` (q,) · standard deviations;
    - `Eigenwalkers`: `mean` (5, 15, 3) [m], `components` (q, 5, 15, 3) and the log frequency [Hz] likewise.

    The description of a tree tells the `activities` that it knows.

    Args:
        model: fitted.

    Raises:
        MotionError: a model that makes no motion.
    """
    if model.kind == "tree":
        body, activities = model.database_.skeleton, sorted(set(model.database_.activities))
        return _body(body.offsets / body.height), _described(model, body.height, 0) | {"activities": activities}
    mean, deviation = components(model)
    found = traits(model)
    shared = {"mean_scores": mean, "deviations": deviation, "traits": np.array([t.direction for t in found])}
    named = [{n: getattr(t, n) for n in ("name", "low", "high", "mean", "gain", "unit", "share")} for t in found]
    if isinstance(model, WalkingModel):
        special, offsets, height = _walking(model, deviation), model.proportions_, model.height_
        share = model.fpca_.explained_variance_ratio_
    else:
        special, offsets, height = _eigenwalkers(model), from_height(1.0).offsets, 1.75
        share = model.explained_variance_ratio_
    description = _described(model, height, len(mean)) | {"traits": named, "shares": share.tolist()}
    return _body(offsets) | shared | special, description


def _walking(model: WalkingModel, deviation) -> dict[str, np.ndarray]:
    """Series and stride times of a `WalkingModel`; columns of the basis have amplitude 1."""
    fpca, q = model.fpca_, len(deviation)
    scale = np.full(2 * fpca.n_harmonics - 1, np.sqrt(2 / len(fpca.mean_)))
    scale[0] = np.sqrt(1 / len(fpca.mean_))
    steps = model.person_mean_[:q] + np.concatenate([np.zeros((1, q)), np.diag(deviation)])
    log_seconds = np.log(model.stride_seconds(steps))
    return {
        "mean": scale[:, None] * fpca.mean_coefficients_,
        "components": scale[:, None] * fpca.component_coefficients_,
        "log_seconds_mean": log_seconds[0],
        "log_seconds_weights": log_seconds[1:] - log_seconds[0],
    }


def _eigenwalkers(model: Eigenwalkers) -> dict[str, np.ndarray]:
    """Series and frequencies of `Eigenwalkers`."""
    return {
        "mean": model.mean_,
        "components": model.components_,
        "log_frequency_mean": np.asarray(model.log_frequency_mean_),
        "log_frequency_weights": model.log_frequency_weights_,
    }


def _body(offsets) -> dict[str, np.ndarray]:
    """The body's shape, in body heights."""
    return {"offsets": np.asarray(offsets), "limb_shifts": LIMB_SHIFTS, "limb_radii": limb_radii(1.0)}


def _described(model, height: float, count: int) -> dict[str, Any]:
    """What isn't numbers of the walks themselves."""
    return {
        "kind": model.kind,
        "components": count,
        "height": height,
        "ankle_height": ANKLE_HEIGHT,
        "limb_segments": LIMB_SEGMENT.tolist(),
        "limb_nodes": LIMB_NODES.tolist(),
        "clothes": CLOTHES,
        "colours": COLOURS,
        "edges": EDGES,
        "markers": MARKERS,
        "pose": POSE,
    }
