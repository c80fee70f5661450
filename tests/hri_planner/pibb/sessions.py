"""Sessions of a made-up experiment, and what is known of them."""

import json
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import TERM_NAMES, Terms
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import experiment_of, to_mapping
from hri_planner.pibb.session import Session, row_of

GOALS = {"near, left": [0.5, 0.3, 0.2], "b": [0.6, -0.1, 0.25], "ü": [0.5, -0.3, 0.3]}
PERSON = {"person": "ann", "seed": 7}


def experiment(**changes: Any) -> Experiment:
    content = {
        "name": "made_up",
        "posture": [0.1, -0.2, 0.3, 1.1, 0.0, -0.7, 1.0 / 3.0],
        "goals": GOALS,
        "targets": {name: [0.8, y, 0.04] for name, (_, y, _) in GOALS.items()},
        "boxes": [{"center": [0.48, -0.17, 0.06], "size": [0.1, 0.3, 0.7]}],
        "duration": 1.0,
        "improvement": {
            "updates": 3,
            "rollouts": 4,
            "habituation": 2,
            "exploration": 0.03,
            "averaged": 3,
        },
    }
    return experiment_of({**content, **changes})


def begun(seed: int = 0, **changes: Any) -> Session:
    what = experiment(**changes)
    rng = np.random.default_rng(seed)
    # In another order than the experiment's, and one in another order in memory.
    weights = {name: 0.05 * rng.standard_normal((3, 20)) for name in reversed(GOALS)}
    weights["b"] = np.asfortranarray(weights["b"])
    goals = {name: np.array(GOALS[name]) for name in weights}
    policy = DmpPolicy(np.array([0.3, 0.0, 0.4]), what.posture, goals, weights, 1.0)
    return Session.begin(what, policy, rng)


def step(session: Session, rng: np.random.Generator) -> None:
    trial = session.next_trial()
    assert trial is not None
    drawn = rng.lognormal(size=len(TERM_NAMES))
    terms = Terms(*drawn)
    terms = replace(terms, task=float(rng.random() < 0.2), indistinct=session.indistinctness(trial))
    guess = str(rng.choice(list(GOALS)))
    session.finish(trial, guess, terms, float(rng.normal()))


def advanced(trials: int, **changes: Any) -> Session:
    session, rng = begun(**changes), np.random.default_rng(99)
    for _ in range(trials):
        step(session, rng)
    return session


def bits(policy: DmpPolicy) -> Any:
    parts = {"start": policy.start, "posture": policy.posture}
    parts |= {f"goal {name}": place for name, place in policy.goals.items()}
    parts |= {f"weights {name}": own for name, own in policy.weights.items()}
    parts |= {f"path {name}": policy.path(name) for name in policy.names}
    return policy.duration, [(name, values.tobytes()) for name, values in parts.items()]


def known(session: Session) -> Any:
    """All of a session, so that equal ones are so bit for bit."""
    state = session.state
    return (
        json.dumps(to_mapping(session.experiment)),
        bits(state.policy),
        state.update,
        [(name, own.shape, own.tobytes()) for name, own in state.changes.items()],
        sorted((name, own.shape, own.tobytes()) for name, own in state.late.items()),
        state.order,
        json.dumps(state.costs),
        json.dumps({name: asdict(terms) for name, terms in state.units.items()}),
        json.dumps([row_of(result) for result in state.results]),
        state.rng,
    )
