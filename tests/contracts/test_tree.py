"""What holds for the files themselves: no capture data, nothing that only one machine knows."""

import hashlib
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("motionenv", "service", "tests", "benchmarks", "docs", "renders", ".ci", ".github")
CAPTURE = {".amc", ".asf", ".bvh", ".c3d", ".trc"}
MADE = {"__pycache__", "node_modules", "made"}  # by tools
TEXT = {"", ".cff", ".css", ".html", ".js", ".json", ".md", ".py", ".rst", ".sh", ".toml", ".txt", ".yaml", ".yml"}

# Written in two halves, so that this file does not find itself.
HOSTS = [
    "py" + "pi.org", "python" + "hosted.org", "registry." + "npmjs", "npm" + "js.com", "deb." + "debian.org",
    "conda." + "anaconda.org", "crates" + ".io", "proxy." + "golang.org",
]  # fmt: skip
MACHINE_PATH = re.compile(r"(?<![\w.:/~$}])/(?:work|root|home|tmp|opt)" + "/")


def tree() -> list[Path]:
    """Every file of the project: its folders, and what lies at the top of the checkout."""
    inside = [p for folder in FOLDERS for p in (ROOT / folder).rglob("*")]
    names = {"LICENSE", "CITATION.cff", ".gitattributes", ".gitignore", ".pre-commit-config.yaml"}
    top = [p for p in ROOT.iterdir() if p.suffix in {".md", ".toml"} or p.name in names]
    return sorted(p for p in inside + top if p.is_file() and not MADE & set(p.parts))


def test_nothing_names_a_registry_host_or_a_path_of_one_machine():
    texts = {p: p.read_text(encoding="utf-8") for p in tree() if p.suffix in TEXT}
    assert len(texts) > 500
    assert not [p for p, text in texts.items() if MACHINE_PATH.search(text) or any(host in text for host in HOSTS)]


def test_no_capture_files():
    assert not [p for p in tree() if p.suffix.lower() in CAPTURE]


def test_no_file_is_a_copy_of_capture(mocap):
    sizes = {p.stat().st_size: p for p in tree()}
    originals = [p for p in mocap.rglob("*") if p.is_file() and p.stat().st_size in sizes and p.stat().st_size > 0]
    ours = {hashlib.sha256(p.read_bytes()).digest() for p in tree()}
    assert not [p for p in originals if hashlib.sha256(p.read_bytes()).digest() in ours]


def test_the_machine_path_rule_itself():
    assert MACHINE_PATH.search("open('" + "/tmp" + "/x')")
    assert not MACHINE_PATH.search("https://example.org" + "/home" + "/x")
    assert not MACHINE_PATH.search("~" + "/work" + "/x")
