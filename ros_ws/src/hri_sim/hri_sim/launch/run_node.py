"""Command line of ``scripts/run_node.py``: one node in the foreground, as by ``ros2 run``."""

from __future__ import annotations

import argparse
import ast
import dataclasses
import importlib.util
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


def describe(package: str, name: str) -> str:
    """What a node does, in one line: the first line of its module, which is read but not run."""
    parent = importlib.util.find_spec(package)
    for folder in parent.submodule_search_locations or () if parent else ():
        path = Path(folder) / "nodes" / f"{name}_node.py"
        if path.is_file():
            text = ast.get_docstring(ast.parse(path.read_text())) or ""
            return text.partition("\n")[0].partition(": ")[2].rstrip(".")
    return ""


def node_list() -> str:
    """All nodes, one a line, with what they do."""
    return "\n".join(
        f"  {package + ' ' + name:<26} {describe(package, name)}".rstrip()
        for package, name in installed_nodes()
    )


def parameter_list(name: str) -> str:
    """All parameters of a node with defaults, units and ranges, as ``--ros-args -p`` takes them."""
    # Here, as it imports every node's configuration, which nobody waits for who starts a node.
    from hri_sim.launch.parameters import CONFIGURATIONS, EVERY_NODE

    lines = []
    for prefix, defaults in (*CONFIGURATIONS[name], EVERY_NODE):
        for field in dataclasses.fields(defaults):
            if "doc" not in field.metadata:
                continue
            about = field.metadata
            value = getattr(defaults, field.name)
            unit = f" {about['unit']}" if about["unit"] else ""
            allowed = ""
            if about["choices"]:
                allowed = ", one of " + ", ".join(about["choices"])
            elif about["low"] is not None or about["high"] is not None:
                ends = (
                    f"{word} {about[end]:g}"
                    for word, end in (("from", "low"), ("to", "high"))
                    if about[end] is not None
                )
                allowed = ", " + " ".join(ends)
            shown = list(value) if isinstance(value, tuple) else value
            told = repr(shown) if isinstance(shown, (str, list)) else str(shown).lower()
            lines.append(f"  {prefix}{field.name}: {told}{unit}{allowed}")
            lines.append(f"      {about['doc'][0].upper()}{about['doc'][1:]}")
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="run_node.py",
        description="Run one node in the foreground; Ctrl-C ends it. Without arguments: list the nodes.",
        epilog=f"nodes:\n{node_list()}\n\nexamples:\n"
        "  run_node.py hri_prediction predictor --ros-args -p library:=library.npz\n"
        "  run_node.py hri_prediction predictor --help        all its parameters",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("package", nargs="?", help="ROS package, such as hri_sim")
    parser.add_argument("executable", nargs="?", help="node of it, such as simulator")
    parser.add_argument(
        "arguments", nargs=argparse.REMAINDER, help="for the node: --ros-args -p NAME:=VALUE …"
    )
    return parser


def main(argv: list[str] | None = None) -> int:
    """Replace this process by the node's; without arguments, list the nodes.

    Raises:
        GraphError: when the executable is not installed.
    """
    parser = _parser()
    options = parser.parse_args(argv)
    if options.package is None:
        print(f"nodes (run_node.py PACKAGE NODE):\n{node_list()}")
        return 0
    known = [name for package, name in installed_nodes() if package == options.package]
    if options.package not in PACKAGES:
        text = f"there is no package {options.package!r} here; run_node.py alone lists the nodes"
        parser.error(text)
    if options.executable is None:
        parser.error(f"which node of {options.package}? It has {', '.join(known) or 'none'}")
    if known and options.executable not in known:
        text = f"{options.package} has no node {options.executable!r}; it has {', '.join(known)}"
        parser.error(text)
    if options.arguments and options.arguments[0] in ("-h", "--help"):
        what = describe(options.package, options.executable)
        print(f"{options.package} {options.executable}: {what}")
        print("parameters (--ros-args -p NAME:=VALUE), with their defaults:")
        print(parameter_list(options.executable))
        return 0
    if options.arguments and options.arguments[0] != "--ros-args":
        text = f"{options.arguments[0]!r} would be ignored; parameters come after --ros-args: "
        parser.error(text + "--ros-args -p NAME:=VALUE")
    path = str(find_executable(options.package, options.executable))
    os.execv(path, [path, *options.arguments])
