"""The Markdown that users read, and the code blocks in it."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Pages whose examples run: the README and the guide.
PAGES = [ROOT / "README.md", *sorted(p for p in (ROOT / "docs").rglob("*.md") if "made" not in p.parts)]
#: Address of the service in examples; blocks with it run against a test server in `tests/service`.
SERVICE = "127.0.0.1:8000"
_COMMAND_ENDS = {"&&", "||", "|", ";", "&", ">"}


def name(path: Path) -> str:
    """`path` below the root of the checkout."""
    return path.relative_to(ROOT).as_posix()


def blocks(path: Path, language: str) -> list[str]:
    """The code blocks of a page that are marked as `language`."""
    return re.findall(rf"^```{language}\n(.*?)^```", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def examples(path: Path) -> list[tuple[str, str | None]]:
    """The Python blocks of a page, each with what it prints: the `text` block right after it, or None."""
    found = re.findall(
        r"^```python\n(.*?)^```\n(?:```text\n(.*?)^```)?", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    return [(code, shown or None) for code, shown in found]


def commands(path: Path) -> list[list[str]]:
    """The arguments of every `motionenv …` in the bash blocks; a backslash at a line's end joins the next one."""
    found = []
    for line in "".join(blocks(path, "bash")).replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        for start, word in enumerate(words):
            if Path(word).name == "motionenv" and (start == 0 or words[start - 1] in _COMMAND_ENDS):
                rest = words[start + 1 :]
                found.append(rest[: next((i for i, w in enumerate(rest) if w in _COMMAND_ENDS), len(rest))])
    return found
