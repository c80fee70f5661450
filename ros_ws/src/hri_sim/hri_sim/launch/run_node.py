"""Command line of ``scripts/run_node.py``: one node in the foreground, as by ``ros2 run``."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from hri_sim.launch.supervisor import find_executable

PACKAGES = ("hri_prediction", "hri_planner", "hri_sim")


def installed_nodes() -> list[tuple[str, str]]:
    """Package and executable of every node of this project that is installed."""
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    found: dict[tuple[str, str], None] = {}
    for prefix in prefixes or [sys.prefix]:
        for package in PACKAGES:
            for path in sorted((Path(prefix) / "lib" / package).glob("*")):
                if path.is_file() and os.access(path, os.X_OK):
                    found[package, path.name] = None
    return list(found)


def _parser() -> argparse.ArgumentParser:
    nodes = "\n".join(f"  {package} {name}" for package, name in installed_nodes())
    parser = argparse.ArgumentParser(
        prog="run_node.py",
        description="Run one node in the foreground; Ctrl-C ends it.",
        epilog=f"nodes:\n{nodes}\n\nexample:\n"
        "  run_node.py hri_prediction predictor --ros-args -p library:=library.npz",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("package", help="ROS package, such as hri_sim")
    parser.add_argument("executable", help="node of it, such as simulator")
    parser.add_argument(
        "arguments", nargs=argparse.REMAINDER, help="for the node: --ros-args -p NAME:=VALUE …"
    )
    return parser


def main() -> int:
    """Replace this process by the node's.

    Raises:
        GraphError: when the executable is not installed.
    """
    options = _parser().parse_args()
    path = str(find_executable(options.package, options.executable))
    os.execv(path, [path, *options.arguments])
