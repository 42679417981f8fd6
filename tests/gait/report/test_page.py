"""The page of a report."""

from html.parser import HTMLParser

from motionenv.gait import Session, read_trial
from motionenv.gait.report import page

VOID = {"meta", "br", "link", "img", "input", "hr"}


class Reader(HTMLParser):
    """Checks that elements nest, and collects tags, attributes and text."""

    def __init__(self, text: str):
        super().__init__()
        self.open, self.tags, self.links, self.text = [], [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] != ["style"]:
            self.text += data


def test_the_page_is_well_formed_and_needs_nothing_beside_it(session):
    read = Reader(page(session))
    assert read.open == []
    assert not {"script", "link", "img", "iframe"} & set(read.tags)
    assert read.links == []
    assert "url(" not in page(session)
    assert "http" not in read.text


def test_names_are_text(session):
    read = Reader(page(session))
    assert "Gait report: <b>Ann & “Bo”</b>" in read.text
    assert "<script>alert(1)</script>" in read.text
    assert "<i>.c3d was left out: is <empty> & broken" in read.text
    assert "b" not in read.tags
    assert read.tags.count("i") == page(session).count("<i></i>")  # the swatches of the legend


def test_the_page_holds_the_figures(session):
    read = Reader(page(session))
    for p in session.parameters:
        if (p.name, p.side) in (("speed", ""), ("step_length", "left"), ("step_width", "right")):
            assert f"{p.mean:.2f} ± {p.sd:.2f}" in read.text
            assert f"{p.low:.2f} to {p.high:.2f}" in read.text
    assert read.tags.count("svg") == 13 + len(session.trials)
    assert f"mean ± 1 SD of {session.band.people} people" in read.text
    assert session.band.who in read.text
    assert "nan" not in read.text.lower().split()
    assert page(session) == page(session)


def test_without_a_band_and_without_strides(mocap):
    standing = read_trial(mocap / "btkdata/C3DSamples/PiG/PiG_Calibration3_FF.c3d")
    read = Reader(page(Session((standing,), {})))
    assert read.open == []
    assert "no step parameters" in read.text
    assert "Step parameters" not in read.text
    assert "Grey band" not in read.text
