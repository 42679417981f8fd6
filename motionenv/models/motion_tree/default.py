"""The ready-made tree `mixed/tree`, built on first use from motion synthesised by the shipped walking models.

Little capture has a free licence, so none is shipped, but the shipped models are free. People drawn from both walk at
several speeds, straight and in wide curves, starting at various phases. `motionenv fit tree` builds a tree from your
own capture.
"""

import hashlib
import os
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import platformdirs

from motionenv import __version__
from motionenv.body import from_height
from motionenv.errors import ExtrapolationWarning, MotionError
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.features import FPS, WINDOW
from motionenv.models.motion_tree.model import MotionTree
from motionenv.models.registry import ModelFile, load
from motionenv.models.storage.model_file import StoredModel
from motionenv.models.synthesis import synthesize
from motionenv.types import Motion

CACHE = "MOTIONENV_CACHE"
PEOPLE = 24  # of each model
FRAMES = 260  # of each clip
#: Sign of the curvature of each person's walks, one walk per entry.
WAYS = (0.0, 0.0, 1.0, -1.0)
MODELS = ("walk/fpca", "walk/eigenwalkers")
_HEIGHT = 1.75  # [m]
_SPEEDS = (0.7, 2.0)  # [m/s]
_CURVATURES = (0.1, 0.22)  # [1/m]; these turn a stance foot by 5° to 12°
_SLOW, _BRISK = 1.0, 1.5  # [m/s]
_SEED = 2002


class DefaultTree:
    """The ready-made model `mixed/tree`."""

    takes_long = True

    def __call__(self) -> StoredModel:
        """Load the tree; build it first if it isn't in the cache."""
        return ModelFile(path())()

    def card(self) -> dict:
        """The model card, without building the tree."""
        return card()


DEFAULT = DefaultTree()


def path() -> Path:
    """Path of `mixed/tree` in the cache; builds it first, which takes seconds, if it isn't there.

    The cache is the user's, or the folder of the environment variable MOTIONENV_CACHE. The file's name contains the
    version and a checksum of all code and parameters on which the tree depends. Two processes may build it at once:
    both write the same bytes, atomically.

    Raises:
        MotionError: the cache can't be written.
    """
    folder = Path(os.environ.get(CACHE) or platformdirs.user_cache_dir("motionenv"))
    file = folder / f"mixed-tree-{__version__}-{_recipe()}.npz"
    if file.is_file():
        return file
    try:
        folder.mkdir(parents=True, exist_ok=True)
        MotionTree().fit_database(build_database(clips(), skeleton=from_height(_HEIGHT))).save(file, card())
    except OSError as error:
        raise MotionError(f"can't keep mixed/tree in {folder}: {error.strerror}; {_ADVICE}") from None
    except MotionError as error:
        raise MotionError(f"can't keep mixed/tree: {error}; {_ADVICE}") from None
    return file


def clips() -> Iterator[Clip]:
    """Yield the clips of `mixed/tree`; deterministic."""
    rng = np.random.default_rng(_SEED)
    models = [load(name) for name in MODELS]
    people = len(MODELS) * PEOPLE
    speeds = _spread(_SPEEDS, people * len(WAYS), rng).reshape(people, -1)
    curvatures = _spread(_CURVATURES, people * len(WAYS), rng).reshape(people, -1)
    phases = rng.random((people, len(WAYS)))
    for person in range(people):
        which, number = person % len(MODELS), person // len(MODELS)
        label = f"{MODELS[which].partition('/')[2]} {number:02d}"
        for i, way in enumerate(WAYS):
            # Faster and slower than the models' own walks on purpose: the tree must have something to be steered to.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ExtrapolationWarning)
                motion = synthesize(
                    models[which],
                    FRAMES / FPS,
                    FPS,
                    seed=np.random.default_rng([_SEED, person]),  # the same person each time
                    speed=speeds[person, i],
                    height=_HEIGHT,
                    phase=phases[person, i],
                )
            arc = bent(motion, way * curvatures[person, i])
            yield Clip(arc, f"{label}, {i + 1}", _activity(speeds[person, i], way), label)


def bent(motion: Motion, curvature: float) -> Motion:
    """Bend a motion (frames, 25) along x into an arc of a curvature [1/m], positive to the left.

    The heading grows with the distance, and displacements follow the heading.
    """
    poses = motion.poses.copy()
    turned = curvature * (poses[:, 0] - poses[0, 0])
    steps = np.diff(poses[:, :2] @ [1.0, 1.0j]) * np.exp(0.5j * (turned[1:] + turned[:-1]))
    place = np.cumsum(steps)
    poses[1:, 0], poses[1:, 1] = poses[0, 0] + place.real, poses[0, 1] + place.imag
    poses[:, 5] += turned
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def card() -> dict:
    """Model card of `mixed/tree` (Mitchell et al. 2019)."""
    count = len(MODELS) * PEOPLE * len(WAYS)
    return {
        "model": "mixed/tree", "people": len(MODELS) * PEOPLE, "clips": count, "frames": count * FRAMES,
        "windows": count * (FRAMES - WINDOW),
        "data": f"synthesised by {' and '.join(MODELS)}: walking at {_SPEEDS[0]} to {_SPEEDS[1]} m/s, also in curves",
        "data licence": "MIT", "model licence": "MIT",
        "intended use": "trying the tree without motion capture; walking only, less varied than captured walking",
        "command": "built when first loaded; from your own capture: motionenv fit tree", "motionenv": __version__,
    }  # fmt: skip


def _activity(speed: float, way: float) -> str:
    if way:
        return "turn left" if way > 0 else "turn right"
    return "slow walk" if speed < _SLOW else "walk" if speed < _BRISK else "brisk walk"


def _spread(bounds: tuple[float, float], count: int, rng: np.random.Generator) -> np.ndarray:
    return rng.permutation(np.linspace(*bounds, count))


def _recipe() -> str:
    """Checksum of the code of all models and the parameters of the shipped ones."""
    models = Path(__file__).parents[1]
    parts = [*sorted(models.rglob("*.py")), *sorted((models / "assets").glob("*.npz"))]
    return hashlib.sha256(b"".join(part.read_bytes() for part in parts)).hexdigest()[:12]


_ADVICE = f"set the environment variable {CACHE} to a writable folder"
