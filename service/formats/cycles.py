"""One stride in place as JSON, NPY, NPZ, or a block of arrays that a browser reads without a library."""

import io

import numpy as np

from motionenv.models import Cycle
from service.formats import JSON, NPY, dumps
from service.formats.parameters import MEDIA_TYPE, packed


def encoded(cycle: Cycle, weight: float, deviations: np.ndarray, model: str, media_type: str) -> bytes:
    """A cycle of a walker of a `weight` [kg], NaN if unknown, with `deviations` (q,), as `POST /v1/cycles` gives it."""
    arrays = {
        "markers": cycle.markers, "poses": cycle.poses, "standing": cycle.standing, "contacts": cycle.contacts,
        "deviations": deviations, "offsets": cycle.body.offsets, "radii": cycle.body.radii,
    }  # fmt: skip
    numbers = {"stride": cycle.stride, "seconds": cycle.seconds, "height": cycle.body.height, "weight": weight}
    if media_type == JSON:
        return dumps({"model": model, **numbers, **arrays})
    if media_type == MEDIA_TYPE:
        return packed(arrays, {"model": model, **numbers})
    file = io.BytesIO()
    if media_type == NPY:
        np.save(file, cycle.poses, allow_pickle=False)
    else:
        np.savez(file, allow_pickle=False, **arrays, **numbers)
    return file.getvalue()
