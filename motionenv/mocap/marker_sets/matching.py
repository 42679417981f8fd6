"""Recognise the marker set of a file by the names of its points, and find the landmarks."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from re import split

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_choice
from motionenv.errors import GapError, MotionError
from motionenv.mocap.marker_sets.marker_map import MarkerMap, Weights, plain_name
from motionenv.types import Markers

_SHARED = 0.6  # share of the names that begin or end with a word for it to be a prefix or suffix of the file
_HANDED = 0.3  # volume over that of a right-angled pelvis, from which it tells left from right
_CLUSTER = 3  # markers of a cluster that determine a pose
_FEWEST = 3  # letters of a prefix without a separator


@dataclass(frozen=True, eq=False, repr=False)
class Landmarks(OneLine):
    """The landmarks that a file shows.

    Attributes:
        positions: for each landmark of `motionenv.mocap.LANDMARKS` that the file has, (frames, 3) [m], NaN in gaps.
        fps: frame rate [Hz].
        marker_map: the set or map that named them.
        points: for each landmark, the points of the file and their weights.
        notes: what a reader of results should know, beside the notes of the markers.
    """

    positions: dict[str, np.ndarray]
    fps: float
    marker_map: MarkerMap
    points: dict[str, Weights]
    notes: tuple[str, ...] = ()

    @property
    def marker_set(self) -> str:
        """Name of the set or map."""
        return self.marker_map.name


@cache
def marker_sets() -> tuple[MarkerMap, ...]:
    """The marker sets that motionenv knows, each a TOML table in `motionenv/mocap/marker_sets/sets`."""
    tables = sorted((f for f in files(__package__).joinpath("sets").iterdir()), key=lambda f: f.name)
    return tuple(MarkerMap.parse(table.read_text(encoding="utf-8")) for table in tables if table.name.endswith(".toml"))


def marker_set(name: str) -> MarkerMap:
    """The marker set called `name`.

    Raises:
        MotionError: there is none; lists the names.
    """
    named = {known.name: known for known in marker_sets()}
    return named[checked_choice(name, "the marker set", sorted(named))]


def recognise(names: Sequence[str]) -> tuple[MarkerMap, dict[str, Weights]]:
    """The marker set of which the most landmarks are among `names`, and the points of each landmark.

    Between sets of which equally many are found, the smaller one is taken: less of it is missing. A cluster of markers
    on a limb counts half: a marker on a joint at the limb's end tells more.
    """
    found = [(known, resolve(known, names)) for known in marker_sets()]
    return max(found, key=lambda one: (_worth(one[1]), _worth(one[1]) / _worth(one[0].points)))


def _worth(points: Iterable[str]) -> float:
    """Number of landmarks, of which the markers of a rigid cluster are together half a one, and none if too few."""
    limbs = Counter(limb for limb, cluster, _ in (name.partition("_cluster_") for name in points) if cluster)
    whole = sum(1 for name in points if "_cluster_" not in name)
    return whole + 0.5 * sum(count >= _CLUSTER for count in limbs.values())


def find_landmarks(markers: Markers, marker_map: MarkerMap | str | None = None) -> Landmarks:
    """The landmarks that captured `markers` (frames, points, 3) show; points that no frame shows are none.

    `marker_map` is a map, or the name of a marker set; None recognises the set by the names.

    Raises:
        MotionError: not one sequence, an unknown set, or a map of which no landmark is in the file.
        GapError: no point is ever seen.
    """
    if markers.positions.ndim != 3:
        raise MotionError(f"markers must be one sequence (frames, points, 3), got {markers.positions.shape}")
    seen = np.isfinite(markers.positions).all(-1).any(0)
    if not seen.any():
        raise GapError(
            f"{markers.name or 'this capture'} has {len(markers.names)} points, but no frame shows any of them"
        )
    names = [name if shown else "" for name, shown in zip(markers.names, seen, strict=True)]
    if marker_map is None:
        chosen, points = recognise(names)
    else:
        chosen = marker_set(marker_map) if isinstance(marker_map, str) else marker_map
        points = resolve(chosen, names)
        if not points:
            have = ", ".join(markers.names)
            raise MotionError(f"no point of the marker map {chosen.name!r} is in the file, which has {have}")
    index = {name: i for i, name in enumerate(markers.names)}
    positions = {
        landmark: np.sum([w * markers.positions[:, index[name]] for name, w in weights.items()], axis=0)
        for landmark, weights in points.items()
    }
    if _sides_exchanged(positions):
        note = "the file's names exchange left and right, as its pelvis shows, or an axis is mirrored: exchanged back"
        return Landmarks(_other_sides(positions), markers.fps, chosen, _other_sides(points), (note,))
    return Landmarks(positions, markers.fps, chosen, points)


def _sides_exchanged(positions: dict[str, np.ndarray]) -> bool:
    """Whether what is called left lies on the right of a pelvis whose front and legs are known."""
    legs = [positions[name] for name in ("left_knee_lateral", "right_knee_lateral") if name in positions]
    if len(legs) < 2 or not {"left_asis", "right_asis"} <= positions.keys():
        return False
    both_psis = {"left_psis", "right_psis"} <= positions.keys()
    back = 0.5 * (positions["left_psis"] + positions["right_psis"]) if both_psis else positions.get("sacrum")
    if back is None:
        return False
    left, right = positions["left_asis"], positions["right_asis"]
    front = 0.5 * (left + right)
    up = front - 0.5 * (legs[0] + legs[1])
    edges = (front - back, left - right, up)
    size = np.prod([np.linalg.norm(edge, axis=-1) for edge in edges], axis=0)
    handed = (np.cross(*edges[:2]) * up).sum(-1) / np.maximum(size, 1e-12)
    known = handed[np.isfinite(handed)]
    return bool(known.size) and float(np.median(known)) < -_HANDED


def _other_sides(table: dict) -> dict:
    swap = {"left": "right", "right": "left"}
    return {"_".join(swap.get(word, word) for word in name.split("_")): value for name, value in table.items()}


def resolve(marker_map: MarkerMap, names: Sequence[str]) -> dict[str, Weights]:
    """For each landmark of `marker_map` whose points are among `names`, the names in the file and their weights."""
    views = [{name: i for i, name in reversed(list(enumerate(view))) if name} for view in _views(names)]
    return max((_resolved(marker_map, names, lookup) for lookup in views), key=len)


def _resolved(marker_map: MarkerMap, names: Sequence[str], lookup: dict[str, int]) -> dict[str, Weights]:
    """`resolve` for one reading of the file's names, the index of the first point of each plain name."""
    exact = {name: i for i, name in reversed(list(enumerate(names)))}
    found: dict[str, Weights] = {}
    for landmark, ways in marker_map.points.items():
        for way in ways:
            at = [exact.get(name, _of_nobody_else(name, names, lookup)) for name in way]
            if min(at) >= 0:
                found[landmark] = {names[i]: weight for i, weight in zip(at, way.values(), strict=True)}
                break
    return found


