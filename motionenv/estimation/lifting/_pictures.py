r"""What a camera shows of a walker, and how that changes with everything that is unknown.

Both pictures work in a level frame that turns with the camera: across (to the right), away (horizontally), up. At view
angle α the walker's frame turns into it by M(α) = [[cos α, sin α, 0], [-sin α, cos α, 0], [0, 0, 1]].
"""

from dataclasses import dataclass, field

import numpy as np

from motionenv.types import Camera

#: [m/s] standard deviation of the mean sideways speed: a walker faces where it goes (paper B's x is its way).
SIDEWAYS = 0.02
#: [m] standard deviation of each term by which the walker's height over the ground drifts: floors and capture do.
UPS = 0.03
#: [rad] standard deviation of an unknown elevation about a level view.
ELEVATION = np.radians(20.0)
#: [m] unknown height of a camera over the ground.
HEIGHT, HEIGHT_DEVIATION = 1.5, 2.0


def turn(alpha: float, derivative: int = 0) -> np.ndarray:
    """M(α) (3, 3), or its derivative by α."""
    s, c = np.sin(alpha + derivative * np.pi / 2), np.cos(alpha + derivative * np.pi / 2)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0 - derivative]])


def tilt(elevation: float, derivative: int = 0) -> np.ndarray:
    """Rows across, upwards, away of a picture (3, 3) in the level frame, or their derivative by the elevation."""
    s, c = np.sin(elevation + derivative * np.pi / 2), np.cos(elevation + derivative * np.pi / 2)
    return np.array([[1.0 - derivative, 0.0, 0.0], [0.0, s, c], [0.0, c, -s]])


@dataclass
class Shown:
    """A prediction and its derivatives.

    Attributes:
        picture: (frames, 15, 2) in the units of the picture, second axis upwards.
        by_place: (frames, 15, 2, 3) derivative by the place of each marker in the level frame [units per m].
        by_own: (frames, 15, 2, own) derivative by the picture's own parameters.
        metres: (frames,) [m per unit of the picture] at the walker.
    """

    picture: np.ndarray
    by_place: np.ndarray
    by_own: np.ndarray
    metres: np.ndarray


