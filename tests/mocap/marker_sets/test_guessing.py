"""First guesses of marker maps: real walks whose points have been given other names."""

import pytest

from motionenv.mocap import read, retarget
from motionenv.mocap.marker_sets import MarkerMap, find_landmarks
from motionenv.mocap.marker_sets.guessing import annotated, guess_map
from motionenv.types import Markers

ENGLISH = {
    "ASI": "ASIS {}", "PSI": "PSIS {}", "KNE": "KneeLateral {}", "ANK": "{} lateral malleolus", "HEE": "Heel {}",
    "TOE": "Toe {}", "THI": "Thigh {}", "TIB": "Shank {}",
}  # fmt: skip
WORDS = {"English": ("Left", "Right"), "French": ("gauche", "droite"), "German": ("links", "rechts")}


@pytest.fixture(scope="module")
def walk(mocap):
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    kept = [i for i, name in enumerate(markers.names) if name[1:] in ENGLISH and name[0] in "LR"]
    return Markers(tuple(markers.names[i] for i in kept), markers.positions[:, kept], markers.fps)


def renamed(walk, left, right) -> Markers:
    names = [ENGLISH[name[1:]].format(left if name[0] == "L" else right) for name in walk.names]
    return Markers(names, walk.positions, walk.fps)


@pytest.mark.parametrize("language", WORDS)
def test_other_words_for_the_same_places_are_found(walk, language):
    other = renamed(walk, *WORDS[language])
    guess = guess_map(other)
    right = find_landmarks(walk, "plug-in-gait").points
    places = dict(zip(other.names, walk.names, strict=True))
    for landmark, (weights,) in guess.points.items():
        assert right[landmark] == {places[name]: w for name, w in weights.items()}
    assert len(guess.points) >= 14


def test_what_is_written_to_edit_is_a_map_that_works(walk):
    other = renamed(walk, "Left", "Right")
    text = annotated(other)
    motion = retarget(other, marker_map=MarkerMap.parse(text))
    assert motion.poses.shape == (293, 25)
    assert '"' + other.names[0] + '"' in text


def test_points_and_landmarks_left_open_are_listed(walk):
    text = annotated(Markers(("blob", *walk.names[1:]), walk.positions, walk.fps))
    assert '#   "blob"  ' in text
    assert "#   left_knee_medial: left medial epicondyle of the femur" in text


def test_a_knee_below_an_ankle_is_no_knee(walk):
    """The names of knees and heels exchanged: fuzzy names alone would believe it."""
    swap = {"KNE": "Heel {}", "HEE": "KneeLaterals {}"}
    names = [
        (swap | {"ANK": "LANK {}"}).get(n[1:], ENGLISH[n[1:]]).format("Left" if n[0] == "L" else "Right")
        for n in walk.names
    ]
    guess = guess_map(Markers(names, walk.positions, walk.fps))
    assert not any("KneeLaterals" in name for ways in guess.points.values() for way in ways for name in way)


def test_a_file_of_known_names_is_its_own_guess(walk):
    assert {k: v[0] for k, v in guess_map(walk).points.items()} == find_landmarks(walk).points
