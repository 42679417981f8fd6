"""Sphinx's settings of the site: these pages, a gallery of examples that are run, and the reference.

sphinx-build -W -b html docs build/site
"""

import re
from pathlib import Path

from matplotlib.figure import Figure
from sphinx.application import Sphinx
from sphinx_gallery.scrapers import figure_rst

import motionenv

project, author = "motionenv", "The motionenv developers"
project_copyright = "2026, the motionenv developers"
version = release = motionenv.__version__
extensions = [
    "myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
]  # fmt: skip
templates_path = ["_templates"]
exclude_patterns = ["README.md", "examples/*"]  # the index for those who read the files themselves
default_role = "py:obj"  # a name in backticks links to what it names, if that has a page
suppress_warnings = [
    "config.cache",  # of the event handlers below
    "ref.python",  # shapes such as (frames, 3) at the head of a property's text are no types
]

html_theme = "pydata_sphinx_theme"
html_title = "motionenv"
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": False, "show_prev_next": False, "secondary_sidebar_items": ["page-toc"]}
myst_heading_anchors = 4

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"  # signatures show them
autodoc_member_order = "bysource"
napoleon_use_ivar = True


def _drawn(_block: tuple, variables: dict, settings: dict) -> str:
    """Show a `figure` that the library drew, of which pyplot doesn't know."""
    figure = variables["example_globals"].get("figure")
    if not isinstance(figure, Figure) or (figure.canvas.manager is not None):
        return ""
    path = next(variables["image_path_iterator"])
    figure.savefig(path)
    return figure_rst([path], settings["src_dir"])


sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "image_scrapers": ("matplotlib", _drawn),
    "gallery_dirs": "made/gallery",
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "show_signature": False,
    "capture_repr": (),  # values of last lines aren't shown
    "abort_on_example_error": True,
    "write_computation_times": False,
    "within_subsection_order": "FileNameSortKey",
}

#: Files of the checkout that pages link to: the page of the site that holds the same, or None for none.
_ELSEWHERE = {
    "../benchmarks/RESULTS.md": "made/results.md",
    "../benchmarks/LEADERBOARD.md": "made/leaderboard.md",
    "../renders/README.md": None,
    "../service/web/README.md": None,
    "../motionenv/mocap/marker_sets/sets": None,
    "../service/deploy/": None,
}


def _within_the_site(_: Sphinx, name: str, source: list[str]) -> None:
    """Turn links to files of the checkout into links within the site, or to what isn't part of it."""
    for file, page in _ELSEWHERE.items():
        source[0] = source[0].replace(f"]({file}", f"]({page}" if page else f"](file:{file.removeprefix('../')}")


def _copied(app: Sphinx, _config: object) -> None:
    """Make pages of results, whose pictures and links are seen from there."""
    made = Path(app.confdir, "made")
    made.mkdir(exist_ok=True)
    for name in ("results", "leaderboard"):
        text = Path(app.confdir, "..", "benchmarks", f"{name.upper()}.md").read_text(encoding="utf-8")
        text = re.sub(r"(?<=!)(\[[^\]]*\]\()(?!http)", r"\1../../benchmarks/", text)
        text = text.replace("](RESULTS.md", "](results.md").replace("](LEADERBOARD.md", "](leaderboard.md")
        Path(made, f"{name}.md").write_text(text, encoding="utf-8")


def _once(app: Sphinx, _kind: str, name: str, thing: object, skipped: bool, _options: object) -> bool:
    """Skip what another package's page tells of already: the first one in the order of the alphabet does."""
    if not getattr(thing, "__module__", "").startswith("motionenv") or "." in getattr(thing, "__qualname__", "."):
        return skipped
    here = app.env.docname
    if not here.startswith("made/reference/"):  # a table of names
        return skipped
    return skipped or _homes.setdefault(id(thing), here) != here


_homes: dict[int, str] = {}
#: What docstrings say plainly, and reStructuredText would take for markup: |x|, mean_, *.npz.
_PLAIN = [(r"\|", r"\|"), (r"(?<=\w)_(?=[\s,.;:)]|$)", r"\_"), (r"(?<![\w*])\*(?=\.\w)", r"\*")]
_CODE = re.compile(r"(?<!`)`([^`]+)`(?!`)(?=(s\b)?)")


def _as_rst(_app: Sphinx, _kind: str, _name: str, _thing: object, _options: object, lines: list[str]) -> None:
    """Turn Gymnasium's headings of environments into reStructuredText's, and escape what is no markup."""
    text = re.sub(r"^## (.*)$", r".. rubric:: \1\n", "\n".join(lines), flags=re.MULTILINE)
    blocks = text.split("\n\n")
    for i, block in enumerate(blocks):
        literal = block.lstrip().startswith(">>>") or (i and blocks[i - 1].endswith("::"))
        blocks[i] = block if literal else _escaped(_listed(block))
    lines[:] = "\n\n".join(blocks).split("\n")


def _listed(block: str) -> str:
    """A paragraph with a blank line before its list."""
    before, item, after = block.partition("\n- ")
    return block if block.startswith("- ") or not item else f"{before}\n{item}{after}"


def _escaped(block: str) -> str:
    """A paragraph whose code is marked as such, or as a name that may have a page: with a dot or a capital."""
    parts = _CODE.split(block)  # text, code, plural s or None, text …
    for i in range(0, len(parts), 3):
        for pattern, replacement in _PLAIN:
            parts[i] = re.sub(pattern, replacement, parts[i])
    for i in range(1, len(parts), 3):
        named = re.fullmatch(r"\w+(\.\w+)*", parts[i]) and re.search(r"[A-Z.]", parts[i])
        parts[i] = (f"`{parts[i]}`" if named else f"``{parts[i]}``") + ("\\ " if parts[i + 1] else "")
        parts[i + 1] = ""
    return "".join(parts)


def setup(app: Sphinx) -> None:
    """Sphinx calls this."""
    app.connect("autodoc-skip-member", _once)
    app.connect("autodoc-process-docstring", _as_rst)
    app.connect("source-read", _within_the_site)
    app.connect("config-inited", _copied)
