"""Runs a function of the project's packages from any Python: finds or makes the environment first.

Standard library only, and old syntax on purpose: this runs in whatever ``python3`` is at hand.
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"


def environment():
    """Environment variables of the project's own programs."""
    env = dict(os.environ)
    prefixes = [str(VENV)]
    if env.get("ROS_DISTRO") == "jazzy" and env.get("AMENT_PREFIX_PATH"):
        # A full ROS 2 is sourced: its packages come through PYTHONPATH and the prefix path.
        prefixes += [p for p in env["AMENT_PREFIX_PATH"].split(os.pathsep) if p != str(VENV)]
    else:
        for name in ("PYTHONPATH", "LD_LIBRARY_PATH"):
            env.pop(name, None)
    for name in ("PYTHONHOME", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"):
        env.pop(name, None)
    env["AMENT_PREFIX_PATH"] = os.pathsep.join(prefixes)
    env["VIRTUAL_ENV"] = str(VENV)
    env.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    # Several processes share two cores: one thread each for linear algebra on small matrices.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        env.setdefault(name, "1")
    # Not the shared-memory transport: a process that is killed may leave it locked for all others.
    # Of effect for other ranges only: for LOCALHOST, rmw_fastrtps sets up both transports itself.
    env.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    env["HRI_PROJECT_ROOT"] = str(ROOT)
    return env


def main(module, function="main", setup=()):
    """Run ``module.function()`` in the project's environment and exit with its code.

    Args:
        module: Dotted name of a module.
        function: Function of it that returns an exit code.
        setup: Further arguments of scripts/setup.
    """
    if Path(sys.prefix).resolve() != VENV.resolve() or not os.environ.get("HRI_PROJECT_ROOT"):
        try:
            code = subprocess.call([str(ROOT / "scripts" / "setup")] + list(setup))
        except KeyboardInterrupt:  # setup has said so
            code = 130
        if code:
            sys.exit(code)
        python = str(VENV / "bin" / "python")
        os.execve(python, [python] + sys.argv, environment())
    import importlib

    try:
        sys.exit(getattr(importlib.import_module(module), function)())
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        from hri_prediction.errors import HriError

        if not isinstance(error, HriError):
            raise
        print("%s: error: %s" % (Path(sys.argv[0]).name, error), file=sys.stderr)
        sys.exit(1)
