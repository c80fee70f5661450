"""Sessions that are not whole are found, and said to be so."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sessions import known

from hri_planner.dmp.model_file import read_dmp, save_dmp
from hri_planner.pibb.storage import (
    FORMAT,
    POLICY,
    SESSION,
    TRIALS,
    load_session,
)
from hri_prediction.errors import DataError
from hri_prediction.promp.storage import read_npz, write_npz


def test_where_there_is_no_session(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"no session in .*expected a folder with session\.npz"):
        load_session(tmp_path)
    with pytest.raises(DataError, match="no session in"):
        load_session(tmp_path / "nowhere")


def test_foreign_files(saved: Path) -> None:
    policy, _ = read_dmp(saved / POLICY)
    path = saved / SESSION
    save_dmp(path, policy, {})
    with pytest.raises(DataError, match=r"hri-dmp-1.*hri-trials-1"):
        load_session(saved)
    for content in (b"", b"PK\x03\x04", b"number,update\n", (saved / TRIALS).read_bytes()):
        path.write_bytes(content)
        with pytest.raises(DataError, match=r"cannot read .*session\.npz"):
            load_session(saved)
    path.unlink()
    path.mkdir()
    with pytest.raises(DataError, match="cannot read"):
        load_session(saved)


@pytest.mark.filterwarnings("ignore")
def test_damage_is_found_whatever_it_is(saved: Path) -> None:
    path = saved / SESSION
    whole, wanted = path.read_bytes(), known(load_session(saved)[0])
    rng = np.random.default_rng(11)
    said = []
    for turn in range(250):
        damaged = bytearray(whole)
        if turn % 5 == 0:
            del damaged[int(rng.integers(len(whole))) :]
        elif turn % 5 == 1:
            at = int(rng.integers(len(whole)))
            damaged[at : at + int(rng.integers(1, 400))] = rng.bytes(int(rng.integers(0, 400)))
        else:
            for at in rng.integers(len(whole), size=int(rng.integers(1, 4))):
                damaged[at] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            found = known(load_session(saved)[0])
        except DataError as error:
            said.append(str(error))
        else:  # dates and the like, which mean nothing
            assert found == wanted
    assert len(said) > 200
    assert all(str(path) in text and "\n" not in text for text in said)


def no(header: dict[str, Any], arrays: dict[str, Any], name: str) -> None:
    header.pop(name, None)
    arrays.pop(name, None)


CHANGES: dict[str, Callable[[dict[str, Any], dict[str, Any]], object]] = {
    "update = None": lambda header, arrays: no(header, arrays, "update"),
    "no array weights_1": lambda header, arrays: no(header, arrays, "weights_1"),
    "no array late_1": lambda header, arrays: no(header, arrays, "late_1"),
    "made_up', late": lambda header, arrays: no(header, arrays, "late_0"),
    "made_up', late; ": lambda header, arrays: arrays.update(late_2=np.zeros((3, 4))),
    "no array changes_0": lambda header, arrays: no(header, arrays, "changes_0"),
    "no array start": lambda header, arrays: arrays.update(start=np.array(["a", "b", "c"])),
    "start has shape": lambda header, arrays: arrays.update(start=np.zeros(4)),
    "posture has shape": lambda header, arrays: arrays.update(posture=np.full(7, np.nan)),
    "update = True": lambda header, arrays: header.update(update=True),
    "update = '1'": lambda header, arrays: header.update(update="1"),
    "made_up', update": lambda header, arrays: header.update(update=4),
    "changed, costs, late, units": lambda header, arrays: header.update(update=-1),
    "made_up', order": lambda header, arrays: header.update(order=[]),
    "order, costs": lambda header, arrays: header.update(
        order=[["b", 4]], costs={"b": [[-1, 0.0]]}
    ),
    "order = 'b'": lambda header, arrays: header.update(order="b"),
    "ValueError": lambda header, arrays: header.update(order=[["b"]]),
    "made_up', costs": lambda header, arrays: header.update(costs={"b": [[0, float("nan")]]}),
    "made_up', units": lambda header, arrays: header["units"]["b"].update(task=0.0),
    "KeyError: 'task'": lambda header, arrays: header["units"]["b"].pop("task"),
    "KeyError: 'guess'": lambda header, arrays: header["results"][3].pop("guess"),
    "made_up', results": lambda header, arrays: header["results"].pop(3),
    "costs of the trial: task": lambda header, arrays: header["results"][3].update(task=-1.0),
    "TypeError": lambda header, arrays: header.update(results=[1]),
    "generator": lambda header, arrays: header["rng"].update(bit_generator="MT19937"),
    "generator.* large": lambda header, arrays: header["rng"]["state"].update(state=2**200),
    "generator: ": lambda header, arrays: header["rng"].pop("state"),
    "no person or no seed": lambda header, arrays: no(header, arrays, "person"),
    "no goals|no name, goals": lambda header, arrays: no(header["experiment"], arrays, "goals"),
    "rollouts": lambda header, arrays: header["experiment"]["improvement"].update(rollouts=-1),
    "cannot be used": lambda header, arrays: header["experiment"].update(improvement=5),
    "duration 90": lambda header, arrays: header.update(duration=90.0),
    "goals at least|goals \\[\\]": lambda header, arrays: header.update(goals=[]),
    "made_up', goals": lambda header, arrays: header.update(goals=["other", *header["goals"][1:]]),
}


@pytest.mark.parametrize("match", CHANGES)
def test_files_that_do_not_hold_together_are_refused(saved: Path, match: str) -> None:
    arrays, header = read_npz(saved / SESSION, FORMAT)
    CHANGES[match](header, arrays)
    json.dumps(header)
    write_npz(saved / SESSION, arrays, header)
    with pytest.raises(DataError, match=match) as caught:
        load_session(saved)
    assert str(saved / SESSION) in str(caught.value)
