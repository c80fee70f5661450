"""Plain values from YAML and JSON: numbers, texts, lists and mappings, never objects.

A few lines of YAML can stand for more values than there is memory for: aliases of aliases of aliases. A
value that is nested deeply, or a number of a million digits, breaks whatever takes it next. Such texts are
refused before values are made of them.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import yaml

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.content import read_text

MOST_CHARACTERS = 1_000_000
"""Longest text of YAML that is read: the metadata of a bag of hundreds of topics has a third of it."""
MOST_JSON = 1 << 22
"""Longest text of JSON [characters]: five times the longest that is written here. Lists of nothing take 26
bytes of memory a character."""
DEEPEST = 60
"""Levels of lists and mappings, one in the other."""
_SPREAD = 20
"""What aliases may make of a text: so many times its length."""
_ALWAYS = 100_000
"""And so much in any case [characters]."""
_BITS = 64
"""Longest whole number of YAML: what ROS and its messages have."""
_SURROGATE = re.compile("[\ud800-\udfff]")
"""Halves of characters, which no file and no terminal takes."""


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, which makes plain values only, with limits.

    Each node is weighed as if its aliases were written out.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._most = _SPREAD * len(text) + _ALWAYS
        self._open = 0
        self._weights: dict[int, tuple[int, int]] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """The next node; of an alias, the one that it stands for."""
        event = self.peek_event()
        if self._open >= DEEPEST:
            _refuse(f"more than {DEEPEST} levels", event)
        self._open += 1
        node = super().compose_node(parent, index)
        self._open -= 1
        if node is not None and id(node) not in self._weights:
            if isinstance(event, yaml.AliasEvent):
                _refuse("an alias within what it stands for", event)
            self._weights[id(node)] = self._weighed(node, event)
        return node

    def _weighed(self, node: yaml.Node, event: yaml.Event) -> tuple[int, int]:
        """Weight and levels of a node."""
        if isinstance(node, yaml.ScalarNode):
            if _SURROGATE.search(node.value):
                _refuse("a text that is no Unicode", event)
            return 1 + len(node.value), 1
        inner: list[yaml.Node] = []
        for item in node.value:
            inner += item if isinstance(item, tuple) else (item,)
        known = [self._weights[id(one)] for one in inner]
        weight = 1 + sum(weight for weight, _ in known)
        levels = 1 + max((levels for _, levels in known), default=0)
        if weight > self._most or levels > DEEPEST:
            _refuse("aliases that stand for too much", event)
        return weight, levels

    def whole_number(self, node: yaml.ScalarNode) -> int:
        """A whole number of no more than 64 bits."""
        value = super().construct_yaml_int(node)
        if not -(1 << (_BITS - 1)) <= value < 1 << _BITS:
            raise yaml.constructor.ConstructorError(
                None, None, f"a whole number of more than {_BITS} bits", node.start_mark
            )
        return int(value)


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.whole_number)


def _refuse(what: str, event: Any) -> None:
    raise yaml.composer.ComposerError(None, None, f"found {what}", event.start_mark)


def parse_yaml(text: str) -> Any:
    """Values from a text of YAML.

    Raises:
        yaml.YAMLError: on what is no YAML, has tags of objects, or stands for too much.
    """
    if len(text) > MOST_CHARACTERS:
        raise yaml.YAMLError(f"{len(text)} characters, more than {MOST_CHARACTERS}")
    loader = None
    try:
        loader = _Loader(text)
        return loader.get_single_data()
    # What PyYAML raises on a date in the 13th month, or a text that is tagged as a number.
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise yaml.YAMLError(f"a value that is none of its kind: {error!r:.200}") from error
    finally:
        if loader is not None:
            loader.dispose()


def read_yaml(path: str | Path, called: str = "", expected: str = "") -> Any:
    """Values from a YAML file.

    Args:
        path: The file.
        called: What the error puts before its name, such as an option.
        expected: What the error says that would have been right.

    Raises:
        ConfigError: when it cannot be read, or as :func:`parse_yaml`.
    """
    before = f"cannot read {called} {path}" if called else f"cannot read {path}"
    try:
        return parse_yaml(read_text(path, 4 * MOST_CHARACTERS))
    except DataError as error:
        problem = error.problem.replace(f"cannot read {path}", before, 1)
        raise ConfigError(problem, expected=expected or error.expected) from error
    except yaml.YAMLError as error:
        text = " ".join(str(error).split())
        raise ConfigError(f"{before}: {text:.1000}", expected=expected) from error


def parse_json(text: str) -> Any:
    """Values from a text of JSON.

    Raises:
        ValueError: on what is no JSON, is nested too deeply or too long, has a whole number of more digits
            than Python reads (4300), or a text that is no Unicode.
    """
    if len(text) > MOST_JSON:
        raise ValueError(f"{len(text)} characters, more than {MOST_JSON}")
    try:
        found = json.loads(text)
        if "\\u" in text and _SURROGATE.search(json.dumps(found, ensure_ascii=False)):
            raise ValueError("a text that is no Unicode")
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    return found


def read_json(path: str | Path) -> Any:
    """Values from a JSON file.

    Raises:
        DataError: when it cannot be read, or as :func:`parse_json`.
    """
    text = read_text(path, 4 * MOST_JSON)
    try:
        return parse_json(text)
    except ValueError as error:
        raise DataError(f"cannot read {path}: {error}", expected="JSON") from error
