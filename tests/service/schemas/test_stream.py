"""Settings of a stream: every message that is taken makes motion."""

import numpy as np
import pytest
from pydantic import ValidationError

import motionenv
from service.responses.streaming import Stream
from service.schemas.stream import StreamSettings

FIELDS = StreamSettings.model_json_schema()["properties"]


def bounds(name: str) -> tuple[float, float]:
    (number,) = [part for part in FIELDS[name].get("anyOf", [FIELDS[name]]) if "minimum" in part]
    return number["minimum"], number["maximum"]


@pytest.mark.parametrize("name", ["seed", "fps", "speed", "height", "variation"])
@pytest.mark.parametrize("at", [0, 1])
def test_settings_at_their_bounds_make_motion(name, at):
    settings = StreamSettings(**{name: bounds(name)[at]})
    stream = Stream(motionenv.load, settings)
    poses = np.array([stream.next() for _ in range(5)])
    assert np.isfinite(poses).all()
    assert stream.fps == settings.fps
    if name == "height":
        assert stream.height == settings.height


@pytest.mark.parametrize("name", ["seed", "fps", "speed", "height", "variation", "heading"])
def test_what_is_beyond_is_refused_by_name(name):
    low, high = bounds(name)
    whole = name == "seed"
    for value in (low - 1, high + 1) if whole else (np.nextafter(low, -np.inf), np.nextafter(high, np.inf)):
        with pytest.raises(ValidationError) as refused:
            StreamSettings(**{name: value if whole else float(value)})
        assert refused.value.errors()[0]["loc"] == (name,)


def test_a_message_holds_only_what_changes():
    now = StreamSettings(seed=4, speed=1.5)
    changed = StreamSettings.model_validate(now.model_dump() | {"speed": None, "paused": True})
    assert changed == StreamSettings(seed=4, paused=True)
    with pytest.raises(ValidationError, match="not permitted"):
        StreamSettings.model_validate({"spede": 1.0})
