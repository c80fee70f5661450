"""All that reads files of users, each as a function of the file, as the programs use it."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import shutil
from collections import deque
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
from fuzz_samples import MARK, QTM_NAMES

from hri_planner.adaptation.model_file import load_model, trained_with
from hri_planner.dmp.model_file import read_dmp
from hri_planner.pibb.experiment_file import load_experiment
from hri_planner.pibb.library import PolicyLibrary
from hri_planner.pibb.storage import load_session
from hri_planner.policy.model_file import load_any
from hri_planner.rnn.model_file import read_policy
from hri_planner.rnn.training.config import TrainingConfig
from hri_planner.rnn.training.state import load_state
from hri_prediction.bags import BagReader, inspect_bag, salvage
from hri_prediction.bags.arms import arm_tracks
from hri_prediction.bags.predictions import recorded_predictions
from hri_prediction.config import load_yaml
from hri_prediction.errors import DataError, HriError
from hri_prediction.hybrid.fit_command import read_results
from hri_prediction.hybrid.store import PeopleStore, read_task
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.live.arm_stream import ArmStream, LiveBody, MarkerLayout
from hri_prediction.live.qtm import QtmFrame, read_layout
from hri_prediction.live.qtm_client import QtmClient, _Session, load_qtm_rt
from hri_prediction.live.stream_clock import StreamClock
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.cost_file import load_costs
from hri_prediction.ontology.recordings import read_sessions
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.promp.storage import load_promp
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.importers.convert import ImportOptions, convert, plan_import
from hri_prediction.tracks.importers.recognise import read_markers
from hri_prediction.tracks.importers.report import gap_report
from hri_prediction.tracks.labels import onset_labels, segment_labels
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.plausible import check_arm
from hri_prediction.tracks.rate import check_rate
from hri_sim.launch.parameters import CONFIGURATIONS, complete_parameters, read_parameters
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.ontology.handovers import load_skeletons
from hri_sim.policies.handovers import holds_handovers, load_handovers
from hri_sim.scenario.schema import load_scenario

Reader = Callable[[Path], object]
PIECE = 37
"""What is received at a time [bytes]."""


def markers(path: Path) -> None:
    """As scripts/import_mocap.py reads a file, up to the track."""
    data = read_markers(path)
    try:
        plan = plan_import(data, ImportOptions())
        track = convert(plan)
        check_arm(track)
        check_rate(track)
    except HriError as error:
        raise DataError(f"{path}: {error}") from error
    plan.notes()
    gap_report(track)


def tracks(path: Path) -> None:
    """With their labels, and brought to another rate."""
    for track in load_tracks(path):
        track.filled(0.1)
        len(list(track.samples()))
    onset_labels(path)
    segment_labels(path)


def closed_bag(path: Path) -> None:
    """All that a bag tells, file or folder."""
    reader = BagReader(path)
    for message in reader.messages():
        len(message.data)
    list(reader.messages(["/t1"], start_ns=10**18, end_ns=10**18 + 10**9))
    _told(reader)


def any_bag(path: Path) -> None:
    """Also one whose recorder was killed."""
    reader = BagReader(path, allow_unclosed=True)
    for message in reader.messages():
        len(message.data)
    _told(reader)


def _told(reader: BagReader) -> None:
    (reader.metadata, reader.topics, reader.custom_data, reader.definitions, reader.attachments())


def inspected(path: Path) -> None:
    """As scripts/inspect_bag.py."""
    inspect_bag(path).to_mapping()


def salvaged(path: Path) -> None:
    """With --salvage; what comes of it is a whole bag."""
    out = path.with_name("salvaged")
    shutil.rmtree(out, ignore_errors=True)
    report = salvage(path, out)
    count = sum(1 for _ in BagReader(out).messages())
    assert count == report.metadata.message_count
    BagReader(out).attachments()


def arms(path: Path) -> None:
    """Decoded messages, as tracks."""
    arm_tracks(path)


def predictions(path: Path) -> None:
    """Decoded messages, as predictions."""
    recorded_predictions(BagReader(path))


def session(path: Path) -> None:
    """What goes on from a file that is named as sessions are."""
    found, _ = load_session(path.parent)
    assert found.stage
    assert found.trials > 0
    trial = found.next_trial()
    if trial is not None:
        found.indistinctness(trial)


def library_of(path: Path) -> None:
    """The library of policies around a file: what is wrong with one is told, not raised."""
    (entry,) = PolicyLibrary(path.parent.parent).entries()
    if entry.problem:
        raise DataError(f"{entry.file}: {entry.problem}")


def adaptation(path: Path) -> None:
    """A model, and how it came about."""
    trained_with(str(path))
    load_model(path)


def classifier(path: Path) -> None:
    """As the monitor of interactions uses one."""
    found = InteractionClassifier.load(path)
    found.classify(np.full((1, 25), 0.5))


def handovers(path: Path) -> None:
    """Those that say what they are."""
    if holds_handovers(path):
        load_handovers(path)


def parameters(path: Path) -> None:
    """As the launchers read them, for nodes of all kinds."""
    specs = [NodeSpec("hri_sim", name) for name in CONFIGURATIONS]
    complete_parameters(specs, read_parameters(path), f"--parameters {path}")


def person(path: Path) -> None:
    """A person of a store: what is wrong with one is told, not raised, when all are listed."""
    store = PeopleStore(path.parent.parent)
    (known,) = store.people()
    if known.problem:
        raise DataError(f"{path}: {known.problem}")
    store.load(known.name)


def qtm_stream(path: Path) -> None:
    """What comes from a motion capture server, in pieces, up to the samples of an arm."""
    frames: deque[QtmFrame] = deque()
    client = SimpleNamespace(
        _clock=itertools.count(10**18, 10**7).__next__, _frames=frames, problem=""
    )
    session = _Session(load_qtm_rt(), cast(QtmClient, client))
    session._layout = MarkerLayout(QTM_NAMES, 100.0, "+z")
    protocol = session.protocol(cast(asyncio.AbstractEventLoop, object()))  # nothing is waited for
    protocol.set_on_packet(session._on_packet)
    content = path.read_bytes()
    for at in range(0, len(content), PIECE):
        protocol.data_received(content[at : at + PIECE])
    clock, arms = (
        StreamClock(),
        ArmStream(session._layout, [LiveBody("ann")], Placement(), accept_guess=True),
    )
    for frame in frames:
        stamp = clock.stamp(frame.source_ns, frame.received_ns)
        if stamp is not None:
            assert stamp <= frame.received_ns
            arms.samples(frame.positions, stamp)
    if session._ended.is_set():
        raise DataError(f"{path}: {session._reason}")


def qtm_layout(path: Path) -> None:
    """What such a server says of its markers."""
    try:
        layout = read_layout(path.read_bytes())
    except HriError as error:
        raise DataError(f"{path}: {error}") from error
    with contextlib.suppress(HriError):  # markers of no arm
        ArmStream(layout, [LiveBody("ann", side="right")], Placement(), accept_guess=True)


MODELS: dict[str, Reader] = {
    "promp": load_promp,
    "library": TaskLibrary.load,
    "rnn": read_policy,
    "dmp": read_dmp,
    "adaptation": adaptation,
    "session": session,
    "training": lambda path: load_state(path, MARK),
    "personal task": read_task,
    "classifier": classifier,
    "segments": SegmentTable.load,
    "skeletons": load_skeletons,
}
"""Of archives, by kind."""
SETTINGS: dict[str, Reader] = {
    "scenario": load_scenario,
    "experiment": load_experiment,
    "parameters": parameters,
    "predictor": lambda path: load_yaml(PredictorConfig, path),
    "training": lambda path: load_yaml(TrainingConfig, path),
    "dyads": read_sessions,
}
"""Of YAML, by kind."""
PLAIN: dict[str, Reader] = {
    "weights": load_process,
    "person": person,
    "interaction costs": load_costs,
    "explained reaches": read_results,
}
"""Of JSON, by kind."""
BAGS: dict[str, Reader] = {
    "closed": closed_bag,
    "any": any_bag,
    "inspected": inspected,
    "salvaged": salvaged,
}
"""Of MCAP files, by what is done with them."""
EVERYTHING: dict[str, Reader] = {
    **{f"model {name}": read for name, read in MODELS.items() if name != "session"},
    **{f"setting {name}": read for name, read in SETTINGS.items()},
    **{f"bag {name}": read for name, read in BAGS.items()},
    "weights": load_process,
    "interaction costs": load_costs,
    "explained reaches": read_results,
    "markers": markers,
    "tracks": tracks,
    "handovers": load_handovers,
    "policy of any kind": load_any,
    "arms": arms,
}
"""Whatever is given a file by a user."""
WITHOUT = ("model training", "setting predictor", "setting training")
"""Those for which no file, or an empty one, is nothing to refuse."""
