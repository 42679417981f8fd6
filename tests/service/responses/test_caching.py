"""Tags of answers, as HTTP caches compare them (RFC 9110)."""

import re

import pytest
from starlette.requests import Request

from service.responses import caching


def asked(if_none_match: str | None) -> Request:
    headers = [] if if_none_match is None else [(b"if-none-match", if_none_match.encode())]
    return Request({"type": "http", "method": "GET", "headers": headers})


def test_tags_are_of_everything_and_of_how_it_is_split():
    parts = [("a", "b"), ("ab",), ("ab", ""), ("", "ab"), ("b", "a"), (b"a\0b",), ("a", "b", "c")]
    tags = [caching.make_etag(*one) for one in parts]
    assert len({*tags[1:]}) == len(parts) - 1
    assert tags[0] == caching.make_etag(b"a", "b")
    assert all(re.fullmatch(r'"[0-9a-f]{32}"', tag) for tag in tags)


@pytest.mark.parametrize(
    ("given", "matches"),
    [
        ('"x"', True),
        ('W/"x"', True),
        ('"y", W/"x" , "z"', True),
        ("*", True),
        ('"y"', False),
        ("x", False),
        ('"xx"', False),
        ("", False),
        (None, False),
    ],
)
def test_a_tag_is_compared_weakly_with_every_one_of_the_list(given, matches):
    assert caching.etag_matches(asked(given), '"x"') is matches
    assert not caching.etag_matches(asked(given), None)


def test_what_is_not_reproducible_is_not_stored():
    assert caching.cache_headers(None) == {"Cache-Control": "no-store", "Vary": "Accept, Accept-Encoding"}
    kept = caching.cache_headers('"x"', control="private, no-cache")
    assert kept == {"ETag": '"x"', "Cache-Control": "private, no-cache", "Vary": "Accept, Accept-Encoding"}
    answer = caching.not_modified(asked('"x"'), kept)
    assert (answer.status_code, answer.body, answer.headers["etag"]) == (304, b"", '"x"')
