"""The constants of contact: told to clients as they are, and used by all that makes walks."""

import re
from pathlib import Path

import pytest

import motionenv
from motionenv.models import contact_rule
from motionenv.models.contact_rule import CONTACT

PAGE = Path(__file__).parents[2] / "service" / "web" / "src" / "walkers"


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_clients_are_told_the_rule(model):
    _, description = motionenv.models.parameters(model)
    assert description["contact"] == CONTACT._asdict()


@pytest.mark.parametrize("name", ["treadmill_cycle.js", "eigenwalkers.js"])
def test_the_page_has_no_constants_of_its_own(name):
    """Every name of the rule that the page uses is one; and no number of the rule is written out there."""
    source = (PAGE / name).read_text(encoding="utf-8")
    used = set(re.findall(r"contact\.(\w+)", source))
    assert used
    assert used <= set(CONTACT._fields)
    written = set(re.findall(r"(?<![\w.])0\.\d+", source))
    assert not written & {f"{value:g}" for value in CONTACT} - {"0.1"}  # 0.1 is also a quantile's


def test_a_softer_floor_lifts_the_feet_of_a_cycle_in_place(monkeypatch):
    """The rule is what the cycle in place follows, not a copy of it."""
    from motionenv.models import treadmill_cycle

    model = motionenv.load("walk/fpca")
    scores = model.components().means
    before = treadmill_cycle.walk_in_place(model, scores).frames
    monkeypatch.setattr(treadmill_cycle, "CONTACT", contact_rule.ContactRule(give=0.02))
    after = treadmill_cycle.walk_in_place(model, scores).frames
    assert after[..., 2].mean() > before[..., 2].mean() + 0.002
