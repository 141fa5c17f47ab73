"""Files and arguments that nobody means to write, as Hypothesis strategies, and how the command line must answer.

A hostile file is one of the project's studies, changed a few times as a tree of tables or as text; each change is one
of the functions below, whose names go into the statistics.
"""

import copy
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import tomli_w
from hypothesis import strategies as st

from cellmech.scene.keys import KNOWN


def small(data):
    """A study with a few of its cases, on a coarse mesh: `--check` meshes each of them."""
    data["mesh"] = data.get("mesh", {}) | {"size_um": 5.0}
    data["case"] = [entry | {"mesh.size_um": 5.0} for entry in data.get("case", [])[:5]]
    data["sweep"] = {key: values[:2] for key, values in data.get("sweep", {}).items()}
    return {key: value for key, value in data.items() if value}


STUDIES = [
    small(tomllib.loads(path.read_text(encoding="utf-8")))
    for path in sorted(Path(__file__).parents[1].glob("studies/*.toml"))
    if path.name != "paper_numbers.toml"  # no study
]
SCENES = [{}, {"pillar": [], "cell": {"gap_um": 1.0}}, {"flat": False, "pillar": [{"x_um": 7.0, "half_width_um": 3.0}]}]
LONGEST_MESSAGE = 1500  # characters, paths included

# fmt: off
NUMBERS = [
    0, 1, -1, 0.0, -0.0, 0.5, 1.0, 2, 5.0, 10, math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-300, 5e-324,
    2**31, 2**63, -(2**63) - 1, 10**400, 0.4999, 0.5000001, 1e5, 1e12, 1e-9,
]
TEXTS = [
    "", " ", "1", "1e3", "nan", "yeoh", "half", "full", "auto", "mixed", "../../x", "/etc/passwd", "a/b", "a\\b", "~",
    ".", "..", "CON", "-rf", "a\nb", "\x00", "\x1b[31m", "ä", "a\u0308", "\u202e", "\u2028", "K", "\u212a", "ß", "ss",
    "💥", "x" * 119, "x" * 121, "é" * 61, "x" * 5000, "summary.csv", "result.json", ".lock", "a.", "a ", "$(x)", "%n",
]
# fmt: on
NESTED = [[], {}, [[]], [{}], {"a": 1}, [1, "a", True], [0] * 20_000, {"x": {"y": {"z": [{}]}}}, [{}] * 300]
EDGES = st.sampled_from([*NUMBERS, *TEXTS, *NESTED, True, False])


@dataclass(frozen=True)
class Attempt:
    """One go at the command line: a file of that name and content in an empty folder, and further arguments."""

    name: str
    content: bytes
    arguments: tuple[str, ...] = ()
    changes: tuple[str, ...] = field(default=())


# Changes of the tree


