"""Naming schemes: each makes all nodes of the body, from points that real files have."""

import pytest

from motionenv.body import NODES
from motionenv.mocap import read
from motionenv.mocap.joint_centres import with_joint_centres
from motionenv.mocap.names import SCHEMES, missing


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_makes_every_node_of_weights_that_sum_to_one(scheme):
    table, _ = SCHEMES[scheme]
    assert set(table) == set(NODES)
    for node, weights in table.items():
        assert sum(weights.values()) == pytest.approx(1), node


@pytest.mark.parametrize("scheme", SCHEMES)
def test_left_and_right_are_made_alike(scheme):
    """Of the same weights; with sides exchanged in the names of points, one becomes the other."""
    table, _ = SCHEMES[scheme]
    for node in (n for n in NODES if n.startswith("left_")):
        left, right = table[node], table[node.replace("left", "right")]
        assert sorted(left.values()) == sorted(right.values())
        own = [point for point, weight in left.items() if point not in right]
        assert own, node
        assert len(own) == len([point for point in right if point not in left])


@pytest.mark.parametrize(
    ("scheme", "file", "options"),
    [
        ("cmu", "cmu_asfamc/02/02_01.amc", {"fps": 120}),
        ("cmu-bvh", "cmu_bvh_misc/02_01.bvh", {"unit": "cmu"}),
        ("bandai-namco", "bandai_namco/*/data/dataset-1_walk_normal_001.bvh", {"unit": "cm"}),
        ("plug-in-gait", "cmu_c3d/02_01.c3d", {}),
    ],
)
def test_real_files_have_the_points_of_their_scheme(mocap, scheme, file, options):
    markers = read(next(iter(sorted(mocap.glob(file)))), **options)
    if scheme == "plug-in-gait":
        markers = with_joint_centres(markers)
    assert missing(scheme, markers.names) == []
    head = SCHEMES[scheme][1]
    assert head is None or head in markers.names


def test_what_is_missing_is_told_in_order():
    table, _ = SCHEMES["mixamo"]
    points = {point for weights in table.values() for point in weights}
    assert missing("mixamo", points - {"Spine2", "LeftArm"}) == ["LeftArm", "Spine2"]
    assert missing("mixamo", [*points, "Tail"]) == []
