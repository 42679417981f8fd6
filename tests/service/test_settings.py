"""Settings from flags, environment and code, and those that would be dangerous."""

import pytest
from pydantic import ValidationError

from service.settings import Settings


def test_open_to_others_only_on_purpose():
    with pytest.raises(ValidationError, match="is reachable from other machines"):
        Settings(host="0.0.0.0")
    assert Settings(host="0.0.0.0", open=True).open
    with pytest.raises(ValidationError, match="16 characters"):
        Settings(keys=("short",))


def test_settings_survive_the_environment(monkeypatch, tmp_path):
    made = Settings(keys=("0123456789abcdef",), data=tmp_path, cors=("https://a.example",), rate=7)
    for name, value in made.environment().items():
        monkeypatch.setenv(name, value)
    assert Settings() == made
