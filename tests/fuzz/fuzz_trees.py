"""Values as YAML and JSON hold them, altered; and texts that only look like such files."""

from __future__ import annotations

import copy
import json
from typing import Any

import yaml
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

NESTED: Any = "x"
for _ in range(40):
    NESTED = [NESTED]
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 7, 1000, 2**31, 2**32, 2**63 - 1, 2**63, 2**64, 10**30, 10**400),
    *(0.0, -0.0, -1.5, 1e-320, 1e9, 1e300, -1e308, float("inf"), float("-inf"), float("nan")),
    *("", " ", "x", "start", "nan", "1e5", "1", "true", "../../etc", "x\x00y", "\ud800", "ü", "y" * 5000),
    *([], {}, [[]], [{}], [0.0] * 3, [0] * 7, ["a"], [None], {"a": 1}, {"": {}}, {"x": float("nan")}),
    *(-(10**400), [1] * 5000, NESTED, {"name": "x", "side": 3}, [[0.1, 0.2], [0.3]], "2024-01-01"),
)  # fmt: skip
"""What may stand in the place of a value."""


def places(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where values are, the inner ones after the outer ones."""
    found = [path] if path else []
    items = (
        tree.items()
        if isinstance(tree, dict)
        else enumerate(tree)
        if isinstance(tree, list)
        else ()
    )
    for key, value in items:
        found += places(value, (*path, key))
    return found


def _at(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def _holds(tree: Any, node: Any) -> bool:
    """Whether a node is in a tree, or is all of it; the same node may be in several places."""
    if tree is node:
        return True
    inner = tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ()
    return any(_holds(each, node) for each in inner)


def tree_changed(draw: DrawFn, tree: Any) -> Any:
    """The same with another value, without one, with one more, or with two exchanged."""
    tree = copy.deepcopy(tree)
    there = places(tree)
    if not there:
        return draw(st.sampled_from(VALUES))
    path = draw(st.sampled_from(there))
    parent, key = _at(tree, path[:-1]), path[-1]
    what = draw(
        st.sampled_from(["value", "value", "value", "away", "more", "exchange", "key", "all"])
    )
    value = copy.deepcopy(
        draw(st.one_of(st.sampled_from(VALUES), st.floats(), st.integers(-9, 99)))
    )
    if what == "value":
        parent[key] = value
    elif what == "all":
        return value
    elif what == "away":
        del parent[key]
    elif what == "exchange":
        other = draw(st.sampled_from(there))
        outer, its_key = _at(tree, other[:-1]), other[-1]
        if not _holds(outer[its_key], parent) and not _holds(parent[key], outer):
            parent[key], outer[its_key] = outer[its_key], parent[key]
    elif isinstance(parent, list):
        parent[key:key] = [copy.deepcopy(parent[key])] * draw(st.sampled_from([1, 3, 200]))
    elif what == "key":
        name = draw(
            st.sampled_from(["", "x", 3, None, True, 1.5, "a\x00", "y" * 3000, "__class__"])
        )
        parent[name] = parent.pop(key)
    else:
        parent[draw(st.sampled_from(["further", 4, ""]))] = value
    return tree


@st.composite
def trees(draw: DrawFn, samples: tuple[Any, ...]) -> Any:
    """One of the values, with one to three changes."""
    tree = draw(st.sampled_from(samples))
    for _ in range(draw(st.sampled_from([1, 1, 2, 3]))):
        tree = tree_changed(draw, tree)
    return tree


def yaml_bytes(tree: Any) -> bytes:
    """As YAML; what it holds twice stands there once, with aliases."""
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True).encode(
        "utf-8", "surrogatepass"
    )


def json_text(tree: Any) -> str:
    """As JSON, keys of any kind as text."""
    if isinstance(tree, dict):
        return "{" + ",".join(f"{json.dumps(str(k))}:{json_text(v)}" for k, v in tree.items()) + "}"
    if isinstance(tree, list):
        return "[" + ",".join(map(json_text, tree)) + "]"
    return str(tree) if type(tree) is int else json.dumps(tree)


def laughs(levels: int = 12, width: int = 10) -> str:
    """A few lines of YAML that stand for ``width`` to the power of ``levels`` values."""
    lines = ["a0: &a0 [x, x]"]
    for level in range(1, levels):
        lines.append(f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * width)}]")
    return "\n".join(lines) + "\n"


def merging_laughs(levels: int = 12, width: int = 10) -> str:
    """The same with merged mappings, which grow while they are read."""
    lines = ["a0: &a0 {x: 1}"]
    for level in range(1, levels):
        aliases = ", ".join([f"*a{level - 1}"] * width)
        lines.append(f"a{level}: &a{level} {{<<: [{aliases}]}}")
    return "\n".join(lines) + "\n"


def odd_yaml(canary: str) -> dict[str, bytes]:
    """Texts that are not made by altering values, by what they are."""
    texts = {
        "laughs": laughs(),
        "merging laughs": merging_laughs(),
        "laughs at the top": laughs().replace("a11: &a11 ", "name: &a11 "),
        "chain": "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 500)),
        "within itself": "&a [*a, *a]",
        "mapping within itself": "&a {name: *a, seed: *a}",
        "merged within itself": "&a {<<: *a}",
        "deep": "[" * 20_000,
        "deep mappings": "{a: " * 5000,
        "deep block": "\n".join(" " * i + f"a{i}:" for i in range(600)),
        "questions": "? " * 20_000,
        "dashes": "- " * 20_000,
        "long number": "seed: " + "9" * 100_000,
        "long hexadecimal number": "seed: 0x" + "f" * 100_000,
        "long binary number": "name: 0b" + "1" * 100_000,
        "sexagesimal": "seed: " + ":".join(["59"] * 5000),
        "no such day": "name: 2024-13-45",
        "no such time": "name: 2024-01-01 99:99:99",
        "zone": "name: 2024-01-01 10:00:00 +99:99",
        "not an int": "seed: !!int x",
        "no int": "seed: !!int ''",
        "not a float": "seed: !!float x",
        "no float": "seed: !!float ''",
        "not a bool": "seed: !!bool maybe",
        "not a time": "seed: !!timestamp x",
        "not bytes": "name: !!binary ü",
        "a set": "!!set {name, seed}",
        "pairs": "!!pairs [a: 1, a: 2]",
        "ordered": "!!omap [a: 1]",
        "list as key": "? [a, b]\n: 1",
        "two documents": "a: 1\n---\nb: 2",
        "other version": "%YAML 9.9\n---\na: 1",
        "tab": "a:\n\t- b",
        "no anchor": "a: *nothing",
        "python": f"!!python/object/apply:os.mkdir ['{canary}']",
        "python inside": f"name: !!python/object/apply:os.mkdir ['{canary}']",
        "python new": f"!!python/object/new:os.mkdir ['{canary}']",
        "python name": "name: !!python/name:os.system ''",
        "own tag": "!hri [1]",
        "number": "3",
        "text": "only words",
        "null": "null",
        "nothing": "",
        "long line": "name: " + "x" * 50_000,
        "long key": "y" * 50_000 + ": 1",
        "many keys": "".join(f"k{i}: 1\n" for i in range(1000)),
        "comment": "#" * 30_000,
        "control": "name: \x07",
    }
    found = {name: text.encode() for name, text in texts.items()}
    found["utf-16"] = "name: x".encode("utf-16")
    found["not utf-8"] = b"name: \xff\xfe\xfa"
    found["NUL"] = b"name: \x00"
    found["surrogate"] = b"name: \xed\xa0\x80"
    found["escaped surrogate"] = b'name: "\\ud800"'
    return found
