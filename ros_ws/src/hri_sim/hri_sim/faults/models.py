"""Models that are cut, have wrong bits or other figures, or are of another kind than is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.adaptation.model_file import load_model, shipped_names, shipped_path
from hri_planner.dmp.model_file import load_dmp
from hri_planner.policy.model_file import find_any, load_any, shipped_dmps
from hri_planner.rnn.model_file import load_policy, shipped_policies
from hri_prediction.errors import HriError
from hri_prediction.hybrid import weight_file
from hri_prediction.hybrid.store import PERSON_FILE, PeopleStore, read_task
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.weight_process import WeightData
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.cost_file import load_costs
from hri_prediction.ontology.shipped import SHIPPED, SHIPPED_COSTS
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.prediction.library import TaskLibrary, TaskModel
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.storage import load_promp, save_promp
from hri_sim.faults.ended import ended
from hri_sim.launch.supervisor import find_executable
from hri_sim.reliability.damage import Damage, cut, digit_changed, flipped
from hri_sim.reliability.fault import FILES, Fault, Figure, Place, Trial

TOGETHER = 30
"""Files that are damaged in one repetition."""
OTHER_ERRORS = Figure(
    "other_errors", "ends otherwise than by being read or one clear error", limit=0.0
)
REFUSED = Figure("refused", "refused with one clear error")
ALTERED = Figure("altered", "loaded with other values", limit=0.0)
NODE_SAYS = Figure(
    "node", "node that is given a refused policy ends otherwise than with one line and an exit code",
    limit=0.0,
)  # fmt: skip
Load = Callable[[Path], Any]


@dataclass(frozen=True)
class Model:
    """A model on the disk.

    Attributes:
        path: Its file.
        load: What reads it.
    """

    path: Path
    load: Load


def load_person(path: Path) -> Any:
    """What a store of people has of one, by the file of their weights."""
    return PeopleStore(path.parent.parent).load(path.parent.name)


def shipped_models() -> list[Model]:
    """All that ship with the packages."""
    return [
        *(Model(find_any(name), load_dmp) for name in shipped_dmps()),
        *(Model(find_any(name), load_policy) for name in shipped_policies()),
        *(Model(shipped_path(name), load_model) for name in shipped_names()),
        Model(SHIPPED, InteractionClassifier.load),
        Model(SHIPPED_COSTS, load_costs),
        Model(Path(weight_file.__file__).with_name(weight_file.SHIPPED), load_process),
    ]


def learnt_models(folder: Path) -> list[Model]:
    """Of the kinds that people make with the scripts, one each: movements, libraries, a person."""
    folder.mkdir(parents=True, exist_ok=True)
    basis, size = PhaseBasis(4, 0.7), 24
    promp = ProMP(basis, np.linspace(0.0, 0.3, size), 0.01 * np.eye(size), 1e-4 * np.eye(6))
    save_promp(folder / "promp.npz", promp)
    task = TaskModel("cup", "right", promp, 0.9, 0.1, 6, 0.001)
    TaskLibrary((task,), 0.29, 0.26).save(folder / "library.npz")
    names, ones = ("hand_jerk", "joint_jerk"), np.ones((3, 1))
    store = PeopleStore(folder / "people")
    store.save("ann", [], WeightData(names, np.linspace(0.0, 1.0, 18).reshape(3, 6), ones, ones))
    return [
        Model(folder / "promp.npz", load_promp),
        Model(folder / "library.npz", TaskLibrary.load),
        Model(store.folder / "ann" / PERSON_FILE, load_person),
    ]


def damaged(
    seeds: Sequence[int], place: Place, damage: Damage, ending: str = ""
) -> Iterator[Trial]:
    """Models of each kind, damaged and loaded.

    Args:
        seeds: Of the repetitions.
        place: Where.
        damage: What is done to each.
        ending: Of the files that are damaged; empty: all.
    """
    models = [*shipped_models(), *learnt_models(place.folder / "learnt")]
    models = [model for model in models if model.path.name.endswith(ending)]
    contents = [model.path.read_bytes() for model in models]
    originals = [model.load(model.path) for model in models]
    for seed in seeds:
        rng = np.random.default_rng(seed)
        counts = dict.fromkeys(("refused", "other_errors", "altered"), 0.0)
        given = False
        for index in range(TOGETHER):
            kind = index % len(models)
            # In two folders, as a person has one in a store.
            path = place.folder / "damaged" / "ann" / models[kind].path.name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(damage(rng, contents[kind]))
            try:
                loaded = models[kind].load(path)
            except HriError:
                counts["refused"] += 1
                if not given and models[kind].load in (load_dmp, load_policy):
                    given = True
                    counts["node"] = float(not _node_refuses(path))
            except Exception:  # whatever else comes is what is looked for
                counts["other_errors"] += 1
            else:
                counts["altered"] += not same(loaded, originals[kind])
            path.unlink()
        yield Trial(seed, counts)


def _node_refuses(path: Path) -> bool:
    """Whether the policy node ends with one line that names a file, and an exit code that is not 0."""
    node = find_executable("hri_planner", "policy")
    done = ended([node, "--ros-args", "-p", f"policy:={path}"])
    if done is None:
        return False
    lines = (done.stdout + done.stderr).strip().splitlines()
    return done.returncode != 0 and len(lines) == 1 and path.name in lines[0]


def same(one: Any, other: Any) -> bool:
    """Whether two things hold the same values; functions hold none."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if hasattr(one, "__dict__"):
        return same(vars(one), vars(other))
    return callable(one) or bool(one == other)


