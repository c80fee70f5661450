"""Which sources a compiled kernel depends on."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from hri_prediction import compiled
from hri_prediction.compiled import cache_folder, kernel_sources

KERNEL = b"from hri.compiled import njit\nfrom hri.b import (\n    LIMIT,\n)\n@njit\ndef f(): ..."


def test_modules_with_kernels_and_all_that_they_import() -> None:
    sources = {
        "hri.a": KERNEL,
        "hri.b": b"import hri.c\nLIMIT = hri.c.MOST",
        "hri.c": b"def late():\n    from hri.d import MOST\nMOST = 3",
        "hri.d": b"MOST = 4",
        "hri.compiled": b"import numba",
        "hri.e": b"from hri import a  # uses a kernel, and is none",
        "hri.f": b"",
    }
    assert list(kernel_sources(sources)) == ["hri.a", "hri.b", "hri.c", "hri.compiled", "hri.d"]


def parsed(source: bytes) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports are not seen"
            found |= {f"{node.module}", *(f"{node.module}.{each.name}" for each in node.names)}
    return found


def test_imports_are_found_as_a_parser_finds_them() -> None:
    sources = compiled._sources()
    assert len(sources) > 500
    for name, source in sources.items():
        missing = (parsed(source) & sources.keys()) - set(compiled._imported(source))
        assert not missing, f"{name} imports {missing}"


@pytest.mark.parametrize("other", [True, False])
def test_a_change_that_no_kernel_sees_keeps_the_cache(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, other: bool
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    before = cache_folder()
    sources = compiled._sources()
    changed = "hri_sim.launch.telling" if other else "hri_planner.separation.config"
    assert changed in sources
    sources[changed] += b"\nMORE = 1"
    monkeypatch.setattr(compiled, "_sources", lambda: sources)
    assert (cache_folder() == before) == other
