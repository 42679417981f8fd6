"""Comparisons of people who walk, and their page."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from motionenv.errors import FormatError, MotionError
from motionenv.gait import analyse, compare, read_people, read_table, write_comparison
from motionenv.gait.trial import ANGLES
from motionenv.mocap import write
from motionenv.models.synthesis import synthesize

KNEE = ANGLES.index("knee_flexion")


def walk(seed: int, speed: float):
    return analyse(synthesize("walk/fpca", seconds=4, fps=50, seed=seed, speed=speed))


@pytest.fixture(scope="module")
def groups() -> dict:
    """Eight people, slow and fast."""
    return {
        name: {f"p{seed}": [walk(seed, speed)] for seed in range(8)} for name, speed in (("slow", 0.8), ("fast", 1.5))
    }


def knee_of(trials) -> np.ndarray:
    return np.concatenate([t.both_sides() for t in trials])[:, :, KNEE].mean(axis=0)


def test_the_same_people_are_compared_by_their_differences(groups):
    found = compare(groups, paired=True)
    knees = {name: np.stack([knee_of(t) for t in people.values()]) for name, people in groups.items()}
    effect = found.effects["knee_flexion"]
    np.testing.assert_allclose(effect.t, stats.ttest_rel(knees["fast"], knees["slow"]).statistic, atol=1e-9)
    assert (found.what, found.paired, len(effect.maxima)) == ("fast - slow", True, 2**8)
    assert effect.intervals  # faster walkers flex their knees more
    assert repr(found).startswith("Comparison(fast - slow: slow (8 people), fast (8 people); ")


def test_other_people_are_compared_by_welch_s_test(groups):
    found = compare(groups, paired=False, permutations=99)
    knees = {name: np.stack([knee_of(t) for t in people.values()]) for name, people in groups.items()}
    expected = stats.ttest_ind(knees["fast"], knees["slow"], equal_var=False).statistic
    np.testing.assert_allclose(found.effects["knee_flexion"].t, expected, atol=1e-9)
    np.testing.assert_allclose(found.curves["knee_flexion"]["fast"][0], knees["fast"].mean(axis=0))
    ranks = [stats.rankdata(-effect.maxima, "max") / len(effect.maxima) for effect in found.effects.values()]
    least = np.min(ranks, axis=0)
    for name, effect in found.effects.items():
        assert effect.p <= found.p[name] <= len(found.p) * effect.p
        assert found.p[name] == pytest.approx((least <= effect.p + 1e-12).mean())


def test_speed_and_columns_of_a_table_are_predictors(groups):
    everyone = {f"{name} {who}": trials for name, own in groups.items() for who, trials in own.items()}
    found = compare({"all": everyone}, effect="speed", permutations=99)
    speeds = np.array([np.mean([s.speed for s in trials[0].steady]) for trials in everyone.values()])
    knees = np.stack([knee_of(t) for t in everyone.values()])
    slope = np.polyfit(speeds, knees, 1)[0]
    np.testing.assert_allclose(found.effects["knee_flexion"].estimate, slope)
    assert found.what == "per 1 m/s of speed"
    table = {who: {"shoes": "none" if i % 2 else "boots", "age": str(20 + i)} for i, who in enumerate(everyone)}
    told = compare({"all": everyone}, effect="shoes", adjust=["age"], table=table, permutations=99)
    design = np.column_stack([np.ones(16), np.arange(16) % 2, 20 + np.arange(16)])
    beta = np.linalg.lstsq(design, knees, rcond=None)[0]
    np.testing.assert_allclose(told.effects["knee_flexion"].estimate, beta[1], atol=1e-9)
    assert told.what == "none - boots"
    assert list(told.curves["knee_flexion"]) == ["boots", "none"]
    upper, lower = (told.curves["knee_flexion"][label][0] for label in ("none", "boots"))
    np.testing.assert_allclose(upper - lower, beta[1], atol=1e-9)


def test_groups_adjusted_for_speed_differ_less(groups):
    plain = compare(groups, paired=False, permutations=99).effects["knee_flexion"]
    held = compare(groups, paired=False, adjust=["speed"], permutations=99).effects["knee_flexion"]
    assert np.abs(plain.t).max() > np.abs(held.t).max()


def test_few_people_are_told_and_get_no_band(groups):
    few = {name: {who: own[who] for who in ("p0", "p1", "p2", "p3")} for name, own in groups.items()}
    found = compare(few, paired=True)
    assert "so few people can't give a p value below 0.12" in found.notes[0]
    assert all(np.isinf(effect.threshold) for effect in found.effects.values())


def test_doubtful_captures_come_first(groups):
    odd = {name: dict(own) for name, own in groups.items()}
    odd["slow"]["p0"] = [replace(odd["slow"]["p0"][0], doubts=("the left leg is 2 m long",))]
    odd["fast"]["p9"] = []
    found = compare(odd, paired=True)
    assert found.doubts == (f"{odd['slow']['p0'][0].name}: the left leg is 2 m long",)
    assert "left out of fast, without a stride or a partner: p9" in found.notes


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({}, "8 labels in both groups, such as 'p0'.*--paired.*--independent"),
        ({"paired": True, "effect": "speed"}, "take no effect or adjust"),
        ({"paired": False, "side": "top"}, "side must be"),
        ({"paired": False, "adjust": ["age"]}, "age of 'p0' is unknown"),
    ],
)
def test_what_cannot_be_compared_is_told(groups, change, says):
    with pytest.raises(MotionError, match=says):
        compare(groups, **change)
    with pytest.raises(MotionError, match="two groups, or one and an effect"):
        compare({"slow": groups["slow"]})
    words = {f"p{i}": {"shoes": "abc"[i % 3]} for i in range(8)}
    with pytest.raises(MotionError, match="two words, got a, b, c"):
        compare({"slow": groups["slow"]}, effect="shoes", table=words)


def test_tables_are_read_and_wrong_ones_refused(tmp_path):
    (tmp_path / "a.csv").write_text("\ufeffperson,age\nJosé,31\n07,40\n", encoding="utf-8")
    assert read_table(tmp_path / "a.csv") == {"José": {"age": "31"}, "07": {"age": "40"}}
    for text, says in (("who,age\nx,3\n", 'no column "person"'), ("person\nx\nx\n", "somebody twice")):
        (tmp_path / "b.csv").write_text(text)
        with pytest.raises(FormatError, match=says):
            read_table(tmp_path / "b.csv")


def test_the_page_has_its_figures_beside_it(groups, tmp_path):
    found = compare(groups, paired=True)
    write_comparison(found, tmp_path / "out.html")
    page = (tmp_path / "out.html").read_text()
    assert page.count('<svg class="panel"') == 2 * len(found.effects)
    assert "Comparison: fast - slow" in page
    content = json.loads((tmp_path / "out.json").read_text())
    np.testing.assert_allclose(
        content["angles"]["knee_flexion"]["estimate"], found.effects["knee_flexion"].estimate, atol=1e-4
    )
    rows = list(csv.DictReader((tmp_path / "out.csv").read_text().splitlines()))
    assert len(rows) == 101 * len(found.effects)
    with pytest.raises(MotionError, match=r"must end in \.html"):
        write_comparison(found, tmp_path / "out.pdf")


def test_the_command_reads_folders(run, tmp_path):
    for name, speed in (("slow", 0.9), ("fast", 1.4)):
        (tmp_path / name).mkdir()
        for seed in range(6):
            write(
                synthesize("walk/fpca", seconds=3, fps=60, seed=seed, speed=speed), tmp_path / name / f"p{seed}_1.npz"
            )
    (tmp_path / "fast" / "p7_1.bvh").write_text("no capture")
    told = run("compare", "slow", "fast", "--out", "out.html")
    assert told.code == 2
    assert "--paired" in told.err
    told = run("compare", "slow", "fast", "--paired", "--out", "out.html")
    assert told.code == 0
    assert "fast - slow: " in told.out
    assert "p7_1.bvh was left out" in told.err
    assert (tmp_path / "out.html").is_file()
    people, left_out = read_people(tmp_path / "fast")
    assert (list(people), list(left_out)) == ([f"p{seed}" for seed in range(6)], ["p7_1.bvh"])
