"""Dyad node: two simulated people who reach turn after turn through the same space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError
from hri_prediction.ros.messages import Reset
from hri_prediction.ros.node import OK, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.time import NANO
from hri_prediction.tracks.placement import Placement
from hri_sim.dyads.bodies import dyad_bodies, named_person
from hri_sim.dyads.motion import DyadMotion
from hri_sim.dyads.setups import ARRANGEMENTS, draw_setup
from hri_sim.nodes.captured_bodies import CapturedBodies
from hri_sim.ontology.sessions import POSITION_OF, SHOWN_SEED, dyad_in_case
from hri_sim.people.capture import CapturedArm
from hri_sim.people.seeding import dyad_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS


@dataclass(frozen=True)
class DyadNodeConfig:
    """What the node needs to know."""

    seed: int = parameter(
        SHOWN_SEED, "Seed of places, people, what they do, and of the tracking", low=0
    )
    arrangement: str = parameter(
        "opposite", "Where the second person sits, seen from the first", choices=tuple(ARRANGEMENTS)
    )
    case: int = parameter(
        0,
        "Case of the interaction ontology that they are in; 0: places are drawn, and none is meant",
        low=0,
        high=20,
    )
    ids: tuple[str, ...] = parameter(("person1", "person2"), "Names of the two people")
    encounters: int = parameter(0, "How many times both reach; 0: without end", low=0)
    pause: float = parameter(
        1.0, "Rest between encounters, and before the first", unit="s", low=0.2, high=60.0
    )
    place: str = parameter(
        "0.85,0,-0.01,0",
        "Where the middle of their table top is in the world: X,Y,Z,YAW in m and degrees",
    )

    def __post_init__(self) -> None:
        validate(self)
        if len(set(self.ids)) != 2 or len(self.ids) != 2:
            raise ConfigError(f"ids = {list(self.ids)}", expected="two different names")
        for name in self.ids:
            named_person(name)
        Placement.parse(self.place)


class DyadNode(HriNode):
    """Moves two people who give way to each other."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("dyad", period_s=SAMPLE_PERIOD_NS / NANO, **kwargs)
        self._config = declare_config(self, DyadNodeConfig)
        self._seed = self._config.seed
        self._captured = CapturedBodies(self, self._config.ids, self._people_anew)
        self.serve(Reset, "~/reset", self._on_reset)

    def _people_anew(self) -> dict[str, list[CapturedArm]]:
        config, rng = self._config, dyad_generator(self._seed)
        self._said = False
        if config.case:
            setup, people = dyad_in_case(config.case, POSITION_OF[config.arrangement], self._seed)
        else:
            setup, people = draw_setup("dyad", config.arrangement, rng), None
        self._motion = DyadMotion(
            setup, rng, pause=config.pause, encounters=config.encounters, people=people
        )
        place = Placement.parse(config.place)
        return dyad_bodies(self._motion, config.ids, self._seed, place)

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        if request.scenario:
            response.success = False
            response.message = f"scenario {request.scenario!r}; a dyad has none, only a seed"
            return response
        self._seed = int(request.seed)
        self._captured.restart()
        response.success = True
        return response

    def on_tick(self, now_ns: int) -> None:
        """Publish what the two do."""
        self._captured.tick(now_ns)
        if self._motion.over and not self._said:
            self._said = True
            self.get_logger().info(
                f"all {self._motion.begun} encounters are over: a recording may end"
            )

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """What they do."""
        doing = "at rest" if self._motion.resting else "reaching"
        figures = {
            "bodies": ", ".join(self._config.ids),
            "case": self._config.case or "none",
            "encounters": self._motion.begun,
            "captures_skipped": self._captured.skipped,
        }
        return OK, doing, figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(DyadNode, args)
