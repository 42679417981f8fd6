"""Weighted inner products of model and sequences that the view search needs."""

from dataclasses import dataclass

import numpy as np

from motionenv.lifting.views._gaussian import SHAPE, Gaussian, gram_blocks


@dataclass(frozen=True, eq=False)
class DataTerms:
    """Inner products for n sequences that show the same markers.

    Attributes:
        blocks: (6, 1 + N, 1 + N), see `gram_blocks`.
        data: (n, 5, J, 1 + N): model coordinates x, y against across, and x, y, z against upwards. J = 1, or 5 for the
            terms 1, sin φ, cos φ, sin 2φ, cos 2φ of an unknown phase.
        squares: (n,) yᵀWy.
        count: number of measured values per sequence, less the degrees of freedom of an unknown offset.
        model_centre: (1 + N, 3) weighted mean of p0 over the markers, removed if the offset is unknown; else 0.
        centres: (n, 2) the same of the sequences.
    """

    blocks: np.ndarray
    data: np.ndarray
    squares: np.ndarray
    count: int
    model_centre: np.ndarray
    centres: np.ndarray


def data_terms(g: Gaussian, y: np.ndarray, seen: np.ndarray, turning: bool, any_place: bool) -> DataTerms:
    """Inner products of model `g` and sequences `y` (n, 5, 15, 2), 0 where missing.

    `seen` (15,) tells which markers are present, `turning` whether the phase is unknown, and `any_place` whether the
    image offset is. With its flat prior, eliminating it means subtracting the weighted mean of p0 from data and model,
    which commutes with projection.
    """
    weights = g.weights(seen)
    share = weights[0] / weights[0].sum() * any_place
    model = np.moveaxis(g.basis.reshape(3, -1, *SHAPE), 0, -1)  # (1 + N, 5, 15, 3)
    model, model_centre = _without(model, share)
    y, centres = _without(y, share)
    basis = np.ascontiguousarray(np.moveaxis(model, -1, 0)).reshape(3, len(model), -1)
    flat = weights.reshape(-1)
    weighted = basis * flat
    turned = _turned(y) if turning else y[:, None]  # (n, J, 5, 15, 2)
    across, upwards = (turned[..., i].reshape(*turned.shape[:2], -1) for i in (0, 1))
    products = [a @ f.T for a, f in zip((across,) * 2 + (upwards,) * 3, weighted[[0, 1, 0, 1, 2]], strict=True)]
    squares = np.einsum("hm,nhmc,nhmc->n", weights, y, y, optimize=True)
    count = 2 * SHAPE[0] * int(seen.sum()) - 2 * any_place
    return DataTerms(gram_blocks(basis, flat), np.stack(products, axis=1), squares, count, model_centre, centres)


def _without(coefficients: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (..., 5, 15, c) minus the mean (..., c) of p0 weighted by `share` (15,), and that mean."""
    centre = np.einsum("m,...mc->...c", share, coefficients[..., 0, :, :])
    moved = coefficients.copy()
    moved[..., 0, :, :] -= centre[..., None, :]
    return moved, centre


def _turned(y: np.ndarray) -> np.ndarray:
    """Parts (n, 5, 5, 15, 2) of `later(y, φ)` that multiply 1, sin φ, cos φ, sin 2φ and cos 2φ."""
    parts = np.zeros((len(y), 5, *y.shape[1:]))
    parts[:, 0, 0] = y[:, 0]
    for h in (1, 2):
        sine, cosine = 2 * h - 1, 2 * h
        parts[:, cosine, sine], parts[:, cosine, cosine] = y[:, sine], y[:, cosine]
        parts[:, sine, sine], parts[:, sine, cosine] = -y[:, cosine], y[:, sine]
    return parts
