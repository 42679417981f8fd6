"""Several people in one capture, told apart by what stands in front of the names of their points.

"Anna:LASI" is a point of Anna, or of a rigid body. Two people show the same landmark in two places at the same time; a
rigid body shows none. Without a colon, people are told apart by another separator if names are known only without what
stands in front of it, and by numbers if most names occur twice.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionenv.errors import FormatError
from motionenv.mocap.marker_sets import recognise
from motionenv.mocap.readers.text import unique
from motionenv.types import Markers

_APART = 0.02  # [m] median distance from which a landmark is in two places
_FEWEST = 3  # landmarks of a group of points whose names need no prefix beside rigid bodies
_SEPARATORS = ":_.- "
_UNNAMED = "unnamed"
_TWICE = 0.6  # share of names that occur twice from which they are those of two people, and no clusters'


@dataclass(frozen=True)
class Choice:
    """The points of one person and of what is nobody's.

    Attributes:
        kept: indices of the points.
        names: their names, without the person's prefix; those of rigid bodies keep theirs.
        person: the person's prefix; "" if there is none, or one person only.
        others: prefixes of the people who are left out.
        notes: who was taken of several people.
    """

    kept: tuple[int, ...]
    names: tuple[str, ...]
    person: str = ""
    others: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def one_person(path: str | Path, markers: Markers, person: str | None = None) -> Markers:
    """The points of one person of captured `markers` (frames, points, 3), with their names as they are.

    Args:
        path: of the file, for errors.
        markers: of anybody.
        person: what stands in front of the names of the person's points; None takes the person with most landmarks.

    Raises:
        FormatError: there is no such person; lists who there is.
    """
    choice = choose(path, markers.names, markers.positions, person)
    if not choice.others:
        return markers
    kept = list(choice.kept)
    place = {-1: -1} | {i: at for at, i in enumerate(kept)}
    return replace(
        markers, names=tuple(markers.names[i] for i in kept), positions=markers.positions[..., kept, :],
        parents=None if markers.parents is None else tuple(place.get(markers.parents[i], -1) for i in kept),
        rotations=None if markers.rotations is None else markers.rotations[..., kept, :, :],
        notes=(*markers.notes, *choice.notes),
    )  # fmt: skip


def choose(
    path: str | Path, labels: Sequence[str], positions: np.ndarray, person: str | None, subjects: Sequence[str] = ()
) -> Choice:
    """Choose one person's points by their `labels`.

    Args:
        path: of the file, for errors.
        labels: of the points.
        positions: (frames, points, 3) [m], NaN in gaps.
        person: a prefix of `labels`, in any case; None is the prefix with most landmarks in most frames. Where no label
            has a prefix, it doesn't matter.
        subjects: names of people in the file, which are prefixes also without a colon.

    Raises:
        FormatError: there is no such person; lists who there is.
    """
    labels = unique(label.strip() or "unlabelled" for label in labels)
    people = subjects or _in_front(labels)
    split = _numbered([_split(label, people) for label in labels])
    groups: dict[str, list[int]] = {}
    for i, (prefix, _) in enumerate(split):
        groups.setdefault(prefix, []).append(i)
    many = len(groups) > 1
    shown = {
        prefix: _landmarks([split[i][1] for i in g], positions[:, g]) if many else {} for prefix, g in groups.items()
    }
    seen = lambda prefix: sum(np.isfinite(place).all(-1).mean() for place in shown[prefix].values())
    best = max(shown, key=seen, default="")
    chosen = best if person is None or not (many or best) else _named(path, person, list(shown))
    others = tuple(p for p in shown if p != chosen and _two_places(shown[p], shown.get(chosen, {})))
    kept = tuple(i for i, (prefix, _) in enumerate(split) if prefix not in others)
    prefixes = {split[i][0] for i in kept} - {""}
    bare = prefixes if len(prefixes) < 2 else {chosen} if len(shown[chosen]) >= _FEWEST else set()
    names = tuple(split[i][1] if split[i][0] in bare else labels[i] for i in kept)
    return Choice(kept, names, chosen if others else "", others, _notes(chosen, others, shown))


def prefix_of(label: str, subjects: Sequence[str] = ()) -> str:
    """What stands in front of a `label` and a colon, or another separator if it is one of `subjects`; "" without."""
    return _split(label, subjects)[0]


def _split(label: str, subjects: Sequence[str]) -> tuple[str, str]:
    """The prefix of a label, "" without, and the rest."""
    prefix, colon, rest = label.rpartition(":")
    if not colon:
        for name in sorted(subjects, key=len, reverse=True):
            if name and label.startswith(name) and label[len(name) : len(name) + 1] in set(_SEPARATORS):
                return name, label[len(name) + 1 :].strip()
    return prefix.strip(), rest.strip()


def _in_front(labels: Sequence[str]) -> tuple[str, ...]:
    """What stands in front of separators, if there are several such and only what follows are names of points."""
    if len(recognise([_split(label, ())[1] for label in labels])[1]) >= _FEWEST:
        return ()
    parts = [re.split(f"[{re.escape(_SEPARATORS)}]", label, maxsplit=1) for label in labels]
    rests: dict[str, list[str]] = {}
    for first, *rest in parts:
        rests.setdefault(first, []).extend(rest)
    return tuple(first for first, names in rests.items() if names and len(recognise(names)[1]) >= _FEWEST)


def _numbered(split: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Prefixes and names, "LASI_2" as the point LASI of somebody "2" if so are the names of many points."""
    plain = {rest for prefix, rest in split if not prefix}
    found = {rest: re.fullmatch(r"(.+)_(\d)", rest) for prefix, rest in split if not prefix}
    twice = {rest: (match[2], match[1]) for rest, match in found.items() if match and match[1] in plain}
    if len({name for _, name in twice.values()}) < max(_TWICE * (len(plain) - len(twice)), _FEWEST):
        return split
    return [(prefix, rest) if prefix else twice.get(rest, ("", rest)) for prefix, rest in split]


def _landmarks(names: Sequence[str], positions: np.ndarray) -> dict[str, np.ndarray]:
    """The landmarks (frames, 3) [m] that points with these names show."""
    seen = np.isfinite(positions).all(-1).any(0)
    found = recognise([name if shown else "" for name, shown in zip(names, seen, strict=True)])[1]
    return {
        landmark: np.sum([weight * positions[:, names.index(name)] for name, weight in weights.items()], axis=0)
        for landmark, weights in found.items()
    }


def _two_places(some: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> bool:
    """Whether a landmark of both is in two places at the same time."""
    for name in some.keys() & others.keys():
        apart = np.linalg.norm(some[name] - others[name], axis=-1)
        if np.isfinite(apart).any() and np.nanmedian(apart) > _APART:
            return True
    return False


def _named(path, person: str, prefixes: Sequence[str]) -> str:
    """The prefix that a caller means with `person`."""
    for prefix in prefixes:
        if person.strip().casefold() == (prefix or _UNNAMED).casefold():
            return prefix
    known = ", ".join(prefix or _UNNAMED for prefix in dict.fromkeys(prefixes))
    raise FormatError(path, f"shows no person {person!r}; person= (--person) may be {known}")


def _notes(chosen: str, others: tuple[str, ...], shown: dict[str, dict[str, np.ndarray]]) -> tuple[str, ...]:
    if not others:
        return ()
    who = ", ".join(f"{prefix or _UNNAMED} ({len(shown[prefix])} landmarks)" for prefix in (chosen, *others))
    taken = f"{chosen or _UNNAMED} is taken, and person= (--person) takes another"
    return (f"the file shows {1 + len(others)} people, {who}: {taken}",)
