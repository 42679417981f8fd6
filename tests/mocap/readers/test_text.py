"""Lines, numbers and names of text files; what is wrong is told with its place."""

import pytest

from motionenv.errors import FormatError
from motionenv.mocap.readers.text import count, number, read_bytes, read_lines, unique


@pytest.mark.parametrize("ends", [b"\n", b"\r\n", b"\r"])
def test_lines_are_the_same_from_every_system(tmp_path, ends):
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf" + ends.join(["größe 1".encode(), b"", b"two"]) + ends)
    assert read_lines(path) == ["größe 1", "", "two"]


JAPANESE, LATIN = ("右膝 左膝 1", "ヒザ_L", "ﾋｻﾞ"), ("größe 1", "Müller", "é", "posição", "ASCII")
UNICODE = ("utf-8", "utf-8-sig", "utf-16")
WRITTEN = [
    *((text, encoding) for text in JAPANESE for encoding in (*UNICODE, "cp932")),
    *((text, encoding) for text in LATIN for encoding in (*UNICODE, "latin-1")),
]


@pytest.mark.parametrize(("text", "encoding"), WRITTEN)
def test_text_of_any_usual_encoding_is_read(tmp_path, text, encoding):
    path = tmp_path / "a.txt"
    path.write_bytes(f"name\t{text}\n".encode(encoding))
    assert read_lines(path) == [f"name\t{text}"]


def test_an_encoding_that_is_not_known_is_no_error(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes("右膝\t1\n".encode("euc-jp"))
    assert read_lines(path)[0].endswith("\t1")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (b" \n\t\n", "is empty"),
        (b"abc\0def", "byte 3: is binary, not a text format"),
    ],
)
def test_what_is_no_text_is_told_with_file_and_place(tmp_path, content, says):
    path = tmp_path / "a.txt"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=rf"a\.txt.*{says}"):
        read_lines(path)


def test_a_file_that_can_not_be_read_says_why(tmp_path):
    with pytest.raises(FormatError, match=r"nowhere: can't be read: No such file"):
        read_bytes(tmp_path / "nowhere")
    with pytest.raises(FormatError, match="can't be read: Is a directory"):
        read_bytes(tmp_path)


@pytest.mark.parametrize(
    ("read", "word", "says"),
    [
        (number, "1,5", "a.txt, line 7: frame time must be a number, got '1,5'"),
        (number, "nan", "a.txt, line 7: frame time must be finite, got 'nan'"),
        (number, "1e999", "frame time must be finite"),
        (count, "2.5", "a.txt, line 7: frame time must be a whole number above 0, got '2.5'"),
        (count, "0", "whole number above 0, got '0'"),
        (count, "inf", "must be finite"),
    ],
)
def test_words_that_are_no_numbers_are_told_with_their_line(read, word, says):
    with pytest.raises(FormatError) as error:
        read("a.txt", 7, word, "frame time")
    assert says in str(error.value)


def test_words_that_are_numbers_are_read():
    assert number("a", 1, "-1.5e3", "x") == -1500.0
    assert count("a", 1, "12.0", "x") == 12


def test_repeated_names_get_numbers_that_no_other_has():
    assert unique(["a", "b", "a", "a_2", "a"]) == ("a", "b", "a_2", "a_2_2", "a_3")
