"""YAML and JSON give the values that PyYAML and json give, except where these would do harm."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.values import DEEPEST, parse_json, parse_yaml, read_json, read_yaml

TEXT = st.text(
    st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Zl", "Zp"]), max_size=8
)
PLAIN = st.one_of(
    *(st.none(), st.booleans(), st.integers(-(2**63), 2**64 - 1), st.floats(allow_nan=False), TEXT),
)
TREES = st.recursive(
    PLAIN, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4)
)


@given(TREES, st.booleans())
def test_what_is_written_is_read(tree, flow: bool) -> None:
    # What stands there twice is written once, with aliases.
    text = yaml.safe_dump([tree, tree], default_flow_style=flow, allow_unicode=True)
    assert parse_yaml(text) == yaml.safe_load(text) == [tree, tree]


def test_merged_mappings() -> None:
    text = "a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: {<<: [*a, *a]}\n"
    assert parse_yaml(text) == yaml.safe_load(text)
    assert parse_yaml(text)["b"] == {"x": 1, "y": 3}


@pytest.mark.parametrize(
    "text", ["", "# nothing", "null", "2024-01-05", "1:30", "!!set {a}", "---\n- 1"]
)
def test_other_texts(text: str) -> None:
    assert parse_yaml(text) == yaml.safe_load(text)


def test_levels() -> None:
    deepest = "[" * DEEPEST + "]" * DEEPEST
    with pytest.raises(yaml.YAMLError, match=f"more than {DEEPEST} levels"):
        parse_yaml(f"[{deepest}]")
    assert parse_yaml(deepest[1:-1]) == yaml.safe_load(deepest[1:-1])
    chain = "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, DEEPEST))
    with pytest.raises(yaml.YAMLError, match="aliases that stand for too much"):
        parse_yaml(chain)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("x: &a [*a]", "an alias within what it stands for"),
        ("x: 18446744073709551616", "a whole number of more than 64 bits"),
        ("x: -9223372036854775809", "a whole number of more than 64 bits"),
        ("x: 2024-13-01", "none of its kind.*month must be in"),
        ('x: "\\ud800"', "a text that is no Unicode"),
        ("!!python/object/apply:os.getcwd []", "could not determine a constructor"),
        ("x" * 1_000_001, "1000001 characters, more than 1000000"),
    ],
)
def test_what_would_do_harm(text: str, match: str) -> None:
    with pytest.raises(yaml.YAMLError, match=match):
        parse_yaml(text)


def test_files_name_themselves(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    with pytest.raises(
        ConfigError, match=r"cannot read --option .*a\.yaml: No such file.*; expected x"
    ):
        read_yaml(path, "--option", expected="x")
    path.write_text("[")
    with pytest.raises(ConfigError, match=r"cannot read .*a\.yaml: while parsing a flow"):
        read_yaml(path)
    path.write_text('{"a": [1, 0.5, null]}')
    assert read_yaml(path) == read_json(path) == {"a": [1, 0.5, None]}


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("{", "Expecting property name"),
        ("[" * 100_000, "nested too deeply"),
        ("1" * 5000, "integer string conversion"),
        ('{"a": "\\ud800"}', "a text that is no Unicode"),
    ],
)
def test_json_that_is_none(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(ValueError, match=match):
        parse_json(text)
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(DataError, match=rf"cannot read .*a\.json: .*{match}.*; expected JSON"):
        read_json(tmp_path / "a.json")


def test_json_with_characters_of_two_halves() -> None:
    assert parse_json('["\\ud83d\\ude00", "\\u00fc", NaN]')[:2] == ["😀", "ü"]
