"""What connects arms that are followed with the hybrid loop that learns their people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.hybrid.background import Background
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.loop import (
    Expected,
    Explained,
    Inline,
    Learnt,
    Left,
    Reached,
    Rested,
    Setup,
    Trouble,
)
from hri_prediction.hybrid.merging import merged
from hri_prediction.hybrid.person import Rest
from hri_prediction.hybrid.store import check_person
from hri_prediction.hybrid.watch import ArmWatch
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.ros.following import FollowedBody

Array = NDArray[np.float64]

_AUTO = "auto"
STRANGERS = 8
"""So many people who have gone, and are not kept, are still known should they come back; trackers have new
ids without end."""


def targets_of(names: Sequence[str], positions: Sequence[float]) -> dict[str, Array]:
    """Targets by name (3,) [m].

    Raises:
        ConfigError: there are none, or names and positions do not fit.
    """
    points = np.array(positions, dtype=float)
    if not names or points.size != 3 * len(names) or len(set(names)) < len(names):
        raise ConfigError(
            f"target_names ({len(names)}) with {points.size} target_positions",
            expected="hybrid needs one or more names, each once, and x, y, z of each",
        )
    if not np.isfinite(points).all():
        raise ConfigError("target_positions that are not finite", expected="metres")
    for name in names:
        if not name.isidentifier():
            raise ConfigError(f"target {name!r}", expected="letters, digits and _, no digit first")
    return dict(zip(names, points.reshape(-1, 3), strict=True))


def _facing_of(text: str) -> float | None:
    if text == _AUTO:
        return None
    try:
        angle = float(text)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise ConfigError(f"facing {text!r}", expected="auto, or degrees from x towards y")
    return math.radians(angle)


def _people_of(pairs: Sequence[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for pair in pairs:
        body, equals, name = pair.partition("=")
        if not (equals and body):
            raise ConfigError(f"people {pair!r}", expected="BODY=NAME")
        if name in found.values() or body in found:
            raise ConfigError(f"people {pair!r}", expected="each body and each name once")
        found[body] = check_person(name)
    return found


class Learning:
    """Learns the people of the bodies that a predictor follows.

    Args:
        targets: Where tips of hands may end, by name (3,) [m], in the frame of the bodies.
        predictor: Settings of the predictors.
        config: Of the hybrid.
        facing: Where people face [deg], or auto.
        weights: Path of a process of weights; empty: the one that ships.
        folder: Of people; empty: none.
        people: Who bodies are, as BODY=NAME.
        at_once: Whether answers must come with the question, as in virtual time.

    Attributes:
        figures: What there is to say of it.

    Raises:
        ConfigError, DataError: naming the setting that is wrong.
    """

    def __init__(
        self,
        targets: Mapping[str, Array],
        predictor: PredictorConfig,
        config: HybridConfig,
        *,
        facing: str,
        weights: str,
        folder: str,
        people: Sequence[str],
        at_once: bool,
    ) -> None:
        self._targets, self._predictor, self._config = targets, predictor, config
        self._facing = _facing_of(facing)
        self._people = _people_of(people)
        setup = Setup(
            targets,
            predictor,
            config,
            Path(weights) if weights else None,
            Path(folder) if folder else None,
            frozenset(self._people.values()),
        )
        self._loop: Inline | Background = Inline(setup) if at_once else Background(setup)
        self._given: dict[tuple[str, str], TaskLibrary] = {}
        self._waiting: dict[tuple[str, str], TaskLibrary] = {}
        self._seen: set[tuple[str, str, str]] = set()
        self._told: dict[str, set[str]] = {}
        # Those who are not kept, who was seen last at the end.
        self._strangers: dict[str, None] = {}
        self.figures: dict[str, Any] = {"hybrid": "running"}

    def watch(self, side: str) -> ArmWatch:
        """What looks on while an arm is followed."""
        return ArmWatch(side, self._targets, self._predictor, self._config, self._facing)

    def anew(self) -> None:
        """What is known of all people has changed: give arms their own tasks beside it again."""
        self._waiting = dict(self._given)

    def _person(self, body_id: str) -> str:
        """Whose a body is; who is not named is called by the body, and is nobody who is kept."""
        kept = self._people.get(body_id)
        if kept is not None:
            return kept
        return f"?{body_id}" if body_id in self._people.values() else body_id

    def _leave(self, bodies: Mapping[str, FollowedBody]) -> None:
        """Forget strangers who have gone, but for the last ones."""
        here = [self._person(body.body_id) for body in bodies.values()]
        for person in here:
            if person not in self._people.values():
                self._strangers.pop(person, None)
                self._strangers[person] = None
        gone = [person for person in self._strangers if person not in here]
        for person in gone[: max(len(gone) - STRANGERS, 0)]:
            del self._strangers[person]
            self._loop.ask(Left(person))
            for of_arms in (self._given, self._waiting):
                for key in [key for key in of_arms if key[0] == person]:
                    del of_arms[key]
            self._seen = {key for key in self._seen if key[0] != person}
            for figure in self._told.pop(person, ()):
                del self.figures[figure]

    def _tell(self, person: str, what: str, text: str) -> None:
        """Have something to say of a person."""
        self.figures[f"{person} {what}"] = text
        self._told.setdefault(person, set()).add(f"{person} {what}")

    def exchange(
        self, bodies: Mapping[str, FollowedBody], common: TaskLibrary | None
    ) -> Iterator[tuple[str, str]]:
        """Tell the loop what was seen, and the arms what came of it.

        Args:
            bodies: That are followed, by name.
            common: What is known of all people.

        Yields:
            Faults: what they are about, and a text.
        """
        self._leave(bodies)
        for body in bodies.values():
            person = self._person(body.body_id)
            for arm in body.arms.values():
                for told in arm.watch.questions() if arm.watch is not None else ():
                    self._loop.ask(
                        Rested(person, told) if isinstance(told, Rest) else Reached(person, told)
                    )
        if isinstance(self._loop, Background) and self._loop.lost:
            self.figures["hybrid questions lost"] = self._loop.lost
        unusable = sum(
            arm.watch.unusable
            for body in bodies.values()
            for arm in body.arms.values()
            if arm.watch is not None
        )
        if unusable:
            self.figures["hybrid reaches unusable"] = unusable
        if not self._loop.alive and self.figures["hybrid"] == "running":
            self.figures["hybrid"] = "its process has ended: people are learnt no more"
        if not self._loop.alive:
            yield "process", str(self.figures["hybrid"])
        elif self._loop.stalled:
            yield (
                "process",
                "the process that learns people has not answered for long: it hangs, or gets no time",
            )
        for answer in self._loop.answers():
            if not (answer.person in self._people.values() or answer.person in self._strangers):
                continue  # has gone meanwhile
            if isinstance(answer, Expected):
                whose = answer.person, answer.side
                self._given[whose] = self._waiting[whose] = answer.library
                for task, sd in answer.spread.items():
                    if (*whose, task) not in self._seen:
                        guess = f"not seen yet, weights guessed within e^{sd:.1f}"
                        self._tell(answer.person, f"{answer.side} {task}", guess)
                for target, reason in answer.remarks.items():
                    yield target, f"{answer.person} and {target}: {reason}"
            elif isinstance(answer, Trouble):
                yield answer.person, f"{answer.person}: {answer.text}"
            else:
                self._note(answer)
        yield from self._hand_out(bodies, common)

    def _hand_out(
        self, bodies: Mapping[str, FollowedBody], common: TaskLibrary | None
    ) -> Iterator[tuple[str, str]]:
        """Give libraries to arms that are not in the midst of a reach; others get them after it."""
        waiting, self._waiting = self._waiting, {}
        for (person, side), library in waiting.items():
            try:
                both = merged(common, library)
            except DataError as error:
                yield "library", str(error)
                continue
            for body in bodies.values():
                if self._person(body.body_id) != person or side not in body.arms:
                    continue
                if not body.arms[side].predictor.expect(both):
                    self._waiting[person, side] = library  # unless a newer one comes

    def _note(self, answer: Learnt | Explained) -> None:
        if isinstance(answer, Learnt):
            known = f"{answer.seen} reaches, KL {answer.divergence:.3f} a weight"
            self._tell(answer.person, f"{answer.side} {answer.task}", known)
            self._seen.add((answer.person, answer.side, answer.task))
            return
        found = answer.why
        self._tell(
            answer.person,
            f"{answer.side} {found.task} weights",
            " ".join(
                f"{name} {value:.2f}"
                for name, value in zip(found.data.names, found.alpha, strict=True)
            )
            + f", {1e3 * found.before_m:.0f} -> {1e3 * found.after_m:.0f} mm",
        )

    def close(self) -> None:
        """End the process that learns."""
        self._loop.close()
