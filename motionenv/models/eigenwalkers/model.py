"""Eigenwalkers: principal components of walkers in Fourier representation (paper B, section 3.1)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import ClassVar, Self

import numpy as np

from motionenv.errors import ModelError, MotionError
from motionenv.models.eigenwalkers.fourier_model import FourierModel
from motionenv.models.eigenwalkers.fourier_series import WALKING, FourierWalker
from motionenv.models.eigenwalkers.group_axis import GroupAxis, checked_groups, group_axis
from motionenv.models.eigenwalkers.regression import shrunk_regression
from motionenv.models.eigenwalkers.speed import learn_speed
from motionenv.models.eigenwalkers.table import mean_higher, mean_walkers, read_walks
from motionenv.models.types import Trait
from motionenv.types import Markers, Motion

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
        axis_: the axis between two groups of them, None without groups.
    """

    axis_: GroupAxis | None = None
    kind: ClassVar[str] = "eigenwalkers"
    _needed: ClassVar[tuple[str, ...]] = WALKING
    about: ClassVar[str] = "Fifteen points that swing in two harmonics: body shape and style in one space."

    def fit(
        self, motions: Iterable[FourierWalker | Markers | Motion], subjects: Sequence[str] | None = None,
        groups: Mapping[str, Sequence[str]] | None = None,
    ) -> "Eigenwalkers":  # fmt: skip
        """Learn mean and components.

        Args:
            motions: walks, as `Motion`s, as `Markers` of the 15 markers, or as `FourierWalker`s with NaN in the
                coefficients of markers that were not seen. Any iterable, such as a generator that reads files.
            subjects: the person's label for each walk; None takes each walk for a different person.
            groups: names of two groups of people, each with its people's labels. The model then has the axis between
                them as its first trait, learned by ridge regression, and tells how far people fall right who were left
                out of both, model and axis.

        Raises:
            MotionError: fewer than two people, too few for `n_components`, or labels that don't match the walks;
                not two groups, somebody in both, somebody without walks, or fewer than two people in one.
            GapError: the pelvis or a marker of the legs is missing in all walks. Others may be: then they are NaN in
                what the model makes.
        """
        walks = read_walks(motions, subjects)
        people = mean_walkers(walks, walks.people)
        self.n_people_, self.n_walkers_, self.people_ = len(people), len(walks), people.people
        told = None if groups is None else checked_groups(groups, list(people.people))
        self._learn(people.rows, self._rank())
        learn_speed(self, walks, people)
        self.higher_ = mean_higher(walks)
        self.axis_ = None
        if told is not None:
            self.axis_ = group_axis(*told, self._standard(), partial(self._without, people.rows))
        fitted = shrunk_regression(self._standard(), np.log(people.frequencies))
        self.log_frequency_mean_, self.log_frequency_weights_, self.log_frequency_deviation_ = fitted
        return self

    def own_traits(self) -> list[Trait]:
        """The axis between groups of people, if there are any."""
        return [] if self.axis_ is None else [self.axis_.trait()]

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """As `FourierModel.to_arrays`, with the axis."""
        arrays, meta = super().to_arrays()
        if self.axis_ is not None:
            told = asdict(self.axis_)
            arrays["axis_direction"], meta["axis"] = told.pop("direction"), told
        return arrays, meta

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> Self:
        """As `FourierModel.from_arrays` of `arrays` and `meta`, with the axis."""
        model = super().from_arrays(arrays, meta)
        if told := meta.get("axis"):
            direction = arrays["axis_direction"]
            if direction.shape != (len(model.components_),):
                raise ModelError(f"axis_direction has shape {direction.shape}: fit the model again")
            counts = {name: tuple(told[name]) for name in ("people", "right")}
            model.axis_ = GroupAxis(**told | counts, direction=direction)
        return model

    def _standard(self) -> np.ndarray:
        return self.scores_ / np.sqrt(self.explained_variance_)

    def _without(self, rows: np.ndarray, left: int) -> tuple[np.ndarray, np.ndarray]:
        """Scores of the others, and of a person, in standard deviations of a model of the others alone."""
        others = Eigenwalkers(self.n_components, self.tol, self.max_iter)
        others._learn(np.delete(rows, left, axis=0), min(len(self.components_), len(rows) - 2))
        own = others._scores(rows[left : left + 1])[0]
        return others._standard(), own / np.sqrt(others.explained_variance_)

    def _rank(self) -> int:
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
