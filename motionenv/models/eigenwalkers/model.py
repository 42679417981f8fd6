"""Eigenwalkers: principal components of walkers in Fourier representation (paper B, section 3.1)."""

from typing import ClassVar

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.fourier_model import FourierModel, labelled, mean_walkers
from motionenv.models.eigenwalkers.fourier_series import WALKING
from motionenv.models.eigenwalkers.regression import shrunk_regression
from motionenv.models.eigenwalkers.speed import learn_speed

_USUAL = 30  # components that the paper keeps of 80 walkers


class Eigenwalkers(FourierModel):
    r"""A walker is w = w̄ + Σ_n k_n e_n (eq. 3.3), with scores k ~ N(0, diag λ) (eq. 3.11).

    w holds the 225 Fourier coefficients of `motionenv.models.eigenwalkers.fourier_series` [m]. Each person is one
    column of the matrix W; several walks of one person are averaged first. Complete walkers are decomposed by SVD.
    With missing markers, EM for probabilistic PCA (`motionenv.models.fpca.em_fit`) maximises the likelihood; without
    missing markers both agree.

    The frequency isn't part of w (paper B). Its logarithm is regressed on the scores, with a ridge penalty chosen by
    leaving people out, so that drawn walkers have plausible frequencies.

    Args:
        n_components: N; None keeps the paper's 30, or one less than the number of people if that is fewer.
        tol, max_iter: see `FourierModel`, also for the attributes.

    Attributes:
        scores_, people_: (R, N) [m] scores, and (R,) labels, of the people it was fitted to.
    """

    kind: ClassVar[str] = "eigenwalkers"
    _needed: ClassVar[tuple[str, ...]] = WALKING
    about: ClassVar[str] = "Fifteen points that swing in two harmonics: body shape and style in one space."

    def fit(self, motions, subjects=None) -> "Eigenwalkers":
        """Learn mean and components.

        Args:
            motions: walks, as `Motion`s, as `Markers` of the 15 markers, or as `FourierWalker`s with NaN in the
                coefficients of markers that were not seen.
            subjects: the person's label for each walk; None takes each walk for a different person.

        Raises:
            MotionError: fewer than two people, too few for `n_components`, or labels that don't match the walks.
            GapError: the pelvis or a marker of the legs is missing in all walks. Others may be: then they are NaN in
                what the model makes.
        """
        walkers, subjects = labelled(motions, subjects)
        coefficients, log_frequencies, self.people_ = mean_walkers(walkers, subjects)
        self.n_people_, self.n_walkers_ = len(coefficients), len(walkers)
        self._learn(coefficients, self._rank())
        learn_speed(self, walkers, subjects, coefficients, log_frequencies)
        standard = self.scores_ / np.sqrt(self.explained_variance_)
        fitted = shrunk_regression(standard, log_frequencies)
        self.log_frequency_mean_, self.log_frequency_weights_, self.log_frequency_deviation_ = fitted
        return self

    def _rank(self) -> int:
        """Number of components N."""
        most = self.n_people_ - 1
        if most < 1:
            raise MotionError(
                f"eigenwalkers need walks of at least two people, got {self.n_people_}: add other people's walks "
                "(subjects= labels the person; for files, the name up to the first '_')"
            )
        rank = min(_USUAL, most) if self.n_components is None else self.n_components
        if not (1 <= rank <= most and rank == int(rank)):
            raise MotionError(
                f"{self.n_people_} people can have 1 to {most} eigenwalkers, got {rank}: "
                "fit more people (subjects= labels the person), or fewer components"
            )
        return int(rank)
