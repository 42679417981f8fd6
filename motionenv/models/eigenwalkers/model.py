"""Eigenwalkers: principal components of walkers in Fourier representation (paper B, section 3.1)."""

from concurrent.futures import Executor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import ClassVar

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers.fourier_model import FourierModel
from motionenv.models.eigenwalkers.fourier_series import WALKING
from motionenv.models.eigenwalkers.regression import shrunk_regression
from motionenv.models.eigenwalkers.speed import learn_speed
from motionenv.models.eigenwalkers.table import mean_walkers, read_walks

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

    def fit(self, motions, subjects=None, executor: Executor | None = None) -> "Eigenwalkers":
        """Learn mean and components, block by block: memory holds as little as 200 bytes of each walk.

        Args:
            motions: walks, as `Motion`s, as `Markers` of the 15 markers, or as `FourierWalker`s with NaN in the
                coefficients of markers that were not seen. Any iterable, such as a generator that reads files.
            subjects: the person's label for each walk; None takes each walk for a different person.
            executor: any `concurrent.futures.Executor`, which then computes the walks' Fourier representations.

        Raises:
            MotionError: fewer than two people, too few for `n_components`, or labels that don't match the walks.
            GapError: the pelvis or a marker of the legs is missing in all walks. Others may be: then they are NaN in
                what the model makes.
        """
        with TemporaryDirectory() as folder:
            walks = read_walks(motions, subjects, Path(folder), executor)
            people = mean_walkers(walks, walks.people, Path(folder))
            self.n_people_, self.n_walkers_, self.people_ = len(people), len(walks), people.people
            self._learn(people.rows, self._rank())
            learn_speed(self, walks, people)
        standard = self.scores_ / np.sqrt(self.explained_variance_)
        fitted = shrunk_regression(standard, np.log(people.frequencies))
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
