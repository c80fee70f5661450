"""The derived graph as machine code: compiled once for a convention, kept, and called from kernels.

The first use on a machine takes some seconds for a convention. What is kept is
named after all that decides about it: the derivation's source, CasADi, the compiler and the processor.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import os
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from numba import types
from numba.extending import intrinsic

from hri_prediction.compiled import UNUSED_S, cache_folder, processor
from hri_prediction.errors import HriError
from hri_prediction.motor_control.convention import Convention, convention_of

_FLAGS = ("-O2", "-march=native", "-fno-math-errno", "-shared", "-fPIC")
_SOURCES = ("convention.py", "arm_model.py", "derivation.py", "compiled_graph.py")
_WRAPPERS = """
void hri_call_values(const double* z, const double* p, const double* unused, double* out) {
  const double* arg[2] = {z, p};
  double* res[1] = {out};
  hri_values(arg, res, 0, 0, 0);
}
void hri_call_jacobian(const double* z, const double* p, const double* unused, double* out) {
  const double* arg[2] = {z, p};
  double* res[1] = {out};
  hri_jacobian(arg, res, 0, 0, 0);
}
void hri_call_second(const double* z, const double* p, const double* l, double* out) {
  const double* arg[3] = {z, p, l};
  double* res[2] = {out, out + 120};
  hri_second(arg, res, 0, 0, 0);
}
"""


@dataclass(frozen=True)
class CompiledGraph:
    """Addresses of the compiled functions, to be called by `call`.

    Attributes:
        values: y (10,).
        jacobian: dy/dz, (12, 10) in C's order: row i are the derivatives by z_i.
        second: The same, and behind it the sum of the Hessians (12, 12), upper triangle in C's order.
        library: Keeps the code in memory.
    """

    values: int
    jacobian: int
    second: int
    library: Any


@intrinsic
def call(typing_context: Any, address: Any, z: Any, p: Any, multipliers: Any, out: Any) -> Any:
    """Call a compiled function: ``call(address, z.ctypes, p.ctypes, multipliers.ctypes, out.ctypes)``.

    An address is a number, and so kernels that call it can be kept on the disk; numba keeps none that
    know a function of ctypes.
    """
    signature = types.void(types.int64, z, p, multipliers, out)

    def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
        from llvmlite import ir

        pointer = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * 4).as_pointer()
        function = builder.inttoptr(values[0], kind)
        arguments = [
            builder.bitcast(context.cast(builder, value, given, types.voidptr), pointer)
            for value, given in zip(values[1:], (z, p, multipliers, out), strict=True)
        ]
        builder.call(function, arguments)
        return context.get_dummy_value()

    return signature, generate


def _name(convention: Convention) -> str:
    digest = hashlib.sha256(repr(convention).encode())
    for source in _SOURCES:
        digest.update((Path(__file__).parent / source).read_bytes())
    digest.update(repr((version("casadi"), _compiler(), processor(), _FLAGS)).encode())
    return f"arm_{convention.name}_{digest.hexdigest()[:16]}.so"


@functools.cache
def _compiler() -> str:
    """Path and version of the C compiler.

    Raises:
        HriError: there is none.
    """
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        path = shutil.which(name) if name else None
        if path:
            said = subprocess.run([path, "--version"], capture_output=True, text=True, check=False)
            return f"{path} {said.stdout.splitlines()[0] if said.stdout else ''}"
    raise HriError(
        "no C compiler was found",
        hint="run: sudo apt-get install build-essential (the model of the arm is compiled once)",
    )


def library_path(convention: str) -> Path:
    """Where the compiled code of a convention is kept; it need not be there yet.

    Raises:
        ConfigError: there is no such convention.
    """
    return cache_folder().parent / _name(convention_of(convention))


def is_prepared(convention: str) -> bool:
    """Whether the first use of a convention will not have to compile."""
    return library_path(convention).exists()


@functools.cache
def compiled_graph(convention: str) -> CompiledGraph:
    """The compiled functions of a convention; derived and compiled if nobody has yet.

    Raises:
        ConfigError: there is no such convention.
        HriError: the code cannot be compiled or kept, and why.
    """
    path = library_path(convention)
    if not path.exists():
        build(convention, path)
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise HriError(
            f"cannot load {path}: {error}", hint="remove it; it is compiled again"
        ) from error
    with contextlib.suppress(OSError):
        os.utime(path)  # says that it is in use
    addresses = [
        int(ctypes.cast(getattr(library, f"hri_call_{name}"), ctypes.c_void_p).value or 0)
        for name in ("values", "jacobian", "second")
    ]
    values, jacobian, second = addresses
    return CompiledGraph(values, jacobian, second, library)


def _remove_unused(folder: Path) -> None:
    """Remove compiled code of other states that nobody has used for a month."""
    for path in folder.glob("arm_*.so"):
        with contextlib.suppress(OSError):  # gone meanwhile, or somebody else's
            if time.time() - path.stat().st_mtime > UNUSED_S:
                path.unlink()


def build(convention: str, path: Path) -> None:
    """Derive, compile, and put the result in place in one step, so that others never see half of it.

    Args:
        convention: Its name.
        path: Where the compiled code is put.

    Raises:
        ConfigError: there is no such convention.
        HriError: the code cannot be compiled or kept, and why.
    """
    import casadi  # takes half a second, and is needed here alone

    from hri_prediction.motor_control.derivation import functions

    compiler = _compiler().split(" ")[0]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix="arm_") as folder:
            generator = casadi.CodeGenerator("arm.c", {"with_header": False})
            for function in functions(convention_of(convention)):
                generator.add(function)
            source = Path(generator.generate(folder + os.sep))
            source.write_text(source.read_text() + _WRAPPERS)
            made = Path(folder) / "arm.so"
            done = subprocess.run(
                [compiler, *_FLAGS, "-o", str(made), str(source), "-lm"],
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                first = (done.stderr.strip().splitlines() or ["no words"])[0]
                raise HriError(f"{compiler} failed on the model of the arm: {first}")
            os.replace(made, path)
        _remove_unused(path.parent)
    except OSError as error:
        raise HriError(
            f"cannot keep compiled code in {path.parent}: {error.strerror or error}",
            hint="set XDG_CACHE_HOME to a folder that can be written",
        ) from error
