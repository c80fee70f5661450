"""Which of this project's sources a module depends on: what it imports, and what that imports.

Results that took hours are kept as long as nothing changes that they depend on; a report that is worded
otherwise, or a node, is no such thing.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("hri_prediction", "hri_planner", "hri_sim")
MODELS = (".urdf", ".xml")
"""Files beside the code that results depend on; settings are told apart by their values."""


def dependencies(module: str) -> dict[str, Path]:
    """The modules of this project that a module imports, directly or not, itself included, by name.

    Imports within functions count, too; so do the packages that modules are in.

    Args:
        module: Full name, as ``hri_sim.benchmark.episode``.

    Raises:
        ModuleNotFoundError: when there is no such module.
    """
    found: dict[str, Path] = {}
    waiting = [module]
    if _source(module) is None:
        raise ModuleNotFoundError(module)
    while waiting:
        name = waiting.pop()
        path = None if name in found else _source(name)
        if path is None:
            continue
        found[name] = path
        if "." in name:
            waiting.append(name.rpartition(".")[0])
        waiting += _imported(path)
    return dict(sorted(found.items()))


@functools.cache
def dependency_hash(module: str) -> str:
    """Hash (16 hex digits) of the sources that a module depends on, and of all models of robots."""
    found = dependencies(module)
    digest = hashlib.sha256()
    for name, path in found.items():
        digest.update(name.encode())
        digest.update(path.read_bytes())
    for package in sorted({name.partition(".")[0] for name in found}):
        source = _source(package)
        assert source is not None
        root = source.parent
        for path in sorted(path for path in root.rglob("*") if path.suffix in MODELS):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _source(name: str) -> Path | None:
    """File of a module of this project; none of other things."""
    if name.partition(".")[0] not in PACKAGES:
        return None
    try:
        spec = importlib.util.find_spec(name)
    except ModuleNotFoundError:  # the name of something in a module
        return None
    return None if spec is None or spec.origin is None else Path(spec.origin)


def _imported(path: Path) -> Iterator[str]:
    """Full names that a file imports; those of things in modules are among them."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{each.name}" for each in node.names)
