"""The landmarks of the body that a marker set or a marker map assigns to the points of a file.

A landmark is a place on the skin that can be felt (the ASIS, a malleolus), where laboratories put markers, or a joint's
centre. Joint centres carry the names of the body's nodes (`motionenv.body.NODES`). Segments may also carry rigid
clusters of up to five markers.
"""

import tomllib
from importlib.resources import files

_TABLE = tomllib.loads(files(__package__).joinpath("landmarks.toml").read_text(encoding="utf-8"))


def _clusters(*segments: str) -> dict[str, str]:
    return {f"{s}_cluster_{i}": f"marker {i} of a rigid cluster on the {s}" for s in segments for i in range(1, 6)}


#: Landmarks that exist on both sides, those on the midline, and every landmark with its description.
SIDED: dict[str, str] = _TABLE["sided"] | _clusters("thigh", "shank", "foot")
MIDDLE: dict[str, str] = _TABLE["middle"] | _clusters("pelvis")
LANDMARKS = MIDDLE | {f"{side}_{name}": f"{side} {what}" for side in ("left", "right") for name, what in SIDED.items()}
