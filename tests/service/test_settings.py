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


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "127.5.6.7", "::1"])
def test_this_machine_alone_needs_no_key(host):
    assert Settings(host=host).host == host


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.2", "lab.example", "localhost.example"])
def test_others_need_one_wherever_the_service_listens(host):
    with pytest.raises(ValidationError, match=f"host '{host}' is reachable from other machines, but there are no keys"):
        Settings(host=host)
    assert Settings(host=host, keys=("0123456789abcdef",)).host == host


NUMBERS = [name for name, field in Settings.model_fields.items() if field.annotation in (int, float)]


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_has_a_least_value_that_is_checked_by_name(name, monkeypatch):
    for value in ("-1", "many"):
        monkeypatch.setenv(f"MOTIONENV_SERVICE_{name.upper()}", value)
        with pytest.raises(ValidationError) as refused:
            Settings()
        assert [error["loc"] for error in refused.value.errors()] == [(name,)]


def test_keys_are_not_shown():
    settings = Settings(keys=("0123456789abcdef",))
    assert "0123456789abcdef" not in repr(settings) + str(settings) + settings.model_dump_json()
    assert "0123456789abcdef" in settings.environment()["MOTIONENV_SERVICE_KEYS"]


def test_settings_neither_change_nor_hold_what_is_unknown():
    with pytest.raises(ValidationError, match="frozen"):
        Settings().port = 1
    with pytest.raises(ValidationError, match="not permitted"):
        Settings(prot=1)
