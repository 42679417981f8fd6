"""Walks made by hand, for the tests of Fourier walkers and eigenwalkers."""

from itertools import pairwise

import numpy as np

from motionenv.body.kinematics import markers
from motionenv.body.limbs import from_height
from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import LEFT_ANKLE, RIGHT_ANKLE, FourierWalker
from motionenv.types import MARKERS, POSE, Markers


def random_walker(seed=0) -> np.ndarray:
    """Coefficients (5, 15, 3) of something that goes forward: a body with waves, its legs in opposite phase."""
    rng = np.random.default_rng(seed)
    w = np.concatenate([np.zeros((1, 15, 3)), 0.03 * rng.standard_normal((4, 15, 3))])
    w[0] = np.random.default_rng(seed + 1).normal(0, 0.02, (15, 3)) + standing()
    w[2, [LEFT_ANKLE, RIGHT_ANKLE], 0] += [0.3, -0.3]
    return w


def standing() -> np.ndarray:
    """Where the markers of a standing body are (15, 3) [m], the pelvis 0.9 m high."""
    offsets = from_height(1.75).offsets[:15].copy()
    for side in ("left", "right"):
        for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
            for near, far in pairwise(chain):
                offsets[MARKERS.index(f"{side}_{far}")] += offsets[MARKERS.index(f"{side}_{near}")]
    offsets[MARKERS.index("head")] += [0, 0, 0.525]
    return offsets + np.array([0, 0, 0.93])


def made_markers(
    model, seconds: float, fps: float, *, walker=None, seed=None, speed=None, phase=0.0, overground=True
) -> Markers:
    """The markers of a walker of `model` by eq. 3.3, then 3.1, to which `synthesize` fits its bodies."""
    walker = model.walker(seed) if walker is None else walker
    found, frequency = model._paced(walker, speed, None)
    phases = 2 * np.pi * (phase + frequency * np.arange(round(seconds * fps)) / fps)
    positions = found.positions(phases, overground=overground)
    size = 1.0 if walker.person is None else walker.person.height / found.skeleton.height
    return Markers(MARKERS, size * positions, fps)


def stride(height=1.75, swing=0.4, lean=0.05, phase=None) -> np.ndarray:
    """Poses (frames, 25) of a plausible walk, made by hand from sines."""
    phase = np.linspace(0, 6 * np.pi, 300) if phase is None else phase
    poses = np.zeros((len(phase), 25))
    poses[:, 2], poses[:, POSE.index("root_tilt")] = 0.52 * height, lean
    for side, lead in (("left", 0.0), ("right", np.pi)):
        poses[:, POSE.index(f"{side}_hip_flexion")] = 0.15 + swing * np.cos(phase - lead)
        poses[:, POSE.index(f"{side}_knee_flexion")] = 0.5 + 0.4 * np.cos(phase - lead + 1.3)
        poses[:, POSE.index(f"{side}_shoulder_flexion")] = -0.8 * swing * np.cos(phase - lead)
        poses[:, POSE.index(f"{side}_elbow_flexion")] = 0.4 - 0.2 * np.cos(phase - lead)
    return poses


def walker(seed) -> FourierWalker:
    """A walk of a person with its own height, stride and lean, seen on a treadmill."""
    rng = np.random.default_rng(seed)
    height, swing = rng.normal(1.75, 0.08), rng.normal(0.4, 0.05)
    positions = markers(stride(height, swing, rng.normal(0.05, 0.03)), from_height(height))
    positions = positions + 0.002 * rng.standard_normal(positions.shape)
    made = fourier_walker(Markers(MARKERS, positions, 100.0), frequencies=(0.8, 1.2))
    return FourierWalker(made.coefficients, 0.9 * (swing / 0.4) * np.exp(0.02 * rng.standard_normal()))


def hide(walker: FourierWalker, markers) -> FourierWalker:
    coefficients = walker.coefficients.copy()
    coefficients[:, markers] = np.nan
    return FourierWalker(coefficients, walker.frequency)