def _of_nobody_else(name: str, names: Sequence[str], lookup: dict[str, int]) -> int:
    """Index of the point with the same plain name, unless both have a prefix and these differ; -1 without."""
    found = lookup.get(plain_name(name), -1)
    prefixes = {whole.rpartition(":")[0].casefold() for whole in (name, names[found]) if ":" in whole}
    return found if len(prefixes) < 2 else -1


def _views(names: Sequence[str]) -> list[list[str]]:
    """Readings of the file's names: as they are, the side first, and without a word that most begin or end with."""
    plain = [plain_name(name) for name in names]
    words = [[plain_name(word) for word in split(r"[\W_]+", name.rpartition(":")[2]) if word] for name in names]
    views = [plain, [_side_first(whole, parts) for whole, parts in zip(plain, words, strict=True)]]
    several = [w for w in words if len(w) > 1]
    for at, cut in ((0, str.removeprefix), (-1, str.removesuffix)):
        word, count = Counter(w[at] for w in several).most_common(1)[0] if several else ("", 0)
        if word and count >= _SHARED * len(names):
            views.append([cut(name, word) for name in plain])
    shared = _shared_start([name for name in plain if name])
    if shared >= _FEWEST:
        views.append([name[shared:] for name in plain])
    return views


def _side_first(whole: str, words: list[str]) -> str:
    """A plain name with the letter of its side in front, where the side is a word at an end: "Asis Left" is "lasis"."""
    for side in ("left", "right"):
        for at in (0, -1):
            if len(words) > 1 and words[at] in (side, side[0]):
                return side[0] + "".join(words[1:] if at == 0 else words[:-1])
        if whole.startswith(side) and whole != side:
            return side[0] + whole.removeprefix(side)
        if whole.endswith(side) and whole != side:
            return side[0] + whole.removesuffix(side)
    return whole


def _shared_start(names: Sequence[str]) -> int:
    first, last = min(names, default=""), max(names, default="")
    return next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
