"""People kept apart over time: by place, by identity, through gaps, whatever the order of the detections."""

import numpy as np
import pytest

from motionenv.errors import CaptureWarning, FormatError
from motionenv.mocap.keypoints.detections import read
from motionenv.mocap.keypoints.people import chosen, followed, weight
from tests.mocap.keypoints.people_json import walker


def crossing(frames=60) -> tuple[np.ndarray, np.ndarray]:
    """Two who pass each other, one of them farther away: smaller and higher in the picture."""
    one = walker(frames=frames)
    other = walker(frames=frames, score=0.6)[::-1].copy()
    other[..., :2] = 0.6 * other[..., :2] + [250, 20]
    return one, other


def test_people_who_cross_stay_themselves_whatever_the_order_of_detections():
    one, other = crossing()
    rng = np.random.default_rng(0)
    found = [(i, k, None) for i, pair in enumerate(zip(one, other, strict=True)) for k in rng.permutation(pair)]
    tracks = followed("a.json", [found[i] for i in rng.permutation(len(found))])
    assert len(tracks) == 2
    for person, truth in ((0, one), (1, other)):
        track = chosen("a.json", tracks, person)
        assert list(track) == list(range(60))
        np.testing.assert_array_equal(list(track.values()), truth)
    assert weight(tracks[0]) == pytest.approx(60 * 0.9)


def test_identities_make_the_tracks_only_where_everybody_has_one():
    one, other = crossing(10)
    named = [(i, k, name) for i in range(10) for k, name in ((one[i], "a"), (other[i], 7))]
    np.testing.assert_array_equal(followed("a.json", named)[1][2], other[2])
    named[0] = (*named[0][:2], None)
    np.testing.assert_array_equal(list(followed("a.json", named)[0].values()), one)
    with pytest.raises(FormatError, match="'a' occurs twice in frame 3"):
        followed("a.json", [(3, one[0], "a"), (3, other[0], "a")])


def test_points_nobody_sees_do_not_make_people():
    one, _ = crossing(10)
    one[5, :, 2] = 0
    tracks = followed("a.json", [(i, k, None) for i, k in enumerate(one)])
    assert [len(track) for track in tracks] == [9, 1]
    assert chosen("a.json", tracks, None) is tracks[0]
    for wrong in (2, -1, "0"):
        with pytest.raises(FormatError, match="there is no person"):
            chosen("a.json", tracks, wrong)


@pytest.mark.parametrize("seed", range(4))
def test_people_who_come_and_go_never_share_a_track(seed):
    """Up to five people in five places, each there at random for spells shorter than what ends a track."""
    rng = np.random.default_rng(seed)
    places = [walker(frames=60, shift=700 * i, score=0.5 + 0.1 * i) for i in range(5)]
    there = rng.random((60, 5)) < 0.4
    found = [(i, places[p][i], None) for i in range(60) for p in rng.permutation(5) if there[i, p]]
    tracks = followed("a.json", found)
    assert sorted(map(len, tracks)) == sorted(there.sum(axis=0))
    for track in tracks:
        place = round(10 * (next(iter(track.values()))[0, 2] - 0.5))
        assert list(track) == np.flatnonzero(there[:, place]).tolist()
        np.testing.assert_array_equal(list(track.values()), places[place][there[:, place]])


def switched(one, other, frame: int, last: int | None = None) -> list[tuple]:
    """Detections with identities that are exchanged from a frame on."""
    out = []
    for i, (a, b) in enumerate(zip(one, other, strict=True)):
        wrong = frame <= i < (len(one) if last is None else last)
        out += [(i, a, "b" if wrong else "a"), (i, b, "a" if wrong else "b")]
    return out


