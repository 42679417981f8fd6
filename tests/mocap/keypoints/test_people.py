"""People kept apart over time: by place, by identity, through gaps, whatever the order of the detections."""

import numpy as np
import pytest

from motionenv.errors import FormatError
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
    named[4:8] = [(i, k, {"a": 7, 7: "a"}[name]) for i, k, name in named[4:8]]
    np.testing.assert_array_equal(followed("a.json", named)[0][2], other[2])
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
