"""The layouts that ship: places of each case in each position, as a JSON file.

They are found once (``scripts/find_layouts.py``) and kept, since the search is chaotic: rounding in its
beginning, as another processor has it, moves what it finds by centimetres.
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.values import read_json
from hri_prediction.ontology.cases import case_of, find_case
from hri_prediction.ontology.graph import check_feasible
from hri_sim.ontology.layouts import Layout, seats

FORMAT = "hri-dyad-layouts-1"
SHIPPED_LAYOUTS = Path(__file__).with_name("layouts.json")


def save_layouts(path: Path, layouts: Mapping[tuple[int, str], Layout], **more: Any) -> None:
    """Write layouts, by number of the case and position; ``more`` goes into the file and is not read."""
    cases: dict[str, dict[str, Any]] = {}
    for (number, position), one in sorted(layouts.items()):
        cases.setdefault(find_case(number).name, {})[position] = {
            "edges": sorted(one.edges),
            "spaces_m": one.spaces.tolist(),
            "bow_m": one.bow.tolist(),
        }
    new = path.with_suffix(".new")
    new.write_text(json.dumps({"format": FORMAT, **more, "cases": cases}, indent=1) + "\n")
    new.replace(path)


@functools.lru_cache(maxsize=4)
def load_layouts(path: Path = SHIPPED_LAYOUTS) -> Mapping[tuple[int, str], Layout]:
    """Read what :func:`save_layouts` wrote, by number of the case and position.

    Raises:
        DataError: when it is missing, damaged or something else.
    """
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise DataError(f"{path} is no file of layouts", expected=f"format {FORMAT}")
    try:
        return MappingProxyType(
            {
                (find_case(name).number, position): _layout(name, position, one)
                for name, own in content["cases"].items()
                for position, one in own.items()
            }
        )
    except (DataError, ConfigError) as error:
        raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
    except (ArithmeticError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(
            f"{path} is incomplete: {error!r:.200}", expected=f"a whole {FORMAT}"
        ) from error


@functools.cache
def layouts_hash() -> str:
    """Of the layouts that ship: what is kept of simulated dyads hangs on them."""
    return hashlib.sha256(SHIPPED_LAYOUTS.read_bytes()).hexdigest()


def _layout(name: str, position: str, content: Any) -> Layout:
    yaw, shoulders = seats(position)
    spaces, bow = (np.array(content[name], dtype=float) for name in ("spaces_m", "bow_m"))
    if spaces.shape != (2, 2, 3) or bow.shape != (2, 3):
        raise ValueError(f"spaces {spaces.shape}, bow {bow.shape} instead of (2, 2, 3), (2, 3)")
    if not (np.isfinite(spaces).all() and np.isfinite(bow).all()):
        raise ValueError("places that are not finite")
    edges = check_feasible((str(one), str(other)) for one, other in content["edges"])
    if case_of(edges).name != name:
        raise DataError(f"edges of {case_of(edges).name}", expected=f"those of {name}")
    for array in (yaw, shoulders, spaces, bow):
        array.setflags(write=False)  # all who ask share it
    return Layout(position, yaw, shoulders, spaces, bow, edges)
