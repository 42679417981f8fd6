"""Which changes to paper B's model help to lift people it never saw; `lifting.py` prints this table."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from lifting_walks import Fold, approach_two, from_known_views

from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.harmonics import mirrored
from motionenv.models.walkerprior import WalkerPrior
from motionenv.types import MARKERS

HEAD = MARKERS.index("head")
HEIGHT = 1.6  # [m] of the head, to which all are scaled


def by_person(fold: Fold) -> Eigenwalkers:
    """A column per person: the mean of their walks."""
    return Eigenwalkers().fit(fold.others, fold.people)


def weighted(fold: Fold) -> Eigenwalkers:
    """A column per walk, weighted so that a person counts once."""
    w = np.stack([walker.coefficients for walker in fold.others])
    weights = np.array([1 / fold.people.count(p) for p in fold.people])
    weights /= weights.sum()
    model = Eigenwalkers(30)
    model.mean_ = np.tensordot(weights, w, 1)
    _, s, vt = np.linalg.svd(np.sqrt(weights)[:, None] * (w - model.mean_).reshape(len(w), -1), full_matrices=False)
    model.components_, model.explained_variance_ = vt[:30].reshape(30, *w.shape[1:]), s[:30] ** 2
    return model


def with_mirror_images(fold: Fold, n: int = 30) -> Eigenwalkers:
    """A column per walk, and one per mirror image."""
    return Eigenwalkers(n).fit(
        [*fold.others, *(replace(w, coefficients=mirrored(w.coefficients)) for w in fold.others)]
    )


def of_one_size(fold: Fold) -> Eigenwalkers:
    """A column per walk, all scaled to one height of the head."""
    scale = [HEIGHT / w.coefficients[0, HEAD, 2] for w in fold.others]
    return Eigenwalkers(30).fit(
        [replace(w, coefficients=s * w.coefficients) for w, s in zip(fold.others, scale, strict=True)]
    )


def scaled(lift: Callable) -> Callable:
    """Lifts pictures scaled to one height of the head, and scales back what comes of it."""

    def lifted(model, w2, alpha):
        size = w2[..., 0, HEAD, 1, None, None, None] / HEIGHT
        return SimpleNamespace(depth=size[..., 0] * lift(model, w2 / size, alpha).depth)

    return lifted


def measure(folds: list[Fold], ours: list[WalkerPrior], views: np.ndarray) -> dict[str, dict[str, float]]:
    """Rms [mm] over walks and people of the missing dimension, by what is changed."""
    each = lambda fit: [fit(fold) for fold in folds]
    mirror = each(with_mirror_images)
    prior = lambda n: [WalkerPrior(n).fit(fold.others, fold.people) for fold in folds]
    paper = each(lambda fold: Eigenwalkers(30).fit(fold.others))
    ways = {
        "paper's approach II: a column per walk, N = 30, σ² = 70 mm²": (paper, approach_two()),
        "… a column per person": (each(by_person), approach_two()),
        "… walks weighted so that people count alike": (each(weighted), approach_two()),
        "… size taken out": (each(of_one_size), scaled(approach_two())),
        "… σ² = 150 mm²": (paper, approach_two(variance=150e-6)),
        "… mirror images": (mirror, approach_two()),
        "… mirror images, σ² = 150 mm²": (mirror, approach_two(variance=150e-6)),
        "… mirror images, noise by harmonic and marker, N = 20 (ours)": (ours, approach_two(variance=None)),
        "ours with N = 15": (prior(15), approach_two(variance=None)),
        "ours with N = 30": (prior(30), approach_two(variance=None)),
    }
    runs = {name: from_known_views(folds, models, lift, views) for name, (models, lift) in ways.items()}
    return {name: {"rms_mm": run.rms, "people_mm": run.rms_of_people} for name, run in runs.items()}


def table(ablation: dict[str, dict[str, float]]) -> None:
    """Print it."""
    print("\n| what helped, known view | rms over walks [mm] | over people |\n|-|-|-|")
    for name, figures in ablation.items():
        print(f"| {name} | {figures['rms_mm']:.1f} | {figures['people_mm']:.1f} |")
