"""What the search of views needs of model and sequences: weighted products of each with each."""

from dataclasses import dataclass

import numpy as np

from motionenv.estimation.lifting._gaussian import SHAPE, Gaussian, gram_blocks


@dataclass(frozen=True, eq=False)
class DataTerms:
    """Products of n sequences that show the same markers.

    Attributes:
        blocks: (6, 1 + N, 1 + N), `gram_blocks`.
        data: (n, 5, J, 1 + N): coordinates x, y of the model against across, and x, y, z against upwards; J = 1, or
            the five terms 1, sin φ, cos φ, sin 2φ, cos 2φ of a phase.
        squares: (n,) yᵀWy.
        count: how many numbers of each sequence are told by the model.
        model_centre: (1 + N, 3) weighted mean of p0 over the markers, where it was taken out, else 0.
        centres: (n, 2) the sequences' own.
    """

    blocks: np.ndarray
    data: np.ndarray
    squares: np.ndarray
    count: int
    model_centre: np.ndarray
    centres: np.ndarray


def data_terms(g: Gaussian, y: np.ndarray, seen: np.ndarray, turning: bool, any_place: bool) -> DataTerms:
    """The products of model `g` and sequences `y` (n, 5, 15, 2), which show the markers `seen` (15,).

    Args:
        g: the model.
        y: 0 where missing.
        seen: which markers there are.
        turning: whether the phase is unknown.
        any_place: whether the place in the picture is unknown. It has a flat prior, and to solve for it is to take the
            weighted mean of p0 out of data and model; axis by axis, so projecting may come before or after.
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
    """Coefficients (..., 5, 15, c) less the mean (..., c) of p0, weighted by `share` (15,), and that mean."""
    centre = np.einsum("m,...mc->...c", share, coefficients[..., 0, :, :])
    moved = coefficients.copy()
    moved[..., 0, :, :] -= centre[..., None, :]
    return moved, centre


def _turned(y: np.ndarray) -> np.ndarray:
    """The parts (n, 5, 5, 15, 2) of `later(y, φ)` that go with 1, sin φ, cos φ, sin 2φ and cos 2φ."""
    parts = np.zeros((len(y), 5, *y.shape[1:]))
    parts[:, 0, 0] = y[:, 0]
    for h in (1, 2):
        sine, cosine = 2 * h - 1, 2 * h
        parts[:, cosine, sine], parts[:, cosine, cosine] = y[:, sine], y[:, cosine]
        parts[:, sine, sine], parts[:, sine, cosine] = -y[:, cosine], y[:, sine]
    return parts
