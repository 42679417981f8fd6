"""The posterior of a lifted walk: walker, view and path, with their uncertainty."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.ndimage import gaussian_filter1d

from motionenv._core.representation import OneLine
from motionenv.models.eigenwalkers.fourier_series import columns

#: Half-width of the central 90 % interval of a Gaussian, in standard deviations.
BAND = 1.6448536269514722
#: Misfit above which a walk is outside the prior's population: people left out reach 1.0, and all but some acted walks
#: that are none like theirs have more than 1.3 (`motionenv bench lifting.misfit`).
MISFIT_LIMIT = 1.2
_SCATTER = 0.1  # strides over which what two harmonics leave of a motion is alike (deviation of a Gaussian)


@dataclass(frozen=True, eq=False, repr=False)
class WalkPosterior(OneLine):
    """Gaussian approximation, about its mode, of the posterior of a walk given the points of one camera.

    Positions are in the frame of `motionenv.models.eigenwalkers.fourier_series`: x forward, walking in place as on a
    treadmill, z above the ground; an orthographic image does not show the distance.

    Attributes:
        coefficients: (5, 15, 3) [m], the walker.
        alpha, elevation: the view [rad]; the elevation is that of the camera's axis.
        scale: image units per metre.
        frequency: strides per second [Hz].
        phase: phase of the first frame [rad].
        names: parameters beside the coefficients: alpha [rad]; phase [rad] at mid-time; turns [rad], the phase from
            mid-time to the end; those of the view that were unknown (elevation [rad], scale [its logarithm]).
        parameter_covariance: of the parameters in `names`, marginal over the coefficients, with calibrated inflation.
        weights: (frames, 15) of the robust fit: 1 for inliers, near 0 for outliers, 0 for missing points.
        deviation: (15,) [m] standard deviation of the person's motion beyond two harmonics.
        inflation: (15,) the model's variance factors, calibrated on held-out people.
        misfit: root mean square deviation of what the points show of the walker from the prior's mean, in its standard
            deviations: 0.4 to 1 for people like the prior's, in any unit. It includes what the fit leaves unexplained.
        phases: (frames,) [rad] the walker's phase at each frame of the points.
    """

    coefficients: np.ndarray
    alpha: float
    elevation: float
    scale: float
    frequency: float
    phase: float
    names: tuple[str, ...]
    parameter_covariance: np.ndarray
    weights: np.ndarray
    deviation: np.ndarray
    inflation: np.ndarray
    misfit: float
    phases: np.ndarray
    _joint: np.ndarray = field(repr=False)

    def standard_deviation(self, name: str) -> float:
        """Posterior standard deviation of the parameter `name`, one of `names`."""
        i = self.names.index(name)
        return float(np.sqrt(self.parameter_covariance[i, i]))

    @property
    def plausible(self) -> bool:
        """Whether this is a walk like those that the prior was fitted to; else deviations are invalid."""
        return self.misfit <= MISFIT_LIMIT

    @cached_property
    def positions(self) -> np.ndarray:
        """Marker positions at the frames of the points, (frames, 15, 3) [m]."""
        return np.einsum("th,hmc->tmc", columns(self.phases), self.coefficients)

    @cached_property
    def deviations(self) -> np.ndarray:
        """Standard deviations of `positions`, (frames, 15, 3) [m].

        They combine the posterior covariance of walker and phase (inflated by `inflation`) with `deviation`, the
        isotropic scatter of real strides about two harmonics.
        """
        waves, slopes = columns(self.phases), columns(self.phases, 1)
        frames, own = len(waves), len(self.names)
        slope = np.einsum("th,hmc->mtc", slopes, self.coefficients)
        time = (self.phases - self.phases.mean()) / (np.ptp(self.phases) / 2)
        design = np.zeros((15, frames, 3, 15 + own))
        design[..., :15] = np.einsum("th,ic->tihc", waves, np.eye(3)).reshape(frames, 3, 15)
        design[..., 16], design[..., 17] = slope, slope * time[:, None]
        variance = np.stack(
            [np.einsum("tia,ab,tib->ti", d, c, d, optimize=True) for d, c in zip(design, self._blocks(), strict=True)]
        )
        variance = variance * self.inflation[:, None, None] + self.deviation[:, None, None] ** 2
        return np.sqrt(variance).swapaxes(0, 1)

    def draws(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """`count` walks (count, frames, 15, 3) [m] by `rng`, as `positions`, spread as `deviations` tell."""
        off = rng.multivariate_normal(np.zeros(len(self._joint)), self._joint, count, method="eigh")
        time = (self.phases - self.phases.mean()) / (np.ptp(self.phases) / 2)
        late = off[:, 226, None] + off[:, 227, None] * time
        moved = np.einsum("th,nhmc->ntmc", columns(self.phases), off[:, :225].reshape(count, 5, 15, 3))
        moved += late[..., None, None] * np.einsum("th,hmc->tmc", columns(self.phases, 1), self.coefficients)
        width = _SCATTER * len(time) / max(np.ptp(self.phases) / (2 * np.pi), 1e-9)
        scatter = gaussian_filter1d(rng.standard_normal((count, 3 * len(time), 15, 3)), width, axis=1)
        scatter *= np.sqrt(2 * width * np.sqrt(np.pi))  # the filter's, of white noise far from its ends
        scatter = scatter[:, len(time) : 2 * len(time)]
        return self.positions + moved * np.sqrt(self.inflation)[:, None] + scatter * self.deviation[:, None]

    def _blocks(self) -> list[np.ndarray]:
        """Joint covariance of each marker's 15 coefficients and all other parameters."""
        other = np.arange(225, len(self._joint))
        each = np.arange(225).reshape(5, 15, 3).swapaxes(0, 1).reshape(15, 15)
        return [self._joint[np.ix_(i, i)] for i in (np.concatenate([e, other]) for e in each)]
