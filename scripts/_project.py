"""Runs a function of the project's packages from any Python: finds or makes the environment first.

Standard library only, and old syntax on purpose: this runs in whatever ``python3`` is at hand.
"""

import fcntl
import json
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
DISCOVERY = ROOT.joinpath(
    "ros_ws", "src", "hri_prediction", "hri_prediction", "ros", "this_machine.py"
)


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
    # Several processes share two cores: one thread each for linear algebra on small matrices.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        env.setdefault(name, "1")
    env.update(runpy.run_path(str(DISCOVERY))["stay_on_this_machine"](env))
    env["HRI_PROJECT_ROOT"] = str(ROOT)
    return env


def installed():
    """Whether a set-up has been completed here, be it an older one."""
    try:
        stamps = json.loads((VENV / ".setup.json").read_text())
    except (OSError, ValueError):
        return False
    return isinstance(stamps, dict) and "hri_sim" in stamps


def help_asked():
    """Whether the script was asked for its help, and not the node that it is to start."""
    own = sys.argv[1:]
    for end in ("--", "--ros-args"):
        own = own[: own.index(end)] if end in own else own
    return "--help" in own or "-h" in own


def show_short_help():
    """What can be said without the libraries: nobody waits minutes for a set-up to read a help."""
    about = (sys.modules["__main__"].__doc__ or "").strip()
    about = about.replace("; see --help.", ".")
    print("usage: %s [OPTIONS] [ARGUMENTS]\n\n%s\n" % (Path(sys.argv[0]).name, about))
    print(
        "Nothing is set up here yet. ./scripts/setup does that, which takes some minutes the first\n"
        "time; --help then shows all options and arguments."
    )


def _end_as_asked(number, frame):
    """SIGTERM ends as Ctrl-C does: by an exception, so that everything is cleaned up on the way."""
    signal.signal(number, signal.SIG_IGN)  # once is enough: the cleaning is not to be broken off
    sys.exit(128 + number)


def _set_up(arguments):
    """Run scripts/setup, which does not outlive this process; its exit code."""
    process = subprocess.Popen([str(ROOT / "scripts" / "setup")] + list(arguments))
    try:
        return process.wait()
    except KeyboardInterrupt:  # set-up, which got it too, says so
        process.wait()
        return 130
    except SystemExit:
        process.terminate()
        process.wait()
        raise


def keep_installed():
    """Hold the installed packages for as long as this process and what it is replaced by run.

    Set-up takes the same lock for itself alone before it replaces anything. One that does so at this
    moment is waited for, and leaves complete packages.
    """
    lock = os.open(str(ROOT / ".run.lock"), os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        print("waiting for a set-up of this checkout to end", file=sys.stderr)
        fcntl.flock(lock, fcntl.LOCK_SH)
    os.set_inheritable(lock, True)


def main(module, function="main", setup=(), graph=False):
    """Run ``module.function()`` in the project's environment and exit with its code.

    Args:
        module: Dotted name of a module.
        function: Function of it that returns an exit code.
        setup: Further arguments of scripts/setup.
        graph: Whether it runs nodes, under which set-up must not replace the packages. Anything else
            may run beside such a graph: what is installed will do for it then.
    """
    signal.signal(signal.SIGTERM, _end_as_asked)
    if Path(sys.prefix).resolve() != VENV.resolve() or not os.environ.get("HRI_PROJECT_ROOT"):
        if help_asked():
            if not installed():
                show_short_help()
                sys.exit(0)
            setup = ()  # a help needs nothing on top
        code = _set_up(setup if graph else list(setup) + ["--no-wait"])
        if code:
            sys.exit(code)
        if graph:
            keep_installed()
        python = str(VENV / "bin" / "python")
        os.execve(python, [python] + sys.argv, environment())
    import atexit
    import gc
    import importlib

    # Half a second: at the end the collector would look through all modules for what is about to go.
    atexit.register(gc.freeze)
    try:
        sys.exit(getattr(importlib.import_module(module), function)())
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        from hri_prediction.errors import HriError

        said = str(error)
        # A disk that is full, a file that is gone.
        if isinstance(error, OSError) and error.strerror:
            said = "%s: %s" % (error.filename, error.strerror) if error.filename else error.strerror
        elif not isinstance(error, HriError):
            raise
        print("%s: error: %s" % (Path(sys.argv[0]).name, said), file=sys.stderr)
        sys.exit(1)
