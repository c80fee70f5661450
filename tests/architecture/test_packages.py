"""What holds for the code as a whole: who imports whom, what is declared, what scripts answer."""

from __future__ import annotations

import ast
import hashlib
import importlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "ros_ws" / "src"
MESSAGES = "hri_msgs"
ORDER = ("hri_prediction", "hri_planner", "hri_sim")
"""Each may import those before it, never those after it."""

ROS_FOLDERS = {
    "hri_prediction": ("ros", "nodes"),
    "hri_planner": ("ros", "nodes"),
    "hri_sim": ("ros", "nodes", "launch", "testing", "tools", "faults"),
}
"""Folders whose modules may import ROS. All others are cores that run without it."""
LAZY_ROS = {
    "hri_prediction/bags/reader.py": "only where a message is really decoded",
    "hri_sim/recording/benchmark.py": "only in the process that it starts as the publisher",
}
"""Cores that import ROS within a function, and why."""
ROSDEP_KEYS = {
    "joblib": "python3-joblib",
    "matplotlib": "python3-matplotlib",
    "mpl_toolkits": "python3-matplotlib",
    "mujoco": "python3-mujoco-pip",
    "networkx": "python3-networkx",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "pandas": "python3-pandas",
    "psutil": "python3-psutil",
    "pydantic": "python3-pydantic",
    "rich": "python3-rich",
    "scipy": "python3-scipy",
    "sklearn": "python3-sklearn",
    "statsmodels": "python3-statsmodels",
    "typer": "python3-typer",
    "yaml": "python3-yaml",
}
WITHOUT_KEY = {
    "casadi": "casadi",
    "coal": "coal",
    "distributed": "distributed",
    "ezc3d": "ezc3d",
    "imageio_ffmpeg": "imageio-ffmpeg",
    "llvmlite": "llvmlite",
    "lz4": "lz4",
    "mcap": "mcap",
    "movement_primitives": "movement-primitives",
    "pinocchio": "pin",
    "qtm_rt": "qtm-rt",
    "torch": "torch",
    "zstandard": "zstandard",
}
"""Modules that rosdep does not know; package.xml names them in a comment."""
EXTRAS = {
    "coal": "dev.txt",
    "movement_primitives": "dev.txt",
    "networkx": "training.txt",
    "distributed": "cluster.txt",
    "pinocchio": "dev.txt",
    "qtm_rt": "qualisys.txt",
    "sklearn": "training.txt",
    "torch": "training.txt",
}
"""Modules that little needs, and the file that locks them instead of runtime.txt."""
LEARNING = "hri_planner/rnn/training/"
"""Modules that need torch to be loaded; nothing loads them but training."""
CEILING = 400
CEILINGS = {
    "hri_planner/nodes/motion_node.py": 310,  # its decisions belong into hri_planner/supervision
    "hri_planner/supervision/supervisor.py": 300,
}
"""Modules that may not grow to the ceiling of all."""


def _is_ros(name: str) -> bool:
    top = name.split(".")[0]
    return top in ("rclpy", "launch", "launch_ros") or top.endswith(("_msgs", "_interfaces"))


def _modules(package: str) -> Iterator[Path]:
    yield from sorted((SOURCES / package / package).rglob("*.py"))


def _label(path: Path) -> str:
    """``hri_sim/people/arm.py``: a path within its package."""
    return "/".join(path.relative_to(SOURCES).parts[1:])


