"""Numba, set up once for the whole project.

numba keys its on-disk cache by the file of the compiled function alone, so a kernel whose *callee*
in another file changed would be served stale, and so would one with a constant of another file. Here the
cache folder is named after a hash of all sources of the project that modules with kernels import, and
these import: a change in any of them means a fresh cache.

Import ``njit`` from this module, never from numba.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import hashlib
import importlib.util
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

_PACKAGES = ("hri_prediction", "hri_planner", "hri_sim")
_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+([^\n]+))",
    re.MULTILINE,
)
_WORD, _DOTTED = re.compile(rb"\w+"), re.compile(rb"[\w.]+")
UNUSED_S = 30 * 24 * 3600.0
"""A cache folder that no process has used for so long may go [s]."""


def processor() -> str:
    """The kind of processor that kernels are compiled for; another one may round otherwise."""
    from numba.core.registry import cpu_target

    system, name, features = cpu_target.target_context.codegen().magic_tuple()
    # The same name may stand for other instructions: a virtual machine can hide some.
    return f"{system} {name} {hashlib.sha256(features.encode()).hexdigest()[:8]}"


def _sources() -> dict[str, bytes]:
    """Sources of all installed packages of this project, by module."""
    found = {}
    for name in _PACKAGES:
        spec = importlib.util.find_spec(name)
        if spec is None or not spec.submodule_search_locations:
            continue
        root = Path(next(iter(spec.submodule_search_locations)))
        for path in root.rglob("*.py"):
            parts = (name, *path.relative_to(root).with_suffix("").parts)
            found[".".join(parts).removesuffix(".__init__")] = path.read_bytes()
    return found


def _imported(source: bytes) -> Iterator[str]:
    """What may be modules that a source imports; with words, as to parse it takes ten times as long."""
    for module, names, modules in _IMPORT.findall(source):
        whole = module.decode()
        yield whole
        yield from (f"{whole}.{name.decode()}" for name in _WORD.findall(names))
        yield from (name.decode() for name in _DOTTED.findall(modules))


def kernel_sources(sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """Those of some sources, by module, on which a compiled kernel may depend; in alphabetical order."""
    found = {name for name, source in sources.items() if b"njit" in source}
    waiting = list(found)
    while waiting:
        new = {name for name in _imported(sources[waiting.pop()]) if name in sources} - found
        found |= new
        waiting += new
    return {name: sources[name] for name in sorted(found)}


def _hash(sources: Mapping[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name, source in sorted(sources.items()):
        digest.update(name.encode())
        digest.update(source)
    return digest.hexdigest()[:16]


def source_hash() -> str:
    """Hash (16 hex digits) of the Python sources of all installed packages of this project."""
    return _hash(_sources())


def cache_folder() -> Path:
    """Cache folder of the present kernels; a ``NUMBA_CACHE_DIR`` that is set becomes its parent."""
    name = f"hri-{_hash(kernel_sources(_sources()))}"
    if os.environ.get("NUMBA_BOUNDSCHECK", "0") not in ("", "0"):
        name += "-checked"  # kernels that check their indices are other kernels
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        # Children inherit the variable from us: then it names the folder already.
        parent = Path(given)
        return (parent.parent if parent.name.startswith("hri-") else parent) / name
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hri_stack" / name


def remove_unused_caches() -> None:
    """Remove the cache folders of other kernels that nobody has used for a month."""
    present = cache_folder()
    for folder in present.parent.glob("hri-" + "[0-9a-f]" * 16 + "*"):
        with contextlib.suppress(OSError):  # gone meanwhile, or somebody else's
            if folder != present and time.time() - folder.stat().st_mtime > UNUSED_S:
                shutil.rmtree(folder)


os.environ["NUMBA_CACHE_DIR"] = str(cache_folder())
with contextlib.suppress(OSError):
    os.utime(os.environ["NUMBA_CACHE_DIR"])  # says that it is in use

import numba  # noqa: E402  (must follow the choice of the cache folder)
from numba.core.caching import IndexDataCacheFile  # noqa: E402


def _in_turn(save: Callable[[Any, Any, Any], None]) -> Callable[[Any, Any, Any], None]:
    """Saving that is done by one process at a time.

    numba looks for a free file name and writes the index, then the file: of two processes that compile one
    kernel for different types, one would find the other's machine code under its own types.
    """

    @functools.wraps(save)
    def saved(self: Any, key: Any, data: Any) -> None:
        with (Path(self._cache_path) / "lock").open("a") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            save(self, key, data)

    return saved


IndexDataCacheFile.save = _in_turn(IndexDataCacheFile.save)

_KERNELS: list[Any] = []


def njit(function: Any = None, **options: Any) -> Any:
    """``numba.njit`` that caches on disk, releases the GIL and keeps IEEE semantics."""
    if function is None:
        return functools.partial(njit, **options)
    options = {"cache": True, "nogil": True, "error_model": "numpy", **options}
    kernel = numba.njit(**options)(function)
    _KERNELS.append(kernel)
    return kernel


def has_cache() -> bool:
    """Whether a kernel of these sources has been compiled into the cache, which other checkouts share."""
    folders = {kernel._cache.cache_path for kernel in _KERNELS}
    return any(any(Path(folder).glob("*.nbi")) for folder in folders)


def compiled_variants() -> dict[str, int]:
    """How many signatures of each kernel are compiled in this process, by its full name.

    A number that grows while a node runs says that a kernel met types that the warm-up did not know (a
    read-only array, another memory layout): the node stood still for a second or more meanwhile.
    """
    return {
        f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}": len(kernel.signatures)
        for kernel in _KERNELS
    }
