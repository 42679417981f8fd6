"""Constants of how feet meet the ground in a walk, for every model."""

from typing import NamedTuple


class ContactRule(NamedTuple):
    """One value each.

    Attributes:
        stiffness: softness of the stop that keeps knees and elbows from bending backwards [rad].
        give: softness of the floor that keeps ankles up [body heights].
        firmness: how much faster than the other the ball of a foot must move back to carry the body alone [m/s].
        lower: how much lower than the other an ankle must be to say alone how high the body is [m].
        marker_firmness: the same for walks of markers, as a share of the fastest.
        smoothing: standard deviation of the smoothing of the root's velocity [s].
        shifting: standard deviation of the smoothing with which weight shifts between the feet [s].
        settling: standard deviation of the smoothing of what is corrected at the hips [s].
        reach: a foot this far from its place has left it [m].
        looseness: how little a foot must stand to be left alone, between 0 and 1.
        turns: how often pace and stride are brought to agree.
    """

    stiffness: float = 0.03
    give: float = 0.002
    firmness: float = 0.02
    lower: float = 0.01
    marker_firmness: float = 0.1
    smoothing: float = 0.01
    shifting: float = 0.02
    settling: float = 0.015
    reach: float = 0.04
    looseness: float = 0.1
    turns: int = 3


CONTACT = ContactRule()
#: Phases of a cycle in place at which contact is looked at, at least.
SAMPLES = 96
