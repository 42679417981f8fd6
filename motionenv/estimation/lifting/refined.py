"""What refining a lifted walk gives: the walker, the view and the way, and how sure each of them is."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from motionenv.estimation.lifting._pictures import turn
from motionenv.models.harmonics import columns
from motionenv.types import Camera

#: Deviations to either side that hold 90 % of a Gaussian.
BAND = 1.6448536269514722


@dataclass(frozen=True, eq=False)
class Refined:
    """The posterior of a walk given the points of one camera, in Gaussian approximation about its maximum.

    Without a camera, places are those of `motionenv.models.harmonics`: x forward, in place as on a treadmill, z above
    the ground; the picture tells nothing about how far away the walker is. With a camera they are in the world; where
    the camera's pose is unknown, that is the world of `camera`, which stands over the origin and looks along y.

    Attributes:
        coefficients: (5, 15, 3) [m], the walker.
        covariance: (225, 225) [m²] of the coefficients in the order (5, 15, 3), everything else being unknown.
        alpha, elevation: the view [rad]; the elevation is that of the camera's axis.
        scale: units of the picture per metre; 1 / (metres per pixel) at the walker on average with a camera.
        frequency: strides per second [Hz].
        phase: of the first frame [rad].
        path: without a camera the offset and drift of the picture (frames, 2), across and upwards in its units; with
            one the walker's place in the world (frames, 3) [m], z being how far it drifts up.
        names: of the parameters beside the coefficients: alpha [rad], phase [rad] in mid-time, turns [rad] of phase
            from mid-time to the end, those of the view that were unknown (elevation [rad], scale [its logarithm],
            height of the camera [m]), and Legendre coefficients of the path [m].
        parameter_covariance: of the parameters in `names`, the coefficients being unknown; grown so that bands hold.
        weights: (frames, 15) of the robust loss: about 1 for points that fit, near 0 for outliers, 0 where missing.
        noise: (15,) [m] standard deviation per coordinate of what the walker leaves of the points.
        deviation: (15,) [m] the part of it that the person does and the walker's two harmonics don't.
        inflation: (15,) factors of the model by which variances grow so that bands hold for new people.
        iterations: steps taken.
        converged: whether the last step was small against the posterior's deviations.
        phases: (frames,) [rad] of the walker at the frames of the points.
        camera: that which was given, with the pose that was found; None for a picture without perspective.
    """

    coefficients: np.ndarray
    covariance: np.ndarray
    alpha: float
    elevation: float
    scale: float
    frequency: float
    phase: float
    path: np.ndarray
    names: tuple[str, ...]
    parameter_covariance: np.ndarray
    weights: np.ndarray
    noise: np.ndarray
    deviation: np.ndarray
    inflation: np.ndarray
    iterations: int
    converged: bool
    phases: np.ndarray
    camera: Camera | None
    _basis: np.ndarray = field(repr=False)
    _azimuth: float = field(repr=False)
    _joint: np.ndarray = field(repr=False)

    def standard_deviation(self, name: str) -> float:
        """The posterior's standard deviation of the parameter `name`, one of `names`."""
        i = self.names.index(name)
        return float(np.sqrt(self.parameter_covariance[i, i]))

    @property
    def heading(self) -> float:
        """Direction [rad] of the walker's x in the world of `camera`, about z from the world's x; 0 without one."""
        return self._azimuth - self.alpha if self.camera is not None else 0.0

    @cached_property
    def positions(self) -> np.ndarray:
        """Places of the markers at the frames of the points, (frames, 15, 3) [m]."""
        walker = np.einsum("th,hmc->tmc", columns(self.phases), self.coefficients)
        if self.camera is None:
            return walker
        world = walker @ turn(-self.heading).T
        return world + self.path[:, None]

    @cached_property
    def deviations(self) -> np.ndarray:
        """Standard deviations of `positions`, (frames, 15, 3) [m].

        They hold what isn't known of the walker (inflated as the model asks for new people), of phase, view and way,
        and by how much real strides deviate from the walker's two harmonics, in all directions alike.
        """
        rotation = turn(-self.heading)
        waves, slopes = columns(self.phases), columns(self.phases, 1)
        frames, own = len(waves), len(self.names)
        slope = np.einsum("th,hmc->mtc", slopes, self.coefficients) @ rotation.T
        time = (self.phases - self.phases.mean()) / (np.ptp(self.phases) / 2)
        design = np.zeros((15, frames, 3, 15 + own))
        design[..., :15] = np.einsum("th,ic->tihc", waves, rotation).reshape(frames, 3, 15)
        design[..., 16], design[..., 17] = slope, slope * time[:, None]
        if self.camera is not None:
            walker = np.einsum("th,hmc->mtc", waves, self.coefficients)
            design[..., 15] = walker @ turn(-self.heading, 1).T
            k = self._basis.shape[1]
            axes = turn(self._azimuth).T[:, :2]
            first = 15 + own - 2 * k
            design[..., 2, first - (k - 1) : first] = self._basis[:, 1:]
            design[..., first:] = np.einsum("ia,tk->tiak", axes, self._basis).reshape(frames, 3, 2 * k)
        variance = np.stack(
            [np.einsum("tia,ab,tib->ti", d, c, d, optimize=True) for d, c in zip(design, self._blocks(), strict=True)]
        )
        variance = variance * self.inflation[:, None, None] + self.deviation[:, None, None] ** 2
        return np.sqrt(variance).swapaxes(0, 1)

    def _blocks(self) -> list[np.ndarray]:
        """The joint covariance of each marker's 15 coefficients and all other parameters."""
        other = np.arange(225, len(self._joint))
        each = np.arange(225).reshape(5, 15, 3).swapaxes(0, 1).reshape(15, 15)
        return [self._joint[np.ix_(i, i)] for i in (np.concatenate([e, other]) for e in each)]
