"""A first guess of a marker map for a file whose names no marker set knows well."""

from collections.abc import Iterable
from difflib import SequenceMatcher
from functools import cache

import numpy as np

from motionenv.mocap.marker_sets.marker_map import LANDMARKS, MarkerMap, plain_name
from motionenv.mocap.marker_sets.matching import marker_sets, recognise
from motionenv.types import Markers

_ALIKE = 0.8  # least similarity of two names
_SHORTEST = 3  # letters of a name, without the side's, that can be compared by similarity
#: Words for the sides, in the languages of the files that one meets, and their abbreviations.
_SIDES = {
    "left": ("left", "gauche", "links", "izquierda", "esquerda", "lft", "li", "lx", "l", "g"),
    "right": ("right", "droite", "rechts", "derecha", "direita", "rgt", "re", "rx", "r", "d"),
}
_AT_END = 5  # how many of them a name may also end with, beside "l" and "r"

#: From the ground up: what stands in a later row is higher on anybody who stands or walks.
_LEVELS = (
    ("heel", "toe", "metatarsal_1", "metatarsal_5", "ankle_lateral", "ankle_medial", "ankle"),
    ("knee_lateral", "knee_medial", "knee"), ("asis", "psis", "sacrum", "hip", "iliac_crest"),
    ("acromion", "shoulder", "c7", "clavicle"), ("head", "head_top", "head_front", "head_back"),
)  # fmt: skip


def guess_map(markers: Markers) -> MarkerMap:
    """A first guess of which of captured `markers` (frames, points, 3) [m], z up, are which landmarks.

    The nearest marker set's names first; then, for landmarks that it leaves open, the point whose name is most like
    one that any set has for it. A guess that puts a landmark on the wrong level of the body, such as a knee below an
    ankle, is dropped.
    """
    known, points = recognise(markers.names)
    found = dict(points)
    heights = _heights(markers)
    used = {name for weights in found.values() for name in weights}
    free = [name for name in markers.names if name not in used and plain_name(name)]
    for likeness, landmark, name in _likely(free):
        if landmark in found or name in used or likeness < _ALIKE:
            continue
        known_heights = {k: sum(w * heights[one] for one, w in v.items()) for k, v in found.items()}
        if _fits(landmark, heights[name], known_heights):
            found[landmark] = {name: 1.0}
            used.add(name)
    ordered = {landmark: (found[landmark],) for landmark in LANDMARKS if landmark in found}
    return MarkerMap(ordered, name=f"guess for {markers.name or 'a capture'}", title=f"nearest set: {known.name}")


def annotated(markers: Markers) -> str:
    """The guess of `guess_map` as a TOML file to edit, with comments on what it leaves open.

    Args:
        markers: captured points (frames, points, 3) [m], z up.
    """
    guess = guess_map(markers)
    heights = _heights(markers)
    used = {name for ways in guess.points.values() for way in ways for name in way}
    free = [f'#   "{name}"  {heights[name]:.2f} m high' for name in markers.names if name not in used]
    needs = [landmark for landmark in _needed() if landmark not in guess.points]
    lines = [
        "# Which points of the file are which landmarks. Check each line, and assign what is still open:",
        '# a point, left_knee_lateral = "KneeL"; weighted points, left_hip = { A = 0.5, B = 0.5 };',
        '# or several names of which the first that a file has is used, left_asis = ["LASI", "LASIS"].',
        "",
        guess.to_toml(),
        "# Points without a landmark, with their median height:" if free else "# Every point has a landmark.",
        *free,
        "",
        "# Landmarks without a point that a walk's analysis needs or gains from:" if needs else "# Nothing is missing.",
        *(f"#   {landmark}: {LANDMARKS[landmark]}" for landmark in needs),
        "",
    ]
    return "\n".join(lines)


def _needed() -> list[str]:
    """Landmarks of the lower body that the Conventional Gait Model uses."""
    knee_and_ankle = [f"{joint}_{face}" for joint in ("knee", "ankle") for face in ("lateral", "medial")]
    each = ("asis", "psis", "thigh", "shank", *knee_and_ankle, "heel", "toe")
    return [f"{side}_{name}" for side in ("left", "right") for name in each]


def _heights(markers: Markers) -> dict[str, float]:
    """Median height [m] of each point; NaN for points that are never seen."""
    found = {}
    for i, name in enumerate(markers.names):
        z = markers.positions[:, i, 2]
        known = z[np.isfinite(z)]
        found[name] = float(np.median(known)) if known.size else float("nan")
    return found


def _fits(landmark: str, height: float, others: dict[str, float]) -> bool:
    """Whether a landmark at `height` stands above those of lower levels and below those of higher ones."""
    level = _level(landmark)
    if level is None or not np.isfinite(height):
        return level is None
    pairs = [(_level(other), at) for other, at in others.items()]
    return not any(
        (at >= height and other < level) or (at <= height and other > level) for other, at in pairs if other is not None
    )


def _level(landmark: str) -> int | None:
    bare = landmark.removeprefix("left_").removeprefix("right_")
    return next((i for i, row in enumerate(_LEVELS) if bare in row), None)


def _likely(names: Iterable[str]) -> list[tuple[float, str, str]]:
    """Similarity, landmark and point for each pair of them on one side, most similar first."""
    split = [(name, *_without_side(plain_name(name))) for name in names]
    pairs = [
        (_likeness(bare, word), landmark, name)
        for landmark, side, word in _vocabulary()
        for name, own, bare in split
        if own == side
    ]
    return sorted(pairs, key=lambda pair: -pair[0])


def _likeness(a: str, b: str) -> float:
    """Similarity of two names without their sides, 0 to 1; short ones, and numbers in them, must be equal."""
    if "".join(filter(str.isdigit, a)) != "".join(filter(str.isdigit, b)):
        return 0.0
    if min(len(a), len(b)) < _SHORTEST:
        return float(a == b and bool(a))
    return SequenceMatcher(None, a, b).ratio()


def _without_side(name: str) -> tuple[str, str]:
    """The side that a plain name begins or ends with, "" if none, and the rest of the name."""
    for side, words in _SIDES.items():
        for word in words:
            if len(name) > len(word) and name.startswith(word):
                return side, name[len(word) :]
    for side, words in _SIDES.items():
        for word in (*words[:_AT_END], words[-2]):
            if len(name) > len(word) and name.endswith(word):
                return side, name[: -len(word)]
    return "", name


@cache
def _vocabulary() -> tuple[tuple[str, str, str], ...]:
    """Every landmark with its side and a name that some set has for it, without the side; and its own name."""
    found = set()
    taken = {plain_name(landmark.removeprefix("left_").removeprefix("right_")) for landmark in LANDMARKS}
    for landmark in LANDMARKS:
        side, _, bare = landmark.partition("_") if landmark.startswith(("left_", "right_")) else ("", "", landmark)
        found.add((landmark, side, plain_name(bare)))
        what = LANDMARKS[landmark].removeprefix(side)
        found.add((landmark, side, plain_name(what.partition(",")[0])))
    for known in marker_sets():
        for landmark, ways in known.points.items():
            side = landmark.partition("_")[0] if landmark.startswith(("left_", "right_")) else ""
            for way in ways:
                if len(way) == 1:
                    own, bare = _without_side(plain_name(next(iter(way))))
                    if own == side and bare not in taken:  # a bone "thigh" begins at the hip, a marker doesn't
                        found.add((landmark, side, bare))
    return tuple(sorted(found))