def facing(frames=60) -> tuple[np.ndarray, np.ndarray]:
    """Two who come from opposite sides and pass each other in the middle, facing where they go."""
    rng = np.random.default_rng(0)
    one = walker(frames=frames)
    other = one.copy()
    other[..., 0] = 2 * one[frames // 2, :, 0].mean() + 15 - one[..., 0]
    for each in (one, other):
        each[..., :2] += rng.normal(0, 1.5, each[..., :2].shape)
    return one, other


@pytest.mark.parametrize("frame", [12, 27, 31, 45])
def test_identities_exchanged_when_people_cross_are_exchanged_back(frame):
    one, other = facing()
    with pytest.warns(CaptureWarning, match=f"exchanged from frame {frame} on, which was corrected"):
        tracks = followed("a.json", switched(one, other, frame))
    starts = [one if np.array_equal(track[0], one[0]) else other for track in tracks]
    assert starts[0] is not starts[1]
    for track, truth in zip(tracks, starts, strict=True):
        np.testing.assert_array_equal(list(track.values()), truth)


@pytest.mark.filterwarnings("error")
def test_people_who_cross_or_meet_and_turn_back_keep_their_identities():
    one, other = facing()
    back = [np.concatenate([each[:30], each[29::-1]]) for each in (one, other)]  # they turn on the spot
    for pair in ((one, other), back, crossing()):
        tracks = followed("a.json", switched(*pair, 99))
        assert len(tracks) == 2
        for track, truth in zip(sorted(tracks, key=lambda t: not np.array_equal(t[0], pair[0][0])), pair, strict=True):
            np.testing.assert_array_equal(list(track.values()), truth)


def test_a_switch_and_one_back_are_both_repaired():
    one, other = facing()
    with pytest.warns(CaptureWarning, match="corrected") as told:
        tracks = followed("a.json", switched(one, other, 20, 40))
    assert len(told) == 2
    first = next(track for track in tracks if np.array_equal(track[0], one[0]))
    np.testing.assert_array_equal(list(first.values()), one)


def test_who_jumps_to_another_place_is_somebody_else():
    one, other = walker(frames=40), walker(frames=40, shift=900)
    jumps = [(i, one[i] if i < 25 else other[i], 3) for i in range(40)]
    with pytest.warns(CaptureWarning, match="jumps to another place in frame 25.*--person 0,3"):
        tracks = followed("a.json", jumps)
    assert [sorted(track) for track in tracks] == [list(range(25)), list(range(25, 40))]


def test_parts_of_one_person_are_joined_if_they_are_not_seen_at_once():
    one, other = walker(frames=40), walker(frames=40, shift=900)
    tracks = followed(
        "a.json", [(i, k, n) for n, each in enumerate((one, other)) for i, k in enumerate(each) if i % 40 != n]
    )
    with pytest.raises(
        FormatError, match="persons 0 and 1 are both seen in 38 frames from 2 to 39: they are two people"
    ):
        chosen("a.json", tracks, [0, 1])
    early, late = ({i: one[i] for i in range(*ends)} for ends in ((0, 15), (20, 40)))
    whole = chosen("a.json", [late, early, {}], (0, 1))
    assert list(whole) == [*range(15), *range(20, 40)]
    with pytest.raises(FormatError, match=r"there is no person \[0, 4\]"):
        chosen("a.json", [late, early], [0, 4])


def test_colours_tell_who_is_who_where_motion_can_not():
    """Two disappear behind a wall and come out on the sides where they went in: each as before, or exchanged."""
    one = walker(frames=1)[0]
    places = {n: np.array([60 - 4.0 * n, 0, 0]) for n in range(16)}
    red, blue = np.eye(4)[0], np.eye(4)[1]
    for exchanged in (False, True):
        found, looks = [], []
        for n in [*range(12), *range(18, 30)]:
            colours = (blue, red) if exchanged and n > 15 else (red, blue)
            for side, colour in zip((-1, 1), colours, strict=True):
                found.append((n, one + side * places[min(n, 30 - n)], None))
                looks.append(colour)
        tracks = followed("a.json", found, looks)
        assert [len(track) for track in tracks] == [24, 24]
        for track in tracks:
            went, came = ((track[n] - one)[0, 0] > 0 for n in (0, 29))
            assert (went == came) != exchanged


def test_nobody_becomes_somebody_in_other_clothes_who_walks_by():
    """One disappears behind another, who is seen from then on; he comes back where he went in."""
    red, blue, one = np.eye(4)[0], np.eye(4)[1], walker(frames=1)[0]
    size = np.ptp(one[:, :2], axis=0).max()
    beside = one + 0.15 * size * np.eye(3)[0]
    found = [(n, one, None) for n in range(20)] + [(n, beside, None) for n in range(20, 35)]
    found += [(n, one, None) for n in range(35, 50)]
    looks = [red] * 20 + [blue] * 15 + [red] * 15
    tracks = followed("a.json", found, looks)
    assert [list(track) for track in tracks] == [[*range(20), *range(35, 50)], [*range(20, 35)]]
    (alone,) = followed("a.json", [(n, one, None) for n in range(50)], looks)  # into the shade and out again
    assert len(alone) == 50


def test_the_case_of_a_real_exchange(mocap):
    path = mocap.parent / "cases/vision/cross_switch.json"
    if not path.is_file():
        pytest.skip(f"no {path}")
    with pytest.warns(CaptureWarning, match="cross_switch.json: two people's identities are exchanged from frame 75"):
        tracks, frames, *_ = read(path)
    assert [len(track) for track in tracks] == [frames, frames]
    for track in tracks:
        across = np.array([np.median(k[:, 0]) for k in track.values()])
        assert abs(np.corrcoef(across, np.arange(frames))[0, 1]) > 0.99