@dataclass
class Parallel:
    """A picture without perspective: scale × (across, upwards) + an offset that drifts as a polynomial in time.

    Attributes:
        basis: (frames, d + 1) Legendre polynomials in time.
        elevation, scale: their values where they are known [rad], [units per m].
        unknown: which of "elevation" and "scale" are parameters.
        together: by how much the variance of slow residuals grows because markers deviate together, as a body does.
    """

    basis: np.ndarray
    elevation: float
    scale: float
    unknown: tuple[str, ...]
    names: tuple[str, ...] = field(init=False)
    together: float = field(init=False, default=1.0)

    def __post_init__(self):
        path = [f"{axis}_{k}" for axis in ("across", "upwards") for k in range(self.basis.shape[1])]
        self.names = (*(n for n in ("elevation", "scale") if n in self.unknown), *path)

    def view(self, own: np.ndarray) -> tuple[float, float, np.ndarray]:
        """Elevation [rad], scale [units per m] and offset and drift (d + 1, 2) [m at the start's scale]."""
        values = dict(zip(self.names, own, strict=True))
        elevation = values.get("elevation", self.elevation)
        scale = self.scale * np.exp(values.get("scale", 0.0))
        return elevation, scale, own[len(own) - 2 * self.basis.shape[1] :].reshape(2, -1).T

    def show(self, places: np.ndarray, own: np.ndarray) -> Shown:
        """The picture of `places` (frames, 15, 3) [m] in the level frame."""
        elevation, scale, drift = self.view(own)
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
        by_place = np.broadcast_to(rows, (*places.shape[:2], 2, 3))
        return Shown(picture, by_place, np.concatenate(derivatives, axis=-1), np.full(len(places), 1 / scale))

    def place(self, places: np.ndarray, picture: np.ndarray, weights: np.ndarray, own: np.ndarray) -> np.ndarray:
        """The parameters with the offset and drift that suit `picture` (frames, 15, 2) best."""
        k = 2 * self.basis.shape[1]
        start = np.concatenate([own[:-k], np.zeros(k)])
        shown = self.show(places, start)
        rest = np.where(weights[..., None] > 0, picture - shown.picture, 0.0)
        start[-k:] = _solved(shown.by_own[..., -k:], rest, weights)
        return start

    def log_scale(self, own: np.ndarray) -> tuple[float, np.ndarray]:
        """Logarithm of the units per metre, and its derivative (own,)."""
        slope = np.array([float(n == "scale") for n in self.names])
        return float(slope @ own), slope

    def prior(self, own: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n,) in standard deviations, and their derivatives (n, 1 + own) by α and the own parameters."""
        if "elevation" not in self.unknown:
            return np.zeros(0), np.zeros((0, 1 + len(own)))
        row = np.zeros((1, 1 + len(own)))
        row[0, 1] = 1 / ELEVATION
        return own[:1] / ELEVATION, row


@dataclass
class Perspective:
    """A picture by a pinhole camera that stands still, of a walker who goes over the ground.

    Attributes:
        basis: (frames, d + 1) Legendre polynomials in time, for the way on the ground.
        camera: with pixels; its pose is used where it's known.
        seconds: duration [s] from the first frame to the last.
        elevation: [rad] of the start.
        unknown: ("elevation",) for a camera of which only K is known, which stands upright at the origin of the ground.
        together: as in `Parallel`; 2 suits people left out, whose way takes part in what the body does as a whole.
    """

    basis: np.ndarray
    camera: Camera
    seconds: float
    elevation: float
    unknown: tuple[str, ...]
    names: tuple[str, ...] = field(init=False)
    together: float = field(init=False, default=2.0)

    def __post_init__(self):
        path = [f"{axis}_{k}" for axis in ("across", "away") for k in range(self.basis.shape[1])]
        self.ups = [f"up_{k}" for k in range(1, self.basis.shape[1])]
        self.names = (*(("elevation", "height") if self.unknown else ()), *self.ups, *path)
        self.inner = np.diag([1.0, -1.0, 1.0]) @ self.camera.K  # pixels with the second axis upwards
        looking = self.camera.R[2]
        self.azimuth = 0.0 if self.unknown else float(np.arctan2(-looking[0], looking[1]))

    def pose(self, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotation level frame → camera (3, 3) and translation (3,) [m]."""
        if not self.unknown:
            return self.camera.R @ turn(self.azimuth).T, self.camera.t
        rotation = np.diag([1.0, -1.0, 1.0]) @ tilt(own[0])
        return rotation, -rotation[:, 2] * own[1]

    def way(self, own: np.ndarray) -> np.ndarray:
        """Across and away (d + 1, 2) [m] of the walker's place on the ground."""
        return own[len(own) - 2 * self.basis.shape[1] :].reshape(2, -1).T

    def drift(self, own: np.ndarray) -> np.ndarray:
        """How far up (frames,) [m] the walker drifts, 0 on average."""
        k = len(own) - 2 * self.basis.shape[1]
        return self.basis[:, 1:] @ own[k - len(self.ups) : k]

    def show(self, places: np.ndarray, own: np.ndarray) -> Shown:
        """The picture of `places` (frames, 15, 3) [m] in the level frame, before the walker's way is added."""
        rotation, shift = self.pose(own)
        moved = places.copy()
        moved[..., :2] += (self.basis @ self.way(own))[:, None]
        moved[..., 2] += self.drift(own)[:, None]
        seen = moved @ rotation.T + shift
        homogeneous = seen @ self.inner.T
        depth = homogeneous[..., 2:]
        picture = homogeneous[..., :2] / depth
        by_seen = (self.inner[:2] - picture[..., None] * self.inner[2]) / depth[..., None]
        by_place = by_seen @ rotation
        own_columns = [np.zeros((*places.shape[:2], 2, 0))]
        if self.unknown:
            by_tilt = (moved - [0.0, 0.0, own[1]]) @ (np.diag([1.0, -1.0, 1.0]) @ tilt(own[0], 1)).T
            own_columns += [np.einsum("tmij,tmj->tmi", by_seen, by_tilt)[..., None], -by_place[..., 2:]]
        own_columns += [by_place[..., 2:] * self.basis[:, None, None, 1:]]
        own_columns += [by_place[..., i, None] * self.basis[:, None, None, :] for i in (0, 1)]
        metres = seen[..., 2].mean(axis=1) / self.inner[0, 0]
        return Shown(picture, by_place, np.concatenate(own_columns, axis=-1), metres)

    def place(self, places: np.ndarray, picture: np.ndarray, weights: np.ndarray, own: np.ndarray) -> np.ndarray:
        """The parameters with the way that suits `picture` best, by the direct linear transformation."""
        k = 2 * self.basis.shape[1]
        start = np.zeros(len(own))
        if self.unknown:
            start[0] = own[0]
        rotation, shift = self.pose(start)
        # picture · (row 3 · x) = rows 1, 2 · x is linear in the place x, and so in the way.
        seen_picture = np.where(weights[..., None] > 0, picture, 0.0)
        lines = self.inner[:2] - seen_picture[..., None] * self.inner[2]
        rest = -np.einsum("tmij,tmj->tmi", lines, places @ rotation.T + shift)
        lines = lines @ rotation
        design = [lines[..., i, None] * self.basis[:, None, None, :] for i in (0, 1)]
        if not self.unknown:
            start[-k:] = _solved(np.concatenate(design, axis=-1), rest, weights)
            return start
        found = _solved(np.concatenate([-lines[..., 2:], *design], axis=-1), rest, weights)
        start[1], start[-k:] = found[0], found[1:]
        return start

    def log_scale(self, own: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean logarithm of the units per metre at the walker's place on the ground, and its derivative (own,)."""
        rotation, shift = self.pose(own)
        depth = self.basis @ self.way(own) @ rotation[2, :2] + shift[2]
        slope = np.zeros(len(own))
        by_place = -np.mean(self.basis / depth[:, None], axis=0)
        slope[len(own) - 2 * self.basis.shape[1] :] = np.concatenate([r * by_place for r in rotation[2, :2]])
        return float(-np.log(depth).mean()), slope

    def prior(self, own: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n,) in standard deviations, and their derivatives (n, 1 + own) by α and the own parameters."""
        degrees = np.arange(self.basis.shape[1])
        mean_speed = (1.0 - (-1.0) ** degrees) / max(self.seconds, 1e-9)  # of each Legendre polynomial
        (across, away), s, c = mean_speed @ self.way(own), np.sin(alpha), np.cos(alpha)
        path = np.concatenate([s * mean_speed, c * mean_speed])
        values = [(s * across + c * away) / SIDEWAYS]
        rows = [np.concatenate([[c * across - s * away], np.zeros(len(own) - len(path)), path]) / SIDEWAYS]
        if self.unknown:
            values += [own[0] / ELEVATION, (own[1] - HEIGHT) / HEIGHT_DEVIATION]
            rows += [np.eye(1 + len(own))[1] / ELEVATION, np.eye(1 + len(own))[2] / HEIGHT_DEVIATION]
        first = 1 + len(own) - len(path) - len(self.ups)
        up = np.eye(1 + len(own))[first : first + len(self.ups)] / UPS
        return np.concatenate([values, up[:, 1:] @ own]), np.concatenate([rows, up])


def _solved(design: np.ndarray, rest: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted least squares: design (frames, 15, 2, n), rest (frames, 15, 2), weights (frames, 15)."""
    root = np.sqrt(weights)[..., None]
    a = (design * root[..., None]).reshape(-1, design.shape[-1])
    return np.linalg.lstsq(a, (rest * root).reshape(-1), rcond=None)[0]
