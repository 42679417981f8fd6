"""Sphinx's settings of the site: these pages, a gallery of examples that are run, and the reference.

sphinx-build -W -b html docs build/site
"""

import os
import re
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from docutils.nodes import SkipNode, math, math_block
from latex2mathml.converter import convert as latex2mathml
from matplotlib.figure import Figure
from sphinx.application import Sphinx
from sphinx.ext import autosummary
from sphinx.writers.html5 import HTML5Translator as HTMLTranslator
from sphinx_gallery.scrapers import figure_rst

import motionenv

sys.path.insert(0, str(Path(__file__).parents[1]))  # examples take some models from the benchmarks
sys.path.insert(0, str(Path(__file__).parent))
import pages

DOCS = Path(__file__).parent

pages.make_pages()
project, author = "motionenv", "The motionenv developers"
project_copyright = "2026, the motionenv developers"
version = release = motionenv.__version__
extensions = [
    "myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.viewcode",
    "sphinx_design", "sphinx_gallery.gen_gallery",
]  # fmt: skip
templates_path = ["_templates"]
#: The index for those who read the files themselves, and what is put into other pages.
exclude_patterns = ["README.md", "examples/*", "licences.md"]
default_role = "py:obj"  # a name in backticks links to what it names, if that has a page
suppress_warnings = [
    "config.cache",  # of the event handlers below
    "ref.python",  # shapes such as (frames, 3) at the head of a property's text are no types
]

html_theme = "pydata_sphinx_theme"
html_title = "motionenv"
html_show_sourcelink = False
html_static_path, html_css_files = ["_static"], ["site.css"]
html_theme_options = {
    "navigation_with_keys": False,
    "show_prev_next": False,
    "navigation_depth": 1,  # deeper ones would get toggles without a name
    "secondary_sidebar_items": ["page-toc"],
}
if "MOTIONENV_SITE_BASE" in os.environ:  # where the site is published, beside its other versions: see versions.py
    html_theme_options |= {
        "switcher": {
            "json_url": os.environ["MOTIONENV_SITE_BASE"] + "/switcher.json",
            "version_match": os.environ["MOTIONENV_SITE_VERSION"],
        },
        "check_switcher": False,  # the list is written after the first build
        "navbar_start": ["navbar-logo", "version-switcher"],
        "show_version_warning_banner": True,
    }
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"  # signatures show them
autodoc_member_order = "bysource"
napoleon_custom_sections = [("Attributes", "params_style")]  # "Variables" is napoleon's word for them


def _drawn(_block: tuple, variables: dict, settings: dict) -> str:
    """Show a `figure` that the library drew, of which pyplot doesn't know."""
    figure = variables["example_globals"].get("figure")
    if not isinstance(figure, Figure) or hasattr(figure, "number"):  # pyplot numbers its own
        return ""
    path = next(variables["image_path_iterator"])
    figure.savefig(path)
    return figure_rst([path], settings["src_dir"])


#: Examples to begin a section with; the others follow by name, as the papers' figures all do.
_FIRST = ("walk", "speed", "turn", "traits", "truth", "views", "events", "lift", "sure", "environments", "agents")


def _reading_order(path: str) -> tuple[int, str]:
    """Sort key of an example."""
    name = Path(path).stem.removeprefix("plot_")
    return (_FIRST.index(name) if name in _FIRST else len(_FIRST), name)


sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "backreferences_dir": "made/uses",
    "doc_module": ("motionenv",),
    "image_scrapers": ("matplotlib", _drawn),
    "gallery_dirs": "made/gallery",
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "show_signature": False,
    "capture_repr": (),  # values of last lines aren't shown
    "abort_on_example_error": True,
    "write_computation_times": False,
    "within_subsection_order": _reading_order,
}

