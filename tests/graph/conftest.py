"""Scene, library and graph of the lock-step tests; makes this folder's helpers importable."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")

from hri_sim.launch.scene import scenario_library
from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, policy_graph, ptomp_graph

SEED = 100


@pytest.fixture(scope="session")
def scenario() -> Scenario:
    """A scenario of the condition generator: robot and person cross."""
    return draw_scenario(SEED, 2)


@pytest.fixture(scope="session")
def library(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Task library trained on its person's tasks."""
    path = tmp_path_factory.mktemp("library") / "library.npz"
    trained = scenario_library(scenario, SEED)
    assert trained is not None
    trained.save(path)
    return path


@pytest.fixture
def make_graph(scenario: Scenario, library: Path, tmp_path: Path) -> Iterator[Callable[..., Graph]]:
    """Makes the whole graph of the scenario; closes it after the test."""

    def make(**options: Any) -> Graph:
        options = {"seed": SEED, "library": library, **options}
        return ptomp_graph(options.pop("scenario", scenario), tmp_path, **options)

    yield from _closed_in_the_end(make)


@pytest.fixture
def make_policy_graph(scenario: Scenario, tmp_path: Path) -> Iterator[Callable[..., Graph]]:
    """The same with a policy, that has run until all is seen."""

    def make(**options: Any) -> Graph:
        graph = policy_graph(options.pop("scenario", scenario), tmp_path, seed=SEED, **options)
        graph.run(0.3)
        return graph

    yield from _closed_in_the_end(make)


def _closed_in_the_end(make: Callable[..., Graph]) -> Iterator[Callable[..., Graph]]:
    graphs: list[Graph] = []

    def made(**options: Any) -> Graph:
        graphs.append(make(**options))
        return graphs[-1]

    yield made
    late = {
        name for graph in graphs for node in graph.nodes.values() for name in node.compiled_late()
    }
    for graph in graphs:
        graph.close()
    assert not late, "compiled while the graph ran: the warm-up lacks types of these kernels"


@pytest.fixture
def graph(make_graph: Callable[..., Graph]) -> Graph:
    """The whole graph as it is."""
    return make_graph()
