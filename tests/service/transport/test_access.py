"""Whose jobs and models a request may see."""

from service.transport.access import EVERYTHING, Access, access_of


def test_without_keys_everything_is_everybodys():
    assert access_of({}) == EVERYTHING
    assert access_of({"key": None}).to("anybody")


def test_a_key_sees_its_own_and_an_admin_key_all():
    hers, admins = access_of({"key": "a1", "admin": False}), access_of({"key": "b2", "admin": True})
    assert hers == Access("a1", everything=False)
    assert (hers.to("a1"), hers.to("b2"), hers.to("")) == (True, False, False)
    assert (admins.to("a1"), admins.to(""), admins.owner) == (True, True, "b2")
