r"""Scaled orthographic projection with analytic derivatives, for fitting a walker to image points.

It works in a level frame aligned with the camera's heading: x across (to the right), y away (horizontal), z up. At view
angle α, M(α) = [[cos α, sin α, 0], [-sin α, cos α, 0], [0, 0, 1]] rotates the walker's frame into it.
"""

from dataclasses import dataclass, field

import numpy as np

#: [rad] prior standard deviation of an unknown elevation; the mean is a level view.
ELEVATION = np.radians(20.0)


def turn(alpha: float, derivative: int = 0) -> np.ndarray:
    """Rotation M(α) about the vertical, (3, 3), or its derivative with respect to α."""
    s, c = np.sin(alpha + derivative * np.pi / 2), np.cos(alpha + derivative * np.pi / 2)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0 - derivative]])


def tilt(elevation: float, derivative: int = 0) -> np.ndarray:
    """Image axes across, upwards and away, as rows (3, 3) in the level frame, or their derivative by the elevation."""
    s, c = np.sin(elevation + derivative * np.pi / 2), np.cos(elevation + derivative * np.pi / 2)
    return np.array([[1.0 - derivative, 0.0, 0.0], [0.0, s, c], [0.0, c, -s]])


@dataclass
class Projection:
    """Projected markers and their derivatives."""

    picture: np.ndarray  # (frames, 15, 2) image positions in image units, second axis upwards
    by_position: np.ndarray  # (frames, 15, 2, 3) derivative by the markers' positions in the level frame [units per m]
    by_parameters: np.ndarray  # (frames, 15, 2, params) derivative by the view's parameters
    metres: float  # per image unit


@dataclass
class Parallel:
    """Scaled orthographic projection: scale × (across, upwards) plus an offset that drifts as a polynomial in time.

    Attributes:
        basis: (frames, d + 1) Legendre polynomials in time.
        elevation, scale: given values [rad], [image units per m].
        unknown: which of "elevation" and "scale" are estimated.
    """

    basis: np.ndarray
    elevation: float
    scale: float
    unknown: tuple[str, ...]
    names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        path = [f"{axis}_{k}" for axis in ("across", "upwards") for k in range(self.basis.shape[1])]
        self.names = (*(n for n in ("elevation", "scale") if n in self.unknown), *path)

    def view(self, params: np.ndarray) -> tuple[float, float, np.ndarray]:
        """Elevation [rad], scale [units per m], and offset and drift (d + 1, 2) [m at the start's scale]."""
        values = dict(zip(self.names, params, strict=True))
        elevation = values.get("elevation", self.elevation)
        scale = self.scale * np.exp(values.get("scale", 0.0))
        return elevation, scale, params[len(params) - 2 * self.basis.shape[1] :].reshape(2, -1).T

    def project(self, places: np.ndarray, params: np.ndarray) -> Projection:
        """Project `places` (frames, 15, 3) [m], given in the level frame."""
        elevation, scale, drift = self.view(params)
        rows = scale * tilt(elevation)[:2]
        parallel = places @ rows.T
        derivatives = [np.zeros((*places.shape[:2], 2, 0))]
        if "elevation" in self.unknown:
            derivatives.append((places @ (scale * tilt(elevation, 1)[:2]).T)[..., None])
        if "scale" in self.unknown:
            derivatives.append(parallel[..., None])
        moves = np.einsum("ij,tk->tijk", self.scale * np.eye(2), self.basis).reshape(len(places), 1, 2, -1)
        derivatives.append(np.broadcast_to(moves, (*places.shape[:2], 2, moves.shape[-1])))
        picture = parallel + self.scale * (self.basis @ drift)[:, None]
        by_position = np.broadcast_to(rows, (*places.shape[:2], 2, 3))
        return Projection(picture, by_position, np.concatenate(derivatives, axis=-1), 1 / scale)

    def fit_path(self, places: np.ndarray, picture: np.ndarray, weights: np.ndarray, params: np.ndarray) -> np.ndarray:
        """`params` with the offset and drift replaced by their least-squares fit to `picture` (frames, 15, 2)."""
        k = 2 * self.basis.shape[1]
        start = np.concatenate([params[:-k], np.zeros(k)])
        shown = self.project(places, start)
        rest = np.where(weights[..., None] > 0, picture - shown.picture, 0.0)
        start[-k:] = _weighted_least_squares(shown.by_parameters[..., -k:], rest, weights)
        return start

    def log_scale(self, params: np.ndarray) -> tuple[float, np.ndarray]:
        """Logarithm of the image units per metre, and its derivative (params,)."""
        slope = np.array([float(n == "scale") for n in self.names])
        return float(slope @ params), slope

    def prior(self, params: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Standardised prior residuals (n,) and their derivatives (n, params)."""
        if "elevation" not in self.unknown:
            return np.zeros(0), np.zeros((0, len(params)))
        return params[:1] / ELEVATION, np.eye(1, len(params)) / ELEVATION


def _weighted_least_squares(design: np.ndarray, rest: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Solve weighted least squares for design (frames, 15, 2, n), rest (frames, 15, 2), weights (frames, 15)."""
    root = np.sqrt(weights)[..., None]
    a = (design * root[..., None]).reshape(-1, design.shape[-1])
    return np.linalg.lstsq(a, (rest * root).reshape(-1), rcond=None)[0]
