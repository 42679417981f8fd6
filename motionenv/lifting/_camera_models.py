r"""Camera models with analytic derivatives, for fitting a walker to image points.

Both models work in a level frame aligned with the camera's heading: x across (to the right), y away (horizontal), z up.
At view angle α, M(α) = [[cos α, sin α, 0], [-sin α, cos α, 0], [0, 0, 1]] rotates the walker's frame into it.
"""

from dataclasses import dataclass, field

import numpy as np

from motionenv.types import Camera

#: [m/s] standard deviation of the mean sideways speed: walkers face their direction of travel (paper B's x axis).
SIDEWAYS = 0.02
#: [m] standard deviation of each polynomial term of the vertical drift, which uneven floors and capture errors cause.
UPS = 0.03
#: [rad] prior standard deviation of an unknown elevation; the mean is a level view.
ELEVATION = np.radians(20.0)
#: [m] prior mean and standard deviation of an unknown camera height above the ground.
HEIGHT, HEIGHT_DEVIATION = 1.5, 2.0


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
    by_parameters: np.ndarray  # (frames, 15, 2, params) derivative by the camera model's parameters
    metres: np.ndarray  # (frames,) [m per image unit] at the walker


@dataclass
class Parallel:
    """Scaled orthographic projection: scale × (across, upwards) plus an offset that drifts as a polynomial in time.

    Attributes:
        basis: (frames, d + 1) Legendre polynomials in time.
        elevation, scale: given values [rad], [image units per m].
        unknown: which of "elevation" and "scale" are estimated.
        correlation: factor on the variance of low-frequency residuals: deviations of markers are correlated.
    """

    basis: np.ndarray
    elevation: float
    scale: float
    unknown: tuple[str, ...]
    names: tuple[str, ...] = field(init=False)
    correlation: float = field(init=False, default=1.0)

    def __post_init__(self):
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
        return Projection(picture, by_position, np.concatenate(derivatives, axis=-1), np.full(len(places), 1 / scale))

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

    def prior(self, params: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
        """Standardised prior residuals (n,) and their derivatives (n, 1 + params) by α and the params."""
        if "elevation" not in self.unknown:
            return np.zeros(0), np.zeros((0, 1 + len(params)))
        row = np.zeros((1, 1 + len(params)))
        row[0, 1] = 1 / ELEVATION
        return params[:1] / ELEVATION, row


@dataclass
class Perspective:
    """Projection by a static pinhole camera, of a walker who moves over the ground.

    Attributes:
        basis: (frames, d + 1) Legendre polynomials in time, for the path on the ground.
        camera: intrinsics in pixels; its pose is used unless `unknown` says otherwise.
        seconds: duration [s] from the first frame to the last.
        elevation: [rad] initial value.
        unknown: ("elevation",) if only K is known; the camera then stands upright above the origin of the ground.
        correlation: as in `Parallel`; 2 was calibrated on held-out people, because the path takes up part of the body's
            common motion.
    """

    basis: np.ndarray
    camera: Camera
    seconds: float
    elevation: float
    unknown: tuple[str, ...]
    names: tuple[str, ...] = field(init=False)
    correlation: float = field(init=False, default=2.0)

    def __post_init__(self):
        path = [f"{axis}_{k}" for axis in ("across", "away") for k in range(self.basis.shape[1])]
        self.ups = [f"up_{k}" for k in range(1, self.basis.shape[1])]
        self.names = (*(("elevation", "height") if self.unknown else ()), *self.ups, *path)
        self.inner = np.diag([1.0, -1.0, 1.0]) @ self.camera.K  # pixels, second axis upwards
        looking = self.camera.R[2]
        self.azimuth = 0.0 if self.unknown else float(np.arctan2(-looking[0], looking[1]))

    def pose(self, params: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotation from the level frame to the camera (3, 3) and translation (3,) [m]."""
        if not self.unknown:
            return self.camera.R @ turn(self.azimuth).T, self.camera.t
        rotation = np.diag([1.0, -1.0, 1.0]) @ tilt(params[0])
        return rotation, -rotation[:, 2] * params[1]

    def ground_path(self, params: np.ndarray) -> np.ndarray:
        """Coefficients across and away (d + 1, 2) [m] of the walker's path on the ground."""
        return params[len(params) - 2 * self.basis.shape[1] :].reshape(2, -1).T

    def drift(self, params: np.ndarray) -> np.ndarray:
        """Vertical drift of the walker (frames,) [m], with mean 0."""
        k = len(params) - 2 * self.basis.shape[1]
        return self.basis[:, 1:] @ params[k - len(self.ups) : k]

    def project(self, places: np.ndarray, params: np.ndarray) -> Projection:
        """Project `places` (frames, 15, 3) [m], given in the level frame without the walker's path."""
        rotation, shift = self.pose(params)
        moved = places.copy()
        moved[..., :2] += (self.basis @ self.ground_path(params))[:, None]
        moved[..., 2] += self.drift(params)[:, None]
        seen = moved @ rotation.T + shift
        homogeneous = seen @ self.inner.T
        depth = homogeneous[..., 2:]
        picture = homogeneous[..., :2] / depth
        by_seen = (self.inner[:2] - picture[..., None] * self.inner[2]) / depth[..., None]
        by_position = by_seen @ rotation
        by_parameters = [np.zeros((*places.shape[:2], 2, 0))]
        if self.unknown:
            by_tilt = (moved - [0.0, 0.0, params[1]]) @ (np.diag([1.0, -1.0, 1.0]) @ tilt(params[0], 1)).T
            by_parameters += [np.einsum("tmij,tmj->tmi", by_seen, by_tilt)[..., None], -by_position[..., 2:]]
        by_parameters += [by_position[..., 2:] * self.basis[:, None, None, 1:]]
        by_parameters += [by_position[..., i, None] * self.basis[:, None, None, :] for i in (0, 1)]
        metres = seen[..., 2].mean(axis=1) / self.inner[0, 0]
        return Projection(picture, by_position, np.concatenate(by_parameters, axis=-1), metres)

    def fit_path(self, places: np.ndarray, picture: np.ndarray, weights: np.ndarray, params: np.ndarray) -> np.ndarray:
        """`params` with the path replaced by its fit to `picture`, by the direct linear transformation."""
        k = 2 * self.basis.shape[1]
        start = np.zeros(len(params))
        if self.unknown:
            start[0] = params[0]
        rotation, shift = self.pose(start)
        # picture · (row 3 · x) = rows 1, 2 · x is linear in the position x, and so in the path.
        seen_picture = np.where(weights[..., None] > 0, picture, 0.0)
        lines = self.inner[:2] - seen_picture[..., None] * self.inner[2]
        rest = -np.einsum("tmij,tmj->tmi", lines, places @ rotation.T + shift)
        lines = lines @ rotation
        design = [lines[..., i, None] * self.basis[:, None, None, :] for i in (0, 1)]
        if not self.unknown:
            start[-k:] = _weighted_least_squares(np.concatenate(design, axis=-1), rest, weights)
            return start
        found = _weighted_least_squares(np.concatenate([-lines[..., 2:], *design], axis=-1), rest, weights)
        start[1], start[-k:] = found[0], found[1:]
        return start

    def log_scale(self, params: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean logarithm of the image units per metre along the walker's path, and its derivative (params,)."""
        rotation, shift = self.pose(params)
        depth = self.basis @ self.ground_path(params) @ rotation[2, :2] + shift[2]
        slope = np.zeros(len(params))
        by_position = -np.mean(self.basis / depth[:, None], axis=0)
        slope[len(params) - 2 * self.basis.shape[1] :] = np.concatenate([r * by_position for r in rotation[2, :2]])
        logs = np.log(depth, out=np.full(len(depth), np.nan), where=depth > 0)  # NaN behind the camera: no solution
        return float(-logs.mean()), slope

    def prior(self, params: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
        """Standardised prior residuals (n,) and their derivatives (n, 1 + params) by α and the params."""
        degrees = np.arange(self.basis.shape[1])
        mean_speed = (1.0 - (-1.0) ** degrees) / max(self.seconds, 1e-9)  # mean slope of each Legendre polynomial
        (across, away), s, c = mean_speed @ self.ground_path(params), np.sin(alpha), np.cos(alpha)
        path = np.concatenate([s * mean_speed, c * mean_speed])
        values = [(s * across + c * away) / SIDEWAYS]
        rows = [np.concatenate([[c * across - s * away], np.zeros(len(params) - len(path)), path]) / SIDEWAYS]
        if self.unknown:
            values += [params[0] / ELEVATION, (params[1] - HEIGHT) / HEIGHT_DEVIATION]
            rows += [np.eye(1 + len(params))[1] / ELEVATION, np.eye(1 + len(params))[2] / HEIGHT_DEVIATION]
        first = 1 + len(params) - len(path) - len(self.ups)
        up = np.eye(1 + len(params))[first : first + len(self.ups)] / UPS
        return np.concatenate([values, up[:, 1:] @ params]), np.concatenate([rows, up])


def _weighted_least_squares(design: np.ndarray, rest: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Solve weighted least squares for design (frames, 15, 2, n), rest (frames, 15, 2), weights (frames, 15)."""
    root = np.sqrt(weights)[..., None]
    a = (design * root[..., None]).reshape(-1, design.shape[-1])
    return np.linalg.lstsq(a, (rest * root).reshape(-1), rcond=None)[0]
