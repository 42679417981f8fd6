"""Compare groups of people, or say what speed, age or anything else has to do with how people walk."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motionenv._core.representation import OneLine, counted
from motionenv._core.validation import checked_choice, random_generator
from motionenv.errors import FormatError, MotionError
from motionenv.gait.effects import PERMUTATIONS, Effect, effect_of, p_of
from motionenv.gait.strides import mean_and_sd
from motionenv.gait.trial import ANGLES, Trial

SIDES = ("both", "left", "right")
_SPEED = "speed"
People = Mapping[str, Sequence[Trial]]
Table = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(OneLine):
    """How people's angles differ between groups, or with a predictor.

    Attributes:
        effects: by angle, such as "knee_flexion": [degrees] of the second group over the first, or per unit.
        p: by angle, the effect's p value among all angles: how often a relabelling gives any of them one as small
            (Westfall & Young 1993).
        curves: by angle and label, (2, 101) mean and standard deviation over people [degrees]; of a predictor, what is
            expected one standard deviation below and above its mean, and NaN.
        what: the effect in words, such as "fast - slow" or "per 1 speed [m/s]".
        people: labels by group.
        paired: whether the groups are the same people.
        level: of the bands.
        notes: what a reader should know.
        doubts: what isn't plausible in captures.
    """

    effects: dict[str, Effect]
    p: dict[str, float]
    curves: dict[str, dict[str, np.ndarray]]
    what: str
    people: dict[str, tuple[str, ...]]
    paired: bool
    level: float
    notes: tuple[str, ...]
    doubts: tuple[str, ...]

    def _shown(self) -> str:
        found = sum(p <= 1 - self.level for p in self.p.values())
        groups = ", ".join(f"{name} ({counted(len(who), 'person', 'people')})" for name, who in self.people.items())
        return f"{self.what}: {groups}; {found} of {counted(len(self.p), 'angle')} differ"


def compare(
    groups: Mapping[str, People], *, effect: str | None = None, adjust: Sequence[str] = (), table: Table | None = None,
    paired: bool | None = None, side: str = "both", level: float = 0.95, permutations: int = PERMUTATIONS,
    seed: int | np.random.Generator = 0,
) -> Comparison:  # fmt: skip
    """Test an effect on the joint angles over the gait cycle, by permutations of people (`motionenv.gait.effects`).

    Each person counts once, by the mean over the strides, however many there are.

    Args:
        groups: one or two groups, by name: trials by people's labels, as of `read_people`.
        effect: None for the second group over the first; or "speed" [m/s], as measured, or a column of `table`.
        adjust: what is held constant: "speed" or columns of `table`.
        table: by person, the values of columns. A column with two words is 0 and 1 in alphabetical order.
        paired: whether equal labels in both groups are the same person; needed where there are any.
        side: whose strides: "both", pooled, "left" or "right".
        level: of bands.
        permutations, seed: as of `effect_of`.

    Raises:
        MotionError: too few people, an unknown or missing value of a predictor, or `paired` isn't told and matters.
    """
    checked_choice(side, "side", SIDES)
    if len(groups) not in (1, 2) or (len(groups) == 1 and (effect is None or paired)):
        raise MotionError("compare takes two groups, or one and an effect, such as speed")
    if paired and (effect is not None or adjust):
        raise MotionError("differences within people take no effect or adjust: leave one out")
    means = _partnered({name: _means(people, side) for name, people in groups.items()}, paired)
    rows = [(name, who) for name, own in means.items() for who in own]
    curves = np.array([means[name][who] for name, who in rows]).reshape(len(rows), -1, len(ANGLES))
    if paired:
        before, after = np.split(curves, 2)
        tested, design, column, what = after - before, np.ones((len(before), 1)), 0, _difference(means)
    else:
        design, column, what = _design(effect, adjust, rows, groups, table or {})
        tested = curves
    known = {name: np.isfinite(tested[:, :, i]).all(axis=1) for i, name in enumerate(ANGLES)}
    how = {"level": level, "permutations": permutations, "seed": int(random_generator(seed).integers(2**32))}
    effects = {
        name: effect_of(tested[:, :, ANGLES.index(name)], design, column, **how)  # type: ignore[arg-type]
        for name, own in known.items()
        if own.sum() > design.shape[1] + 1
    }
    if not effects:
        got = [f"{counted(len(own), 'person', 'people')} with strides in {name}" for name, own in means.items()]
        raise MotionError(f"no angle is known of enough people: got {', '.join(got)}")
    labels = {name: np.array([group == name for group, _ in rows]) for name in means}
    shown = {
        name: _expected(curves[:, :, ANGLES.index(name)], design, column, what) if effect
        else {label: np.stack(mean_and_sd(curves[own][:, :, ANGLES.index(name)])) for label, own in labels.items()}
        for name in effects
    }  # fmt: skip
    trials = [trial for people in groups.values() for own in people.values() for trial in own]
    doubts = tuple(f"{trial.name}: {doubt}" for trial in trials for doubt in trial.doubts)
    members = {name: tuple(own) for name, own in means.items()}
    notes = _notes(effects, members, groups, level)
    return Comparison(effects, _among_all(effects, known), shown, what, members, bool(paired), level, notes, doubts)


def read_table(path: str | Path) -> dict[str, dict[str, str]]:
    """What is known of people: a CSV file with a column "person" and others.

    Raises:
        FormatError: the file at `path` can't be read, has no such column, or names somebody twice.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(path, f"can't be read: {error}") from None
    if not rows or "person" not in rows[0]:
        raise FormatError(path, 'has no column "person": its first line names the columns')
    people = [(row.pop("person") or "").strip() for row in rows]
    if len(set(people)) < len(people):
        raise FormatError(path, "names somebody twice")
    return dict(zip(people, rows, strict=True))