def places(data, path=()):
    """The path of every key and list entry."""
    items = data.items() if isinstance(data, dict) else enumerate(data[:30]) if isinstance(data, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def somewhere(draw, data):
    """A container and one of its keys; a new key if there is none."""
    path = draw(st.sampled_from(list(places(data)) or [("cell",)]))
    for key in path[:-1]:
        data = data[key]
    return data, path[-1]


def delete(draw, data):
    holder, key = somewhere(draw, data)
    holder.pop(key) if key in holder or isinstance(holder, list) else None


def retype(draw, data):
    holder, key = somewhere(draw, data)
    holder[key] = copy.deepcopy(draw(EDGES))


def set_known(draw, data):
    *tables, last = draw(st.sampled_from(KNOWN)).replace(".0.", ".").split(".")
    for name in tables:
        inner = data.setdefault(name, [{}] if name == "pillar" else {}) if isinstance(data, dict) else None
        data = inner[0] if isinstance(inner, list) and inner and isinstance(inner[0], dict) else inner
    if isinstance(data, dict):
        data[last] = copy.deepcopy(draw(EDGES))


def scale(draw, data):
    holder, key = somewhere(draw, data)
    value = holder.get(key) if isinstance(holder, dict) else holder[key]
    if isinstance(value, float | int) and abs(value) < 1e300:
        holder[key] = draw(st.sampled_from([-1.0, 0.5, 0.9, 1.1, 2.0, 10.0, 1e4])) * value


def rename(draw, data):
    holder, key = somewhere(draw, data)
    if isinstance(holder, dict):
        new = draw(st.sampled_from([str(key).upper(), f"{key}_", f" {key}", str(key)[1:], f"{key}.x", "name", *TEXTS]))
        holder[new] = holder.pop(key, 1)


def duplicate(draw, data):
    holder, key = somewhere(draw, data)
    if isinstance(holder, list):
        holder.insert(key, copy.deepcopy(holder[key]))
    else:
        holder[draw(st.sampled_from([str(key).upper(), f"{key} ", f"{key}2"]))] = copy.deepcopy(holder.get(key, 1))


def wrap(draw, data):
    holder, key = somewhere(draw, data)
    value = holder.get(key, 1) if isinstance(holder, dict) else holder[key]
    for _ in range(draw(st.sampled_from([1, 2, 19, 25, 90]))):
        value = [value] if draw(st.booleans()) else {"a": value}
    holder[key] = value


def move(draw, data):
    holder, key = somewhere(draw, data)
    value = holder.pop(key, 1) if isinstance(holder, dict) else holder[key]
    other, place = somewhere(draw, data)
    other[place] = copy.deepcopy(value)  # no cycles


def many(draw, data):
    """Huge lists of pillars, times or cases."""
    count = draw(st.sampled_from([2, 40, 1000]))
    kind = draw(st.sampled_from(["pillar", "times", "case"]))
    if kind == "pillar":
        data["pillar"] = [{"x_um": 50.0 * i, "half_width_um": 10.0} for i in range(count)]
    elif kind == "times":
        data["output"] = {"times_s": [float(i + 1) for i in range(count)]}
    else:
        data.pop("sweep", None)
        data["case"] = [{"name": f"{i}", "load.factor": 1.0 + i} for i in range(min(count, 40))]


def sweep(draw, data):
    """Axes of hostile values, or whose product explodes."""
    data.pop("case", None)
    if draw(st.booleans()):
        keys = [key for key in KNOWN if key.startswith("layer.") and key.endswith("_Pa")]
        data["sweep"] = {key: [float(i + 1) for i in range(100)] for key in keys}
        return
    key = draw(st.sampled_from(KNOWN))
    data["sweep"] = {key: copy.deepcopy(draw(st.lists(EDGES, max_size=4)))}


def names(draw, data):
    """Cases whose names clash, as such or on some file system, or lead elsewhere."""
    data.pop("sweep", None)
    chosen = draw(st.lists(st.one_of(st.sampled_from([*TEXTS, "a", "A", "À", "à"]), EDGES), min_size=1, max_size=4))
    data["case"] = [{"name": name, "load.factor": 1.0 + i} for i, name in enumerate(copy.deepcopy(chosen))]


TREE = [delete, retype, retype, set_known, set_known, set_known, scale, scale, rename, duplicate, wrap, move]
TREE += [many, sweep, names]


# Changes of the text


def cut_out(draw, text):
    begin = draw(st.integers(0, len(text)))
    return text[:begin] + text[begin + draw(st.integers(1, 60)) :]


def cut_off(draw, text):
    return text[: draw(st.integers(0, len(text)))]


def line_twice(draw, text):
    lines = text.splitlines(keepends=True) or [b"\n"]
    line = draw(st.sampled_from(lines))
    lines.insert(draw(st.integers(0, len(lines))), line)
    return b"".join(lines)


def put_in(draw, text):
    pieces = [b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\r\n", b"=", b"[", b"]]", b'"""', b"#", b".", b"{", b"\xc3"]
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(st.one_of(st.sampled_from(pieces), st.binary(max_size=8))) + text[at:]


def bomb(draw, text):
    """Small or large files that cost a reader much."""
    n = draw(st.sampled_from([30, 3000, 100_000]))
    # fmt: off
    repeated = [  # start, what is repeated, end
        ("x = ", "[", ""), ("x = [", "[", "]" * n), ("x = ", "{a=", ""), ("", "a.", "b = 1"), ("[", "a.", ""),
        ("x = ", "9", ""), ("x = 1e", "9", ""), ("load.factor = ", "9", ""), ("load.factor = 0x", "f", ""),
        ('[sweep]\n"load.factor" = [0x', "f", "]"), ('x = "', "\\u0061", '"'), ('title = "', "t", '"'),
        ("", "a", " = 1"), ("", "[[pillar]]\n", ""), ("", "[[case]]\n", ""), ("[cell.law", ".x", "]"),
        ("", "#" * 12, ""), ("", "\n" * 12, ""),
    ]
    # fmt: on
    start, piece, end = draw(st.sampled_from(repeated))
    return draw(st.sampled_from([b"", text + b"\n"])) + (start + piece * n + end).encode() + b"\n"


TEXT = [cut_out, cut_off, line_twice, put_in, bomb]


# Whole attempts

# fmt: off
FILES = ["my.toml"] * 100 + [
    "My File.toml", "ü.toml", "no-ending", "a=b.toml", "x" * 118 + ".toml", "x" * 130 + ".toml", ".toml", "..toml",
    "~.toml", "a\nb.toml", "a\x1b[31mb.toml", "\udcff.toml", "summary.csv.toml", "*.toml",
]
OUTS = ["", ".", "..", "/", "out", "out/../out2", "../out", "my.toml", "my.toml/x", "/proc/x", "/dev/null", "x" * 300]
SETS = [
    "load.factor=2", "load.factor", "=", "a=b", "x" * 3000 + "=1", "cell.law=[[[[", "pillar=[]", "pillar.0.x_um=1e400",
    "pillar.99999999999.x_um=1", "pillar=3", "flat=false", "cell={}", "title=a\nb", "sweep={}", "case=1",
    "mesh.order=2", "cell.law=" + "[" * 3000, "load.factor=" + "9" * 5000, "=1", "load..factor=1", ".=1", "\udcff=1",
    "cell.law=\udcff", "cell={" + "a." * 30_000 + "b=1}", "load.factor=0x" + "f" * 5000,
]
NUMBERS_OF_RANKS = ["0", "1", "-1", "x", "9" * 5000, "nan"]
SHARDS = ["0/0", "1/1", "2/1", "1/9", "x", "9" * 12 + "/1", ""]
WORDS = ["--bogus", "--", "-", "--set", "--accuracy", "--quiet", "@x", "missing.toml", ".", "/dev/zero", "\udcff"]
# fmt: on
ARGUMENTS = st.one_of(
    st.sampled_from(OUTS).map(lambda out: ("--out", out)),
    st.sampled_from(SETS).map(lambda text: ("--set", text)),
    st.sampled_from([text for text in TEXTS[2:] if "\0" not in text]).map(lambda name: (f"--only={name}",)),
    st.sampled_from(SHARDS).map(lambda shard: ("--shard", shard)),
    st.sampled_from(NUMBERS_OF_RANKS).map(lambda n: ("--ranks-per-case", n)),
    st.sampled_from(WORDS).map(lambda word: (word,)),
)


def dumped(data):
    """The tree as TOML, and "" for the rare one that TOML cannot hold."""
    try:
        return tomli_w.dumps(data).encode("utf-8", errors="surrogateescape")
    except (ValueError, TypeError, AttributeError, RecursionError):
        return b""


@st.composite
def attempts(draw):
    """A hostile file, now and then under a hostile name or with hostile arguments."""
    data, changes = copy.deepcopy(draw(st.sampled_from(STUDIES + SCENES))), []
    for change in draw(st.lists(st.sampled_from(TREE), min_size=1, max_size=2)):
        change(draw, data)
        changes.append(change.__name__)
    text = dumped(data)
    for change in draw(st.sampled_from([*[[]] * 15, *([change] for change in TEXT)])):
        text = change(draw, text)
        changes.append(change.__name__)
    name = draw(st.sampled_from(FILES))
    arguments = draw(ARGUMENTS) if draw(st.integers(0, 9)) == 9 else ()
    changes += ["name"] * (name != "my.toml") + ["argument"] * bool(arguments)
    return Attempt(name, text, arguments, tuple(changes))


def wrong(status, out, err, attempt):
    """What is wrong with an answer to `--check`, "" if nothing is: solvable and said so, or one message of ours."""
    if status == 0:
        return "a message beside status 0" if err else "" if out else "no word beside status 0"
    if status != 2:
        return f"status {status}"
    if out:
        return "output beside the message"
    if not err.endswith("\n") or not err[:-1].isprintable() or not err.startswith("cellmech: error: "):
        return "not one line of ours"
    if len(err) > LONGEST_MESSAGE:
        return f"a message of {len(err)} characters"
    written = (attempt.name, *attempt.arguments[:1])
    known = (*written, *(ascii(text)[1:-1] for text in written), "--", "command line")
    return "" if err.removeprefix("cellmech: error: ").startswith(known) else "a message that names no place"
