"""No file of data is ever executed: what could do that is not used, or only where a table says so."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("ros_ws/src", "scripts", "examples")
FORBIDDEN_MODULES = {
    *(
        "pickle",
        "cPickle",
        "_pickle",
        "cloudpickle",
        "dill",
        "jsonpickle",
        "shelve",
        "marshal",
        "dbm",
    ),
    *("h5py", "tables", "rosbag2_py"),
}
"""They unpickle, or read formats that hold code; the last ones have not been looked at."""
FORBIDDEN = {
    *("eval", "exec", "compile", "__import__", "os.system", "os.popen", "code.interact"),
    *(
        "numpy.fromregex",
        "numpy.lib.format.open_memmap",
        "numpy.memmap",
        "numpy.genfromtxt",
        "numpy.loadtxt",
    ),
    *("yaml.load", "yaml.load_all", "yaml.full_load", "yaml.full_load_all", "yaml.unsafe_load"),
    *(
        "yaml.unsafe_load_all",
        "yaml.safe_load_all",
        "yaml.Loader",
        "yaml.FullLoader",
        "yaml.UnsafeLoader",
    ),
    *("yaml.CLoader", "yaml.CUnsafeLoader", "yaml.CFullLoader"),
    *("pandas.read_pickle", "pandas.read_hdf", "pandas.read_csv", "pandas.read_json"),
    *("joblib.load", "joblib.Memory", "torch.jit.load", "torch.hub.load", "torch.package"),
    *("builtins.eval", "builtins.exec", "builtins.compile"),
}
"""Names that are not used anywhere, in full."""
WITH = {
    "numpy.load": ("allow_pickle", False),
    "numpy.lib.format.read_array": ("allow_pickle", False),
    "torch.load": ("weights_only", True),
}
"""Calls that must say so."""
ALLOWED = {
    "yaml.safe_load": {
        "hri_planner/ptomp/config.py": "text that ships with the package",
        "hri_planner/ptomp/variants.py": "text that ships with the package",
        "hri_sim/scenario/shipped.py": "text that ships with the package",
    },
    "yaml.SafeLoader": {"hri_prediction/files/values.py": "with limits"},
    "numpy.load": {"hri_sim/media/mujoco_child.py": "pictures that its parent asks for"},
    "numpy.lib.format.read_array": {
        "hri_prediction/files/arrays.py": "after its header was checked"
    },
    "importlib.import_module": {
        "hri_prediction/bags/schemas.py": "packages of messages whose definition is installed",
        "hri_planner/benchmarks/references.py": "names that stand there",
        "scripts/_project.py": "names of this project's modules",
    },
    "runpy.run_path": {"scripts/_project.py": "a module of this project"},
    "xml.etree.ElementTree.fromstring": {
        "hri_planner/robot/model.py": "the robot that ships with the package",
        "hri_prediction/live/qtm.py": "what a motion capture server answers, no file",
    },
    "pandas": {
        "hri_prediction/motor_control/analyses/variance.py": "frames of numbers, for statsmodels",
    },
    "joblib.Parallel": {
        "hri_prediction/results/workers.py": "pickles between processes of its own",
        "hri_sim/readability/batch.py": "pickles between processes of its own",
        "hri_prediction/evaluation/run.py": "pickles between processes of its own",
    },
}
"""What may be used, where, and why that executes no file of data."""
SHELL = {"subprocess.run", "subprocess.Popen", "subprocess.call", "subprocess.check_output"}
_ALIASES = {"numpy.lib.npyio.load": "numpy.load", "npy": "numpy.lib.format", "np": "numpy"}


def sources() -> list[Path]:
    found = [path for name in FOLDERS for path in (ROOT / name).rglob("*.py")]
    found += [path for path in (ROOT / "scripts").iterdir() if path.is_file() and not path.suffix]
    return sorted(path for path in found if "build" not in path.parts and is_python(path))


def is_python(path: Path) -> bool:
    return path.suffix == ".py" or "python" in path.read_text().partition("\n")[0]


def label(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    return "/".join(parts[3:] if parts[:2] == ("ros_ws", "src") else parts)


def names_of(tree: ast.AST) -> dict[str, str]:
    """What each name that a file imports stands for, in full."""
    found = dict(_ALIASES)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for each in node.names:
                top = each.name.partition(".")[0]
                found[each.asname or top] = each.name if each.asname else top
        elif isinstance(node, ast.ImportFrom):
            found |= {each.asname or each.name: f"{node.module}.{each.name}" for each in node.names}
    return found


def full_name(node: ast.AST, names: dict[str, str]) -> str:
    """``numpy.load`` of ``np.load``; empty: it is no name."""
    if isinstance(node, ast.Name):
        return names.get(node.id, node.id)
    if isinstance(node, ast.Attribute):
        inner = full_name(node.value, names)
        return f"{inner}.{node.attr}" if inner else ""
    return ""


def says(call: ast.Call, name: str, wanted: object) -> bool:
    values = [each.value for each in call.keywords if each.arg == name]
    return bool(values) and isinstance(values[0], ast.Constant) and values[0].value is wanted


def faults(text: str, where: str) -> Iterator[str]:
    """What must not stand in a file, by line."""
    tree = ast.parse(text)
    names = names_of(tree)
    for node in ast.walk(tree):
        line = f"{where}:{getattr(node, 'lineno', 0)}"
        modules: list[str] = []
        if isinstance(node, ast.Import):
            modules = [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules = [node.module or ""]
        for module in modules:
            if module.split(".")[0] in FORBIDDEN_MODULES:
                yield f"{line} imports {module}"
            if module in ALLOWED and where not in ALLOWED[module]:
                yield f"{line} imports {module}"
        if isinstance(node, ast.Name | ast.Attribute):
            name = full_name(node, names)
            if name in FORBIDDEN:
                yield f"{line} uses {name}"
            if name in ALLOWED and where not in ALLOWED[name]:
                yield f"{line} uses {name}"
        if isinstance(node, ast.Call):
            name = full_name(node.func, names)
            if name in WITH and not says(node, *WITH[name]):
                yield f"{line} calls {name} without {WITH[name][0]}={WITH[name][1]}"
            if name in SHELL and any(each.arg == "shell" for each in node.keywords):
                yield f"{line} calls {name} with a shell"


def test_nothing_executes_data() -> None:
    paths = sources()
    assert len(paths) > 500
    found = [fault for path in paths for fault in faults(path.read_text(), label(path))]
    assert found == []


def test_tables_name_what_is_there() -> None:
    """A line of the table that is not needed any more would let something new pass."""
    paths = {label(path): path for path in sources()}
    for name, places in ALLOWED.items():
        for place in places:
            tree = ast.parse(paths[place].read_text())
            names = names_of(tree)
            used = {full_name(node, names) for node in ast.walk(tree)}
            assert name in used, f"{place} does not use {name}"


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("import pickle\npickle.load(f)", ":1 imports pickle"),
        ("from cloudpickle import loads", ":1 imports cloudpickle"),
        ("import numpy as np\nnp.load(f)", ":2 calls numpy.load without allow_pickle=False"),
        ("from numpy import load\nload(f, allow_pickle=True)", ":2 calls numpy.load without"),
        ("import numpy\nnumpy.load(f, allow_pickle=flag)", ":2 calls numpy.load without"),
        ("import yaml\nyaml.load(f, yaml.Loader)", ":2 uses yaml.load"),
        ("from yaml import unsafe_load as load\nload(f)", ":2 uses yaml.unsafe_load"),
        ("import yaml\nyaml.safe_load(f)", ":2 uses yaml.safe_load"),
        ("eval('1')", ":1 uses eval"),
        ("def f():\n    exec(text)", ":2 uses exec"),
        ("g = compile", ":1 uses compile"),
        ("import torch\ntorch.load(f)", ":2 calls torch.load without weights_only=True"),
        ("import joblib\njoblib.load(f)", ":2 uses joblib.load"),
        ("import importlib\nimportlib.import_module(name)", ":2 uses importlib.import_module"),
        (
            "from importlib import import_module as load\nload(name)",
            ":2 uses importlib.import_module",
        ),
        ("import os\nos.system(text)", ":2 uses os.system"),
        (
            "import subprocess\nsubprocess.run(text, shell=True)",
            ":2 calls subprocess.run with a shell",
        ),
        (
            "from xml.etree import ElementTree as ET\nET.fromstring(t)",
            ":2 uses xml.etree.ElementTree",
        ),
    ],
)
def test_what_would_be_found(text: str, match: str) -> None:
    assert any(match in fault for fault in faults(text, "a.py"))


@pytest.mark.parametrize(
    "text",
    [
        "import re\nre.compile('x')",
        "import numpy as np\nfrom hri_sim.media import x\nnp.savez(f, a=1)",
        "import torch\ntorch.load(f, weights_only=True)",
        "spec.compile()",
        "import json\njson.load(f)",
    ],
)
def test_what_is_no_fault(text: str) -> None:
    assert list(faults(text, "a.py")) == []