def _means(people: People, side: str) -> dict[str, np.ndarray]:
    """Each person's mean over the strides (101, 13), of those who have any."""
    found = {}
    for who, trials in people.items():
        each = [t.both_sides() if side == "both" else t.curves(side) for t in trials]
        strides = np.concatenate(each) if each else np.empty((0, 101, len(ANGLES)))
        if len(strides):
            found[who] = mean_and_sd(strides)[0]
    return found


def _partnered(means: dict[str, dict], paired: bool | None) -> dict[str, dict]:
    """The groups; if `paired`, those who are in both, in the same order."""
    first, *others = means.values()
    same = sorted(first.keys() & others[0].keys()) if others else []
    if same and paired is None:
        raise MotionError(
            f"{counted(len(same), 'label')} in both groups, such as {same[0]!r}: say whether they are the same people, "
            "paired=True (--paired), or others, paired=False (--independent)"
        )
    return {name: {who: own[who] for who in same} for name, own in means.items()} if paired else means


def _design(effect, adjust: Sequence[str], rows, groups: Mapping[str, People], table: Table):
    """The design (people, k), the column of the effect, and the effect in words."""
    between = len(groups) == 2 and effect not in adjust
    named = list(dict.fromkeys([*([None] if between else []), *([effect] if effect else []), *adjust]))
    columns = [_column(name, rows, groups, table) for name in named]
    column = 1 + named.index(effect)
    return np.column_stack([np.ones(len(rows)), *(values for values, _ in columns)]), column, columns[column - 1][1]


def _column(name: str | None, rows, groups: Mapping[str, People], table: Table) -> tuple[np.ndarray, str]:
    """Values of a predictor (people,), None for the group, and the effect in words."""
    if name is None:
        second = list(groups)[1]
        return np.array([float(group == second) for group, _ in rows]), _difference(groups)
    if name == _SPEED:
        speeds = [np.mean([s.speed for t in groups[g][who] for s in t.steady]) for g, who in rows]
        return np.array(speeds), "per 1 m/s of speed"
    texts = [(table.get(who, {}).get(name) or "").strip() for _, who in rows]
    if "" in texts:
        who = rows[texts.index("")][1]
        raise MotionError(f"{name} of {who!r} is unknown: give a table of people with it, or {_SPEED!r}")
    try:
        return np.array([float(text) for text in texts]), f"per 1 of {name}"
    except ValueError:
        words = sorted(set(texts))
    if len(words) != 2:
        raise MotionError(f"{name} must hold numbers or two words, got {', '.join(words[:5])}")
    return np.array([float(text == words[1]) for text in texts]), f"{words[1]} - {words[0]}"


def _difference(groups: Mapping) -> str:
    first, second = groups
    return f"{second} - {first}"


def _expected(curves: np.ndarray, design: np.ndarray, column: int, what: str) -> dict[str, np.ndarray]:
    """Curves (101,) at two values of a predictor and the means of the others."""
    known = np.isfinite(curves).all(axis=1)
    beta = np.linalg.pinv(design[known]) @ curves[known]
    values = design[known, column]
    two = np.unique(values)
    ends = two if len(two) == 2 else (values.mean() - values.std(), values.mean() + values.std())
    at, found = design[known].mean(axis=0), {}
    words = what.split(" - ")[::-1] if " - " in what else [f"{what.split(' of ')[-1]} {end:.3g}" for end in ends]
    for word, end in zip(words, ends, strict=True):
        at[column] = end
        found[word] = np.stack([at @ beta, np.full(curves.shape[1], np.nan)])
    return found


def _among_all(effects: Mapping[str, Effect], known: Mapping[str, np.ndarray]) -> dict[str, float]:
    """P values among all angles; angles that are known of other people count as so many families (Bonferroni)."""
    families: dict[bytes, list[str]] = {}
    for name in effects:
        families.setdefault(known[name].tobytes(), []).append(name)
    found = {}
    for names in families.values():
        least = np.min([p_of(effects[name].maxima, effects[name].maxima) for name in names], axis=0)
        for name in names:
            found[name] = min(1.0, len(families) * float((least <= effects[name].p + 1e-12).mean()))
    return {name: found[name] for name in effects}


def _notes(effects: Mapping[str, Effect], members, groups: Mapping[str, People], level: float) -> tuple[str, ...]:
    notes = []
    least = max(effect.least for effect in effects.values())
    if least > 1 - level:
        notes.append(f"so few people can't give a p value below {least:.2g}, so some effects have no band")
    for name, people in groups.items():
        if missing := [who for who in people if who not in members[name]]:
            notes.append(f"left out of {name}, without a stride or a partner: {', '.join(missing)}")
    everyone = max(effect.people for effect in effects.values())
    few = [name.replace("_", " ") for name, effect in effects.items() if effect.people < everyone]
    if few:
        notes.append(f"not known of everybody: {', '.join(few)}")
    return tuple(notes)
