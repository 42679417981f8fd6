"""Parts of a data set for training, validation and testing, without a person in two of them."""

from collections.abc import Sequence

import numpy as np

from motionenv._core.validation import is_number
from motionenv.data.samples.walkers import WALKERS
from motionenv.data.specification import Specification
from motionenv.errors import MotionError

_NAMES = ("train", "validation", "test")


def split(spec: Specification, shares: Sequence[float]) -> dict[str, Specification]:
    """Specifications of the parts of a data set, by name, each with other people.

    Args:
        spec: the whole set.
        shares: of its frames, for "train", "validation" and perhaps "test": above 0, and 1 in all; rounded up to clips.

    Raises:
        MotionError: other shares.
    """
    given = np.array([share if is_number(share) else np.nan for share in shares], dtype=np.float64)
    if not 2 <= len(given) <= len(_NAMES) or not (given > 0).all() or not np.isclose(given.sum(), 1):
        raise MotionError(f"shares must be 2 or 3 numbers above 0 that are 1 in all (0.8, 0.1, 0.1), got {shares!r}")
    parts, first = {}, spec.first_group
    for name, share in zip(_NAMES, given.tolist(), strict=False):
        parts[name] = part = spec.replace(frames=max(1, round(share * spec.frames)), first_group=first)
        first += -(-part.samples // (WALKERS * spec.people.views))
    return parts
