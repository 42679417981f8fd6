"""Marker maps: what a TOML file may say, and that what is written is read back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv.body import NODES
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.marker_sets.marker_map import LANDMARKS, MIDDLE, SIDED, MarkerMap, plain_name

names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8).filter(str.strip)
ways = st.one_of(
    names.map(lambda n: {n: 1.0}),
    st.lists(names, min_size=2, max_size=2, unique=True).map(lambda n: dict.fromkeys(n, 0.5)),
)


@given(
    st.dictionaries(st.sampled_from(sorted(LANDMARKS)), st.lists(ways, min_size=1, max_size=3).map(tuple), min_size=1)
)
def test_a_map_comes_back_from_its_toml(points):
    written = MarkerMap(points, name='he said "so"', title="a\\b")
    read = MarkerMap.parse(written.to_toml())
    assert (read.points, read.name, read.title) == (points, written.name, written.title)


def test_sided_entries_stand_for_both_sides():
    sided = 'hip = { "{}A" = 0.25, "{}B" = 0.75 }\nheel = ["{}H"]'
    read = MarkerMap.parse(f'name = "x"\n[sides]\nleft = "Li"\nright = "Re"\n[sided]\n{sided}\n')
    assert read.points["left_hip"] == ({"LiA": 0.25, "LiB": 0.75},)
    assert read.points["right_heel"] == ({"ReH": 1.0},)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a = [", "must be TOML"),
        ("", r"needs a section \[points\]"),
        ('[points]\nleft_nee = "K"', "did you mean 'left_knee'"),
        ('nom = "x"\n[points]\nneck = "N"', "no entry 'nom'"),
        ("[points]\nneck = { A = 0.5, B = 0.4 }", "sum to 1"),
        ("[points]\nneck = 3", "got 3"),
        ('[points]\nneck = ""', "got ''"),
        ("[points]\nneck = { A = true }", "sum to 1"),
        ('[sided]\nheel = "{}H"', r"needs \[sides\]"),
        ("points = 3", "must be a section"),
    ],
)
def test_what_is_wrong_is_named(text, problem):
    with pytest.raises(MotionError, match=problem):
        MarkerMap.parse(text)


@pytest.mark.parametrize("name", ["Matt:L.ASIS", "l_asis", "L ASIS", "L-Asis", "LASIS"])
def test_names_are_compared_without_what_laboratories_add(name):
    assert plain_name(name) == "lasis"


def test_names_of_signs_alone_stay_apart():
    assert plain_name("*") != plain_name("#")


def test_a_map_is_read_from_a_file_and_a_bad_one_is_named(tmp_path):
    path = tmp_path / "карта.toml"
    path.write_text('[points]\nleft_hip = "Бедро"\n', encoding="utf-8")
    assert MarkerMap.read(path).points["left_hip"] == ({"Бедро": 1.0},)
    path.write_text("left", encoding="utf-8")
    with pytest.raises(FormatError, match=r"карта\.toml: a marker map must be TOML"):
        MarkerMap.read(path)
    with pytest.raises(FormatError, match=r"nothing\.toml"):
        MarkerMap.read(tmp_path / "nothing.toml")


def test_each_landmark_is_on_both_sides_or_in_the_middle():
    left = {name.removeprefix("left_") for name in LANDMARKS if name.startswith("left_")}
    right = {name.removeprefix("right_") for name in LANDMARKS if name.startswith("right_")}
    assert left == right == set(SIDED)
    assert len(LANDMARKS) == 2 * len(SIDED) + len(MIDDLE)


def test_every_node_of_the_body_can_be_named():
    assert set(NODES) <= set(LANDMARKS)