def readers() -> list[tuple[str, Load, frozenset[Load]]]:
    """All that read models: the file that each asks for, itself, and whose models it takes."""
    own: list[tuple[str, Load]] = [
        ("policy.npz", load_dmp),
        ("policy.npz", load_policy),
        ("model.npz", load_model),
        ("cases.npz", InteractionClassifier.load),
        ("costs.json", load_costs),
        ("weights.json", load_process),
        ("promp.npz", load_promp),
        ("library.npz", TaskLibrary.load),
        (PERSON_FILE, load_person),
        ("segments.npz", SegmentTable.load),
        ("right_cup_from_rest.npz", read_task),
    ]
    return [
        *((name, load, frozenset({load})) for name, load in own),
        ("policy.npz", load_any, frozenset({load_dmp, load_policy})),
    ]


def wrong_kinds(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Each model given to each reader of models of another kind, under the name that it asks for."""
    models = [*shipped_models(), *learnt_models(place.folder / "learnt")]
    for seed in seeds:
        counts = dict.fromkeys(("other_errors", "taken", "unclear", "pairs"), 0.0)
        said = ""
        for model in models:
            content = model.path.read_bytes()
            for name, load, takes in readers():
                if model.load in takes:
                    continue
                path = place.folder / "given" / "ann" / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
                counts["pairs"] += 1
                try:
                    load(path)
                except HriError as error:
                    clear = path.name in error.problem and bool(error.expected)
                    counts["unclear"] += not clear
                    said = str(error).replace(f"{path.parent}/", "")
                except Exception:  # whatever else comes is what is looked for
                    counts["other_errors"] += 1
                else:
                    counts["taken"] += 1
                path.unlink()
        yield Trial(seed, counts, said)


def _damaged(name: str, title: str, injected: str, damage: Damage, ending: str = "") -> Fault:
    which = "those in JSON" if ending else "all that ship, and one of each kind that is learnt"
    return Fault(
        name,
        title,
        f"{injected}; {TOGETHER} files a repetition: {which}",
        "refused with one clear error (of a node: exit code not 0), or loaded with the same values",
        FILES,
        (OTHER_ERRORS, ALTERED, REFUSED) if ending else (OTHER_ERRORS, ALTERED, NODE_SAYS, REFUSED),
        partial(damaged, damage=damage, ending=ending),
        count=40,
    )


MODELS = (
    _damaged("truncated_models", "truncated models", "the file ends anywhere", cut),
    _damaged("flipped_models", "bit-flipped models", "1 to 8 bits anywhere are wrong", flipped),
    _damaged(
        "altered_models",
        "altered models",
        "one digit is another, anywhere in the file",
        digit_changed,
        ".json",
    ),
    Fault(
        "wrong_models",
        "models of the wrong kind",
        "each model that ships, and one of each kind that is learnt, is given to each reader of others",
        "one clear error that names the file and what was expected",
        FILES,
        (
            Figure("other_errors", "ends otherwise than by one clear error", limit=0.0),
            Figure("taken", "loaded", limit=0.0),
            Figure("unclear", "errors without the file or what was expected", limit=0.0),
            Figure("pairs", "models and readers"),
        ),
        wrong_kinds,
        count=1,  # nothing is drawn
    ),
)
"""Faults of models."""
