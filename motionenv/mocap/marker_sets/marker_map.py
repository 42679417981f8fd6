"""Marker maps: which points of a file are which landmarks. The sets that motionenv ships are maps too.

A map is a small TOML file:

    name = "our laboratory"

    [points]
    left_knee_lateral = "KneeL"              # one point
    left_hip = { HipL1 = 0.5, HipL2 = 0.5 }  # weighted points; the weights sum to 1
    left_asis = ["LASI", "LASIS"]            # the first of these that the file has

    [sides]                                  # saves writing left and right: "{}" stands for the side's word
    left = "L"
    right = "R"

    [sided]
    heel = "{}Heel"

Names of points are compared without case, spaces, dots, dashes and underscores, and without a subject's name in front.
"""

import tomllib
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path

from motionenv._core.representation import OneLine
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.readers.text import read_lines

# A landmark is a place on the skin that can be felt (the ASIS, a malleolus), where laboratories put markers, or a
# joint's centre. Joint centres carry the names of the body's nodes (`motionenv.body.NODES`). Segments may also carry
# rigid clusters of up to five markers.
_TABLE = tomllib.loads(files(__package__).joinpath("landmarks.toml").read_text(encoding="utf-8"))


def _clusters(*segments: str) -> dict[str, str]:
    return {f"{s}_cluster_{i}": f"marker {i} of a rigid cluster on the {s}" for s in segments for i in range(1, 6)}


#: Landmarks that exist on both sides, those on the midline, and every landmark with its description.
SIDED: dict[str, str] = _TABLE["sided"] | _clusters("thigh", "shank", "foot")
MIDDLE: dict[str, str] = _TABLE["middle"] | _clusters("pelvis")
LANDMARKS = MIDDLE | {f"{side}_{name}": f"{side} {what}" for side in ("left", "right") for name, what in SIDED.items()}


#: One way to find a landmark: points and their weights, which sum to 1.
Weights = Mapping[str, float]

_WORDS = ("title", "source", "head_rotation", "shank_rotation")
_KEYS = {"name", *_WORDS, "points", "sides", "sided"}
_SUM = 1e-6  # tolerance of the sum of weights


@dataclass(frozen=True, repr=False)
class MarkerMap(OneLine):
    """Assignment of a file's points to landmarks.

    Attributes:
        points: for each landmark of `LANDMARKS`, the ways to find it, best first; each a point or weighted points.
        name: what to call it.
        title: one line about it.
        source: who defines these names.
        head_rotation: the joint whose captured rotation is the head's; "" if there is none.
        shank_rotation: of a skeleton whose legs `motionenv.mocap.clinical.skeleton_legs` corrects: the joints whose
            captured rotations are the shanks', left and right, with a comma between; "" otherwise.
    """

    points: Mapping[str, tuple[Weights, ...]]
    name: str = "marker map"
    title: str = ""
    source: str = ""
    head_rotation: str = ""
    shank_rotation: str = ""

    @classmethod
    def parse(cls, text: str) -> "MarkerMap":
        """The map in the `text` of a TOML file.

        Raises:
            MotionError: not TOML, an unknown landmark or key, or weights that don't sum to 1; names it.
        """
        try:
            table = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise MotionError(f"a marker map must be TOML: {error}; see motionenv mocap map --help") from None
        except RecursionError:
            raise MotionError('a marker map must be TOML, with lines such as left_hip = "LHJC"') from None
        if unknown := sorted(set(table) - _KEYS):
            raise MotionError(f"a marker map has no entry {unknown[0]!r}; it may have {', '.join(sorted(_KEYS))}")
        points = {**_both_sides(table), **_section(table, "points")}
        if not points:
            raise MotionError('a marker map needs a section [points] with lines such as left_hip = "LHJC"')
        words = {key: str(table.get(key, "")) for key in _WORDS}
        return cls({k: _ways(k, v) for k, v in points.items()}, str(table.get("name", "marker map")), **words)

    @classmethod
    def read(cls, path: str | Path) -> "MarkerMap":
        """The map in the TOML file `path`.

        Raises:
            FormatError: not a marker map, or not readable; says what is wrong.
        """
        lines = read_lines(path)
        try:
            return cls.parse("\n".join(lines))
        except MotionError as error:
            raise FormatError(path, str(error)) from None

    def to_toml(self) -> str:
        """The map as the text of a TOML file that `parse` reads."""
        told = {key: getattr(self, key) for key in ("name", *_WORDS)}
        head = [f"{key} = {_quoted(text)}" for key, text in told.items() if text]
        lines = [f"{landmark} = {_written(ways)}" for landmark, ways in self.points.items()]
        return "\n".join([*head, "", "[points]", *lines, ""])


def plain_name(name: str) -> str:
    """`name` as names are compared: without a subject's prefix, case, and all but letters and digits."""
    bare = unicodedata.normalize("NFKC", name.rpartition(":")[2]).casefold()
    return "".join(c for c in bare if c.isalnum()) or bare.strip()


def _section(table: Mapping, key: str) -> dict:
    """A section of the file, whose entries must be landmarks."""
    section = table.get(key, {})
    if not isinstance(section, Mapping):
        raise MotionError(f"[{key}] of a marker map must be a section, got {section!r}")
    allowed = SIDED if key == "sided" else LANDMARKS
    for landmark in section:
        if landmark not in allowed:
            near = get_close_matches(landmark, allowed, 1, 0.0)[0]
            raise MotionError(f"[{key}] of a marker map names no landmark {landmark!r}; did you mean {near!r}?")
    return dict(section)


def _both_sides(table: Mapping) -> dict:
    sided = _section(table, "sided")
    words = table.get("sides", {})
    if sided and (not isinstance(words, Mapping) or set(words) != {"left", "right"}):
        raise MotionError("a marker map with [sided] needs [sides] with the words for left and right")
    return {
        f"{side}_{landmark}": _with_word(value, str(words[side]))
        for side in ("left", "right")
        for landmark, value in sided.items()
    }


def _with_word(value, word: str):
    """`value` with the word for the side in the place of {}."""
    if isinstance(value, str):
        return value.replace("{}", word)
    if isinstance(value, Mapping):
        return {name.replace("{}", word): weight for name, weight in value.items()}
    return [_with_word(entry, word) for entry in value] if isinstance(value, Sequence) else value


def _ways(landmark: str, value) -> tuple[Weights, ...]:
    ways = value if isinstance(value, list) else [value]
    return tuple(_weights(landmark, way) for way in ways)


def _weights(landmark: str, way) -> Weights:
    if isinstance(way, str) and way.strip():
        return {way: 1.0}
    numbers = isinstance(way, Mapping) and all(
        isinstance(w, int | float) and not isinstance(w, bool) for w in way.values()
    )
    if not numbers or not way or not abs(sum(way.values()) - 1.0) < _SUM:
        wanted = "a point's name, weights such as { A = 0.5, B = 0.5 } that sum to 1, or a list of these"
        raise MotionError(f"{landmark} of a marker map must be {wanted}; got {way!r}")
    return {name: float(weight) for name, weight in way.items()}


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def _written(ways: tuple[Weights, ...]) -> str:
    texts = []
    for way in ways:
        only = len(way) == 1
        pairs = ", ".join(f"{_quoted(name)} = {weight!r}" for name, weight in way.items())
        texts.append(_quoted(next(iter(way))) if only else f"{{ {pairs} }}")
    return texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"
