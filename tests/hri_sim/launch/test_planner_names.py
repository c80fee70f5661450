"""Names of planners that cannot be launched get an answer that helps."""

import pytest

from hri_prediction.errors import ConfigError
from hri_sim.launch.ptomp import PLANNERS, _elsewhere, one_of


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("itompp", "one like itomp"),
        ("chomp", "give --planner stomp"),
        ("ptomp_adapted", "adaptation_model: success_f8"),
        ("stomp_prior", "benchmark_planners.py alone"),
    ],
)
def test_the_answer_to_a_name(name: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        one_of("planner", name, PLANNERS, _elsewhere(name))