#: Files of the checkout that pages link to, and the page of the site that shows the same.
_PAGES = {
    r"benchmarks/RESULTS\.md": "/made/results.md",
    r"benchmarks/LEADERBOARD\.md": "/made/leaderboard.md",
    r"examples/([\w/]+)\.py": r"/made/gallery/\1.rst",
}
#: Links to what isn't part of the site.
_OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+((?:renders|service|motionenv)/[^)#]*)\)")


def _within_the_site(_: Sphinx, name: str, source: list[str]) -> None:
    """Turn links to files of the checkout into links within the site, or into the name of the file."""
    if name.startswith("made/"):
        return
    for file, page in _PAGES.items():
        source[0] = re.sub(rf"\]\((?:\.\./)*{file}", f"]({page}", source[0])
    source[0] = _OUTSIDE.sub(lambda m: m[0] if m[2].endswith((".png", ".webp")) else f"{m[1]} (`{m[2]}`)", source[0])


def _public(module: ModuleType) -> list[str]:
    return getattr(module, "__all__", [name for name in dir(module) if not name.startswith("_")])


def _homes() -> dict[int, tuple[str, str]]:
    """By the identity of each public class and function, the package whose page tells of it, and its name there.

    That is the first one in the order of the reference, which is the shortest.
    """
    found: dict[int, tuple[str, str]] = {}
    for package in re.findall(r"^   (motionenv[\w.]*)$", (DOCS / "reference.rst").read_text(), re.MULTILINE):
        module = import_module(package)
        for name in _public(module):
            thing = getattr(module, name)
            if getattr(thing, "__module__", "").startswith("motionenv") and hasattr(thing, "__qualname__"):
                found.setdefault(id(thing), (package, name))
    return found


HOMES = _homes()
autosummary.WELL_KNOWN_ABBREVIATIONS += ("ch.", "eq.", "eqs.", "fig.", "figs.", "sec.")  # no sentence ends there


def _once(app: Sphinx, _kind: str, name: str, thing: object, skipped: bool, _options: object) -> bool:
    """Skip what another package's page tells of."""
    page = app.env.docname.removeprefix("made/reference/")
    home = HOMES.get(id(thing))
    return skipped or (page.startswith("motionenv") and home is not None and home[0] != page)


def _contents(package: str) -> list[str]:
    """A table of the public classes and functions of a package, each with a link to where it is told of."""
    module = import_module(package)
    homes = [HOMES[id(thing)] for name in _public(module) if id(thing := getattr(module, name)) in HOMES]
    entries = [name if home == package else f"~{home}.{name}" for home, name in homes]
    return ["", ".. autosummary::", "   :nosignatures:", "", *(f"   {entry}" for entry in entries), ""]


#: What docstrings say plainly, and reStructuredText would take for markup: |x|, mean_, *.npz.
_PLAIN = [(r"\|", r"\|"), (r"(?<=\w)_(?=[\s,.;:)]|$)", r"\_"), (r"(?<![\w*])\*(?=\.\w)", r"\*")]
_CODE = re.compile(r"(?<!`)`([^`]+)`(?!`)(?=(s\b)?)")


def _as_rst(app: Sphinx, kind: str, name: str, _thing: object, _options: object, lines: list[str]) -> None:
    """Turn Gymnasium's headings of environments into reStructuredText's, escape what is no markup, and add examples."""
    text = re.sub(r"^## (.*)$", r".. rubric:: \1\n", "\n".join(lines), flags=re.MULTILINE)
    blocks = text.split("\n\n")
    for i, block in enumerate(blocks):
        literal = block.lstrip().startswith(">>>") or (i and blocks[i - 1].endswith("::"))
        blocks[i] = block if literal else _escaped(_listed(block))
    lines[:] = "\n\n".join(blocks).split("\n")
    short = f"motionenv.{name.rpartition('.')[2]}"  # as the gallery names what examples use
    uses = Path(app.confdir, "made", "uses", f"{short}.examples")
    if kind == "module":
        lines += _contents(name)
    if kind in ("class", "function") and uses.exists() and uses.stat().st_size:
        lines += ["", f".. minigallery:: {short}", ""]


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


def _math(self: HTMLTranslator, node: math | math_block) -> None:
    """Write an equation as MathML, which browsers show, and read out, without a script."""
    self.body.append(latex2mathml(node.astext(), display="block" if isinstance(node, math_block) else "inline"))
    raise SkipNode


def setup(app: Sphinx) -> None:
    """Sphinx calls this."""
    app.add_html_math_renderer("mathml", inline_renderers=(_math, None), block_renderers=(_math, None))
    app.connect("autodoc-skip-member", _once)
    app.connect("autodoc-process-docstring", _as_rst)
    app.connect("source-read", _within_the_site)