def _imports(path: Path, *, module_level: bool = False) -> set[str]:
    """Dotted names that a file imports; what is imported for type checkers alone does not count."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            return
        if module_level and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} has a relative import"
            found.add(node.module or "")
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text()))
    return found


def _allows_ros(path: Path) -> bool:
    package, *inner = path.relative_to(SOURCES).parts[1:]
    return len(inner) > 1 and inner[0] in ROS_FOLDERS[package]


CORES = [path for package in ORDER for path in _modules(package) if not _allows_ros(path)]


# ------------------------------------------------------------------ packages and their manifests
def _declared(package: str) -> tuple[set[str], str]:
    """Dependencies of package.xml at run time, and its whole text."""
    path = SOURCES / package / "package.xml"
    root = ElementTree.parse(path).getroot()
    return {
        e.text or "" for tag in ("depend", "exec_depend") for e in root.iter(tag)
    }, path.read_text()


@pytest.mark.parametrize("package", ORDER)
def test_packages_depend_one_way(package: str) -> None:
    allowed = {MESSAGES, *ORDER[: ORDER.index(package) + 1]}
    for path in _modules(package):
        used = {name.split(".")[0] for name in _imports(path)} & {MESSAGES, *ORDER}
        assert used <= allowed, _label(path)
    assert _declared(package)[0] & set(ORDER) <= allowed


def test_messages_depend_on_none_of_the_packages() -> None:
    assert not _declared(MESSAGES)[0] & set(ORDER)


@pytest.mark.parametrize("package", ORDER)
def test_package_xml_declares_what_is_imported_and_no_more(package: str) -> None:
    files = [*_modules(package), *(SOURCES / package).glob("launch/*.py")]
    tops = {name.split(".")[0] for path in files for name in _imports(path)}
    tops -= {*sys.stdlib_module_names, package, ""}
    declared, text = _declared(package)
    comments = " ".join(re.findall(r"<!--(.*?)-->", text, re.DOTALL))
    for name in tops & WITHOUT_KEY.keys():
        assert WITHOUT_KEY[name] in comments, f"{name} is imported and not mentioned in package.xml"
    used = {ROSDEP_KEYS.get(name, name) for name in tops - WITHOUT_KEY.keys()}
    used.add(MESSAGES)  # by way of hri_prediction.ros.messages, which checks whose they are
    assert used - declared == set(), "imported, not in package.xml"
    assert declared - used == set(), "in package.xml, not imported"


@pytest.mark.parametrize("package", ORDER)
def test_python_requirements_are_locked(package: str) -> None:
    tops = {name.split(".")[0] for path in _modules(package) for name in _imports(path)}
    names = {"yaml": "pyyaml", "mpl_toolkits": "matplotlib", "sklearn": "scikit-learn"}
    names |= WITHOUT_KEY
    for file in ("runtime.txt", "runtime_system_ros.txt"):
        lines = (ROOT / "requirements" / file).read_text().splitlines()
        locked = {line.split("==")[0].lower() for line in lines}
        known = (ROSDEP_KEYS.keys() | WITHOUT_KEY.keys()) - EXTRAS.keys()
        assert {names.get(top, top) for top in tops & known} <= locked, file
    for top in tops & EXTRAS.keys():
        for file in (EXTRAS[top], "dev.txt"):
            assert f"{names.get(top, top)}==" in (ROOT / "requirements" / file).read_text(), file


@pytest.mark.parametrize("package", ORDER)
def test_extras_are_not_needed_to_load_anything(package: str) -> None:
    for path in _modules(package):
        allowed = {"torch"} if _label(path).startswith(LEARNING) else set()
        loaded = _imports(path, module_level=True)
        assert not loaded & EXTRAS.keys() - allowed, _label(path)
        learning = {name for name in loaded if name.startswith(LEARNING.replace("/", "."))}
        plain = {"hri_planner.rnn.training.config"}
        if not allowed:
            assert {".".join(name.split(".")[:4]) for name in learning} <= plain, _label(path)


@pytest.mark.parametrize("package", ORDER)
def test_entry_points_exist(package: str) -> None:
    text = (SOURCES / package / "setup.py").read_text()
    entries = re.findall(r'"(\w+) = ([\w.]+):(\w+)"', text)
    assert entries
    for name, module, function in entries:
        path = SOURCES / package / Path(*module.split(".")).with_suffix(".py")
        assert path.is_file(), f"executable {name} names the module {module}, which does not exist"
        names = {n.name for n in ast.parse(path.read_text()).body if isinstance(n, ast.FunctionDef)}
        assert function in names, f"{module} has no {function}"


# ------------------------------------------------------------------ cores without ROS
@pytest.mark.parametrize("path", CORES, ids=_label)
def test_cores_do_not_import_ros(path: Path) -> None:
    at_load = {name for name in _imports(path, module_level=True) if _is_ros(name)}
    assert not at_load
    anywhere = {name for name in _imports(path) if _is_ros(name)}
    assert bool(anywhere) == (_label(path) in LAZY_ROS), anywhere


def test_cores_load_where_ros_is_not_installed() -> None:
    names = [
        _label(path).removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        for path in CORES
        if path.stem != "mujoco_child"  # a script of its own, not a module
        and not _label(path).startswith(LEARNING)
    ]
    code = (
        "import importlib, sys\n"
        "for name in ('rclpy', 'hri_msgs', 'std_msgs', 'sensor_msgs', 'geometry_msgs',"
        " 'builtin_interfaces'):\n"
        "    sys.modules[name] = None\n"
        f"for name in {names!r}:\n"
        "    importlib.import_module(name)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


# ------------------------------------------------------------------ the checkout is what is tested
def _contents(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.suffix in (".py", ".yaml", ".urdf", ".npz", ".json", ".typed")
    }


@pytest.mark.parametrize("package", ORDER)
def test_tests_import_what_the_checkout_holds(package: str) -> None:
    file = importlib.import_module(package).__file__
    assert file is not None
    imported = Path(file).parent
    assert _contents(imported) == _contents(SOURCES / package / package), (
        f"{imported} is another state: run scripts/setup"
    )


# ------------------------------------------------------------------ scripts
def _scripts() -> list[Path]:
    found = [p for p in (ROOT / "scripts").iterdir() if p.is_file() and p.name[0] not in "_."]
    return sorted(p for p in found if p.name != "lock_requirements")


@pytest.mark.parametrize("path", _scripts(), ids=lambda path: path.name)
def test_scripts_answer_help(path: Path) -> None:
    is_python = path.read_text().splitlines()[0].endswith("python3")
    command = [sys.executable, str(path)] if is_python else [str(path)]
    done = subprocess.run(
        [*command, "--help"],
        capture_output=True,
        text=True,
        timeout=60,
        # As scripts/_run_in_env sets it: no set-up in the middle of the tests.
        env={**os.environ, "HRI_PROJECT_ROOT": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.lower().lstrip().startswith("usage")


@pytest.mark.parametrize("path", _scripts(), ids=lambda path: path.name)
def test_scripts_are_executable_and_thin(path: Path) -> None:
    assert os.access(path, os.X_OK)
    assert len(path.read_text().splitlines()) <= 20


SHIMS = [p for p in (ROOT / "scripts").glob("*.py") if p.name != "_setup.py"]


@pytest.mark.parametrize(
    "path",
    [*SHIMS, SOURCES / "hri_prediction" / "hri_prediction" / "ros" / "this_machine.py"],
    ids=lambda p: p.name,
)
def test_shims_parse_in_any_python(path: Path) -> None:
    # _setup.py alone is only ever run by a Python that scripts/setup has checked.
    ast.parse(path.read_text(), feature_version=(3, 6))


# ------------------------------------------------------------------ style
@pytest.mark.parametrize("package", ORDER)
def test_modules_have_docstrings(package: str) -> None:
    missing = [
        _label(p) for p in _modules(package) if not ast.get_docstring(ast.parse(p.read_text()))
    ]
    assert missing == []


@pytest.mark.parametrize("package", ORDER)
def test_modules_are_short(package: str) -> None:
    for path in _modules(package):
        ceiling = CEILINGS.get(_label(path), CEILING)
        lines = len(path.read_text().splitlines())
        assert lines <= ceiling, f"{_label(path)} has {lines} lines"


DOCS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("path", DOCS, ids=lambda path: path.name)
def test_docs_name_files_that_exist(path: Path) -> None:
    text = path.read_text()
    links = re.findall(r"\]\((?!https?:)([^)#]+)", text)
    missing = [link for link in links if not (path.parent / link).exists()]
    named = re.findall(r"(?<![\w/])((?:scripts|examples|docs|requirements)/[\w./]*\w)", text)
    missing += [name for name in named if not (ROOT / name).exists()]
    modules = re.findall(r"(?<![\w/])(hri_\w+/[\w./]+\.(?:py|yaml|urdf|msg))", text)
    # Named from the workspace's source folder, or as imports name them.
    bases = (SOURCES, *(SOURCES / package for package in ORDER))
    missing += [name for name in modules if not any((base / name).exists() for base in bases)]
    assert missing == []


def test_nothing_names_the_place_where_it_was_written() -> None:
    # Put together, so that this file does not name them itself.
    words = ["../" + "shared", "/wo" + "rk/", "this " + "session"]
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if name == ".ci/run" or not path.is_file():
            continue
        text = path.read_bytes().decode(errors="replace")
        assert not [word for word in words if word in text], name
