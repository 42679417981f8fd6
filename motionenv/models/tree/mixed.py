"""The tree that ships, `mixed/tree`: made on first use of motion that the shipped walking models synthesise.

Capture that may be used freely is scarce, so none is shipped; the shipped models may be. People drawn from both walk at
several speeds, straight and in wide curves, from different moments of the stride. Whoever has capture of other motion
builds a tree of it with `motionenv fit tree`.
"""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import platformdirs

from motionenv import __version__
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.models.store import ASSETS, load
from motionenv.models.synthesis import synthesize
from motionenv.models.tree.database import Clip, build_database
from motionenv.models.tree.frames import FPS, WINDOW
from motionenv.models.tree.model import MotionTree
from motionenv.types import Motion

CACHE = "MOTIONENV_CACHE"
PEOPLE = 24  # of each model
FRAMES = 260  # of each clip
#: How each person walks: which way, as a sign on the curvature, once for each.
WAYS = (0.0, 0.0, 1.0, -1.0)
MODELS = ("walk/fpca", "walk/eigenwalkers")
_HEIGHT = 1.75  # [m]
_SPEEDS = (0.7, 2.0)  # [m/s]
_CURVATURES = (0.1, 0.22)  # [1/m]: a foot that stands is turned by 5° to 12° meanwhile
_SLOW, _BRISK = 1.0, 1.5  # [m/s]
_SEED = 2002


def path() -> Path:
    """The file of `mixed/tree` in the cache; made first, which takes seconds, if it isn't there.

    The cache is the user's, or the folder that the environment variable MOTIONENV_CACHE names. The file's name holds
    this version and a checksum of all code and parameters that the tree depends on. Where two processes make it at
    once, both write the same, and each its own file until that is whole.

    Raises:
        MotionError: the cache can't be written; names the variable.
    """
    folder = Path(os.environ.get(CACHE) or platformdirs.user_cache_dir("motionenv"))
    file = folder / f"mixed-tree-{__version__}-{_recipe()}.npz"
    if file.is_file():
        return file
    try:
        folder.mkdir(parents=True, exist_ok=True)
        MotionTree().fit(build_database(clips(), skeleton=from_height(_HEIGHT))).save(file, card())
    except OSError as error:
        raise MotionError(f"can't keep mixed/tree in {folder}: {error.strerror}; {_ADVICE}") from None
    except MotionError as error:
        raise MotionError(f"can't keep mixed/tree: {error}; {_ADVICE}") from None
    return file


def clips() -> Iterator[Clip]:
    """What `mixed/tree` is made of: the same clips each time, one after the other."""
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
    """A motion along x, bent into an arc: the heading grows with the way, and every step is taken in the new heading.

    Args:
        motion: (frames, 25), straight along x.
        curvature: of the arc [1/m], above 0 to the left.
    """
    poses = motion.poses.copy()
    turned = curvature * (poses[:, 0] - poses[0, 0])
    steps = np.diff(poses[:, :2] @ [1.0, 1.0j]) * np.exp(0.5j * (turned[1:] + turned[:-1]))
    place = np.cumsum(steps)
    poses[1:, 0], poses[1:, 1] = poses[0, 0] + place.real, poses[0, 1] + place.imag
    poses[:, 5] += turned
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def card() -> dict:
    """What people need to know of `mixed/tree` (Mitchell et al. 2019)."""
    count = len(MODELS) * PEOPLE * len(WAYS)
    return {
        "model": "mixed/tree",
        "people": len(MODELS) * PEOPLE,
        "clips": count,
        "frames": count * FRAMES,
        "windows": count * (FRAMES - WINDOW),
        "data": f"synthesised by {' and '.join(MODELS)}: walking at {_SPEEDS[0]} to {_SPEEDS[1]} m/s, also in curves",
        "data licence": "MIT",
        "model licence": "MIT",
        "intended use": "trying the tree without motion capture; it knows walking only, and less varied than people's",
        "command": "made when first loaded; of your own capture: motionenv fit tree",
        "motionenv": __version__,
    }


def _activity(speed: float, way: float) -> str:
    if way:
        return "turn left" if way > 0 else "turn right"
    return "slow walk" if speed < _SLOW else "walk" if speed < _BRISK else "brisk walk"


def _spread(bounds: tuple[float, float], count: int, rng: np.random.Generator) -> np.ndarray:
    """Numbers (count,) that cover `bounds` evenly, in random order."""
    return rng.permutation(np.linspace(*bounds, count))


def _recipe() -> str:
    """A checksum of the code of all models and of the parameters of the shipped ones."""
    models = Path(__file__).parents[1]
    parts = [*sorted(models.rglob("*.py")), *sorted(ASSETS.glob("*.npz"))]
    return hashlib.sha256(b"".join(part.read_bytes() for part in parts)).hexdigest()[:12]


_ADVICE = f"set the environment variable {CACHE} to a folder that can be written"
