"""Work given away: what a cluster is asked before it is trusted, and results however they come."""

import importlib.util

import pytest

from hri_prediction.errors import ConfigError
from hri_prediction.results.workers import check_workers
from hri_sim.benchmark import workers
from hri_sim.benchmark.workers import do_all


class Cluster:
    """Answers like a client whose workers differ from this process in what is given."""

    def __init__(self, **found):
        self.found = found

    def run(self, function):
        ours = function()
        return {name: {**ours, **changes} for name, changes in self.found.items()}


def test_workers_that_compute_alike_are_taken():
    check_workers(Cluster(a={}, b={}), "tcp://here", workers._computed_with)


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ({}, "no workers"),
        ({"a": {}, "b": {"sources": "0123"}}, "worker b has sources 0123"),
        ({"a": {"numba": "0.1"}}, "worker a has numba 0.1"),
        ({"a": {"processor": "z80"}}, "worker a has processor z80"),
    ],
)
def test_other_workers_are_refused(found, message):
    with pytest.raises(ConfigError, match=message):
        check_workers(Cluster(**found), "tcp://here", workers._computed_with)


def test_without_dask_it_is_said_how_to_get_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"cluster\.txt"):
        next(do_all(abs, [1], workers=1, scheduler="tcp://127.0.0.1:8786"))


def test_local_work_is_all_done(monkeypatch):
    monkeypatch.setattr(workers, "compile_kernels", lambda: None)
    assert sorted(do_all(abs, [-3, 1, -2], workers=1)) == [1, 2, 3]
    assert list(do_all(abs, [], workers=1)) == []
