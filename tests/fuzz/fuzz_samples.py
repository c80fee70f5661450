"""Small files of every kind, as this project or the programs of others write them."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import yaml
from fuzz_archives import DEFLATED, npz_bytes
from fuzz_c3ds import with_analogs
from mocap_files import arm_mm, bvh_text, c3d_bytes, qtm_text, trc_text, vicon_text

from hri_planner.adaptation.best_fixed import BestFixed
from hri_planner.adaptation.grid import Cell
from hri_planner.adaptation.model_file import save_model, shipped_path
from hri_planner.dmp.model_file import save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import Terms
from hri_planner.pibb.experiment import Experiment, Improvement
from hri_planner.pibb.experiment_file import find_experiment
from hri_planner.pibb.session import Session
from hri_planner.pibb.storage import SESSION, save_session
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.model_file import save_policy
from hri_planner.rnn.network import new_network
from hri_planner.rnn.scales import Scales
from hri_planner.rnn.training.state import TrainingState, save_state
from hri_prediction.bags.metadata import OfferedQos, TopicInfo
from hri_prediction.bags.writer import BagWriter
from hri_prediction.files.sealed import KEY
from hri_prediction.hybrid.prior_path import Geometry, PriorPath
from hri_prediction.hybrid.store import PERSON_FORMAT, write_task
from hri_prediction.hybrid.task import PersonalTask, TaskKey
from hri_prediction.hybrid.weight_file import data_to_values, save_process
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess
from hri_prediction.live.qtm_server import EVENT, NO_MORE, QtmServer, data_packet, packet
from hri_prediction.ontology.classifier import TERMS, InteractionClassifier
from hri_prediction.ontology.cost_file import CaseCosts, LearntCosts
from hri_prediction.ontology.costs import NUMBER
from hri_prediction.ontology.table import SegmentTable, table_of
from hri_prediction.prediction.library import TaskLibrary, TaskModel
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.storage import save_promp
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.track import ArmTrack
from hri_sim.ontology.handovers import ARM
from hri_sim.scenario.shipped import load_shipped

Files = tuple[bytes, ...]
BEGIN_NS = 10**18
"""When messages of bags begin."""
MARK = "mark"
"""What files of training and of evaluation are for."""


def written(write: Callable[[Path], object], name: str) -> bytes:
    """What a writer writes into a file of a name."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


# ------------------------------------------------------------------ recordings
@cache
def marker_files() -> dict[str, Files]:
    """By the ending that they have."""
    points = arm_mm(12)
    points[5, 2] = np.nan
    names = [f"ann:{name}" for name in ("RSHO", "RELB", "RWRA", "RWRB", "RFIN")]
    values = np.linspace(-20.0, 20.0, 12 * 18).reshape(12, 18)
    c3ds = [
        c3d_bytes(points, processor=processor, real=real, y_screen="+Z")
        for processor in ("Intel", "DEC", "MIPS")
        for real in (True, False)
    ]
    texts = {
        "trc": (trc_text(points), trc_text(points, separator=",", newline="\r\n", missing="nan")),
        "bvh": (bvh_text(values),),
        "csv": (
            vicon_text(points),
            vicon_text(points, labels=names, before=["Devices", "1000", ""]),
        ),
        "tsv": (
            qtm_text(points),
            qtm_text(points, header=False),
            qtm_text(points, header=False, lead=False),
        ),
    }
    found = {ending: tuple(text.encode() for text in own) for ending, own in texts.items()}
    analogs = [with_analogs(c3ds[index]) for index in (0, 1, 2, 4)]
    return {"c3d": (*c3ds, *analogs), **found}


def arm_track(rows: int = 8, **about: Any) -> ArmTrack:
    """A right arm that moves a little, 100 Hz."""
    rest = np.array([[0.7, 0.2, 0.5], [0.65, 0.0, 0.35], [0.45, -0.1, 0.25], [0.36, -0.12, 0.25]])
    points = rest + 0.01 * np.arange(rows)[:, None, None] * np.array([-1.0, 0.3, 0.1])
    points[rows // 2, 1] = np.nan
    return ArmTrack(0.01 * np.arange(rows), points, **about)


@cache
def track_archives() -> Files:
    """Our own, that of the ADL reaches and that of the pick-and-place runs."""
    tracks = [arm_track(subject="ann", task="cup", trial=3), arm_track(9, side="left")]
    own = written(lambda path: save_tracks(path, tracks), "a.npz")
    places = np.stack([arm_track(30).keypoints[0]] * 30).astype(np.float32)
    places = np.concatenate((places, places[:, :2] + 0.1), axis=1)
    adl = {
        "pos": places,
        "joint_names": np.array(["shoulder", "elbow", "wrist", "fingertip", "sternum", "hand"]),
        "start": np.array([0, 10]),
        "length": np.array([10, 20]),
        "onset": np.array([3, 5]),
        "offset": np.array([8, 15]),
        "subject": np.array([1, 12]),
        "task": np.array(["F", "A"]),
        "side": np.array(["L", "R"]),
        "trial": np.array([1, 2]),
    }
    hand = places[:, [3]] + np.array([[[0.0, 0.0, 0.02], [0.03, 0.0, 0.0], [0.0, 0.03, 0.0]]])
    marks = ["Shoulder", "Elbow", "Wrist", "Index", "Back left", "Back right"]
    runs = {
        "pos": np.concatenate((places, hand), axis=1),
        "marker_names": np.array([*marks, "Hand top", "Hand right", "Hand left"]),
        "rate_hz": np.array(60.0),
        "subject": np.array([1, 2]),
        "run": np.array([1, 1]),
        "start": np.array([0, 15]),
        "length": np.array([15, 15]),
        "segment": np.array([[0, 1, 5], [1, 2, 9]]),
        "segment_label": np.array(["grasp", "idle"]),
    }
    return own, npz_bytes(adl), npz_bytes(runs, DEFLATED)


@cache
def track_texts() -> Files:
    """Our own CSV, and a QTM export of the marker set that needs no choice."""
    own = written(lambda path: save_tracks(path, [arm_track(subject="ann", trial=2)]), "a.csv")
    marks = (
        "Index",
        "Shoulder",
        "Elbow",
        "Hand top",
        "Hand right",
        "Hand left",
        "Back left",
        "Back right",
    )
    rest = np.array(
        [
            (0, 0, 0),
            (500, 0, 300),
            (250, 0, 300),
            (40, 0, 0),
            (0, 40, 0),
            (0, 0, 40),
            (9, 9, 9),
            (5, 5, 5),
        ]
    )
    points = rest + 3.0 * np.arange(8)[:, None, None]
    return own, qtm_text(points, marks, rate="60").encode()


@cache
def handover_archives() -> Files:
    """Of two pairs."""
    rng = np.random.default_rng(0)
    arrays = {
        "pos": rng.uniform(-0.2, 0.2, (80, 2, 3)).astype(np.float32),
        "start": np.array([0, 40]),
        "length": np.array([40, 40]),
        "pair": np.array(["a", "b"]),
        "rate_hz": np.array(120.0),
    }
    return (npz_bytes(arrays),)


# ------------------------------------------------------------------ streams
QTM_NAMES = ("RSHO", "RELB", "RWRA", "RWRB", "RFIN")
"""Markers of the stream."""


@cache
def qtm_streams() -> Files:
    """What a motion capture server sends once frames are asked for."""
    places = arm_mm(6)
    places[2, 1] = np.nan
    frames = [data_packet(n + 1, 10_000 * n, points) for n, points in enumerate(places)]
    told = packet(EVENT, bytes([3]))
    return b"".join(frames), b"".join([frames[0], told, frames[1], packet(NO_MORE, b"")])


@cache
def qtm_layouts() -> Files:
    """What it answers when it is asked for its settings."""
    with QtmServer(arm_mm(2), QTM_NAMES) as server:
        return (server.parameters().encode(),)


# ------------------------------------------------------------------ bags
def cdr(number: int) -> bytes:
    """A ``std_msgs/UInt64``."""
    return b"\x00\x01\x00\x00" + number.to_bytes(8, "little")


def still() -> AbstractContextManager[object]:
    """Time stands still: a bag says when it was written, and the same one is to be altered in every run."""
    return patch("time.time_ns", return_value=BEGIN_NS)


def write_bag(folder: Path, messages: int = 60) -> Path:
    """A bag of plain numbers, an attachment, and more than one chunk."""
    with still(), BagWriter(folder, custom_data={"seed": "7"}, chunk_bytes=700) as writer:
        writer.add_attachment("notes.txt", "text/plain", b"hello")
        qos = (OfferedQos(),)
        channels = [
            writer.add_topic(TopicInfo(f"/t{i}", "std_msgs/msg/UInt64", qos, "RIHS01_00"))
            for i in range(3)
        ]
        for index in range(messages):
            writer.write(
                channels[index % 3], cdr(index), BEGIN_NS + index * 4_000_000, None, index + 1
            )
    return folder


@cache
def bag_files() -> Files:
    """MCAP files: one of several chunks, one without any message."""
    with tempfile.TemporaryDirectory() as folder:
        return tuple(
            next(write_bag(Path(folder) / f"bag{count}", count).glob("*.mcap")).read_bytes()
            for count in (60, 0)
        )


@cache
def arm_bag_files() -> Files:
    """MCAP files of an arm, and of what was predicted of it."""
    from rclpy.serialization import serialize_message

    from hri_prediction.ros.arm_bag import write_arm_bag
    from hri_prediction.ros.messages import HumanPrediction

    with tempfile.TemporaryDirectory() as folder:
        with still():
            write_arm_bag(Path(folder) / "arm", arm_track(subject="ann"))
        said = HumanPrediction(body_id="ann", side="right", times=[0.1, 0.2], mean=[0.3] * 24)
        said.covariance, said.tasks, said.task_probabilities = (
            [1e-4] * 72,
            ["cup", "pen"],
            [0.3, 0.7],
        )
        with BagWriter(Path(folder) / "said") as writer:
            topic = TopicInfo("/humans/bodies/ann/prediction", "hri_msgs/msg/HumanPrediction")
            channel = writer.add_topic(topic)
            for index in range(4):
                writer.write(channel, serialize_message(said), BEGIN_NS + index)
        found = sorted(Path(folder).glob("*/*.mcap"))
        return tuple(path.read_bytes() for path in found)


@cache
def metadata_trees() -> tuple[Any, ...]:
    """Content of a bag's metadata.yaml."""
    with tempfile.TemporaryDirectory() as folder:
        return (yaml.safe_load((write_bag(Path(folder) / "bag", 6) / "metadata.yaml").read_text()),)


# ------------------------------------------------------------------ models
def _promp() -> ProMP:
    basis, size = PhaseBasis(4, 0.7), 24
    return ProMP(basis, np.linspace(0.0, 0.3, size), 0.01 * np.eye(size), 1e-4 * np.eye(6))


GOALS = {"a": np.array((0.56, 0.24, 0.12)), "b": np.array((0.6, -0.2, 0.12))}
START, POSTURE = np.array((0.39, 0.0, 0.33)), np.array([0.0, -0.4, 0.0, 1.5, 0.0, -0.8, 0.0])
POLICY = DmpPolicy(START, POSTURE, GOALS, {name: np.full((3, 20), 0.01) for name in GOALS}, 2.5)


def _session(trials: int) -> bytes:
    plan = Improvement(updates=3, rollouts=2, habituation=1, averaged=2)
    experiment = Experiment("e", POSTURE, GOALS, GOALS, np.ones((1, 2, 3)), 2.5, improvement=plan)
    session = Session.begin(experiment, POLICY, np.random.default_rng(0))
    for number in range(trials):
        trial = session.next_trial()
        assert trial is not None
        terms = Terms(3.0 + 0.1 * number, 4.0, 2.0, number % 2, 1e-4, 0.6, 0.2)
        session.finish(trial, trial.goal, terms, 0.1)
    with tempfile.TemporaryDirectory() as folder:
        save_session(Path(folder), session, person="ann", seed=7)
        return (Path(folder) / SESSION).read_bytes()


@cache
def model_files() -> dict[str, Files]:
    """By what reads them."""
    task = TaskModel("cup", "right", _promp(), 0.9, 0.1, 6, 0.001)
    library = TaskLibrary((task,), 0.29, 0.26, place="1,0,0,0", facing_deg=(10.0, 20.0))
    network = new_network("gru3t", (3, 2), np.random.default_rng(0))
    rnn = PolicyModel(network, Scales(0.6, 17.5, 5.0), FeatureConfig(influence=0.35))
    weights = {"weight": np.ones((3, 2)), "bias": np.zeros(3)}
    state = TrainingState(
        "imitation", 2, weights, weights, 0.5, 1, weights, np.random.default_rng(0).bit_generator.state,
        ({"round": 1, "loss": 0.3},), 12.0,
    )  # fmt: skip
    small = written(lambda path: save_model(path, BestFixed(Cell(20, 10)), {"seed": 1}), "a.npz")
    shipped = [shipped_path(name).read_bytes() for name in ("gpr_f8", "success_f8")]
    return {
        "promp": (written(lambda path: save_promp(path, _promp()), "a.npz"),),
        "library": (written(library.save, "a.npz"),),
        "rnn": (written(lambda path: save_policy(path, rnn, {"data": "d1"}), "a.npz"),),
        "dmp": (
            written(lambda path: save_dmp(path, POLICY, {"updates": 3, "saved": "x"}), "a.npz"),
        ),
        "adaptation": (small, *(content for content in shipped if len(content) < 100_000)),
        "session": tuple(map(_session, (0, 3, 6, 12, 14))),
        "training": (written(lambda path: save_state(path, state, MARK), "a.npz"),),
        "personal task": (written(lambda path: write_task(path, _personal_task()), "a.npz"),),
        "classifier": (written(_classifier().save, "a.npz"),),
        "segments": (written(_segments().save, "a.npz"),),
        "skeletons": (npz_bytes(_skeletons()),),
    }


def _classifier() -> InteractionClassifier:
    """Of two classes."""
    forms = np.linspace(-0.1, 0.1, TERMS)[None]
    return InteractionClassifier(
        np.array([1, 13]), np.full(25, 0.4), np.full(25, 0.1), forms, 2.0, np.eye(25), 9.0, "a test"
    )


def _segments() -> SegmentTable:
    features = np.linspace(0.1, 0.9, 75).reshape(3, 25)
    return table_of(list(features), [1, 2, 13], ["ann", "ann", "bob"], ["frontal"] * 3, [0, 0, 1])


def _skeletons() -> dict[str, Any]:
    """One trial of two people."""
    points = arm_track(12).keypoints[:, :3]
    people = np.stack((points, points + 0.5), axis=1)
    return {
        "pos": np.nan_to_num(people)[None].astype(np.float32),
        "body_names": np.array(ARM),
        "person_names": np.array(["giver", "taker"]),
        "rate_hz": np.array(120.0),
    }


def _personal_task() -> PersonalTask:
    phases = np.linspace(0.0, 1.0, 5)
    path = PriorPath(phases, np.outer(phases, np.ones(6)), 0.9, np.zeros(3), np.ones(3))
    return PersonalTask(
        TaskKey("right", "rest", "cup"), np.array([0.5, 0.3, 0.2]), Geometry(np.zeros(6), np.ones(3)), path,
        np.linspace(0.0, 1.0, 18), np.zeros((2, 18)), np.array([0.8, 0.9]), (0.5, 0.1), 2, 0,
    )  # fmt: skip


@cache
def plain_trees() -> dict[str, tuple[Any, ...]]:
    """Content of JSON files, by what reads them."""
    costs = ("hand_jerk", "joint_jerk", "energy")
    inputs = np.linspace(0.0, 1.0, 12).reshape(2, 6)
    data = WeightData(costs, inputs, np.zeros((2, 2)), np.full((2, 2), 0.1))
    process = WeightProcess(data, np.zeros(2), np.ones(2), np.ones((2, 6)))
    text = written(lambda path: save_process(path, process, "a test"), "a.json")
    person = {"format": PERSON_FORMAT, "changed": "2026-01-01", "weights": data_to_values(data)}
    flat = CaseCosts(np.full(NUMBER, 0.1), np.ones(NUMBER), 12, 0.9)
    learnt = LearntCosts({"case_1": flat, "case_13": flat}, 0.2, "a test", ("case_13: few",))
    return {
        "weights": (_unsealed(text),),
        "person": (person, {**person, "weights": None}),
        "interaction costs": (_unsealed(written(learnt.save, "a.json")),),
        "explained reaches": (_explained(costs),),
    }


def _unsealed(text: bytes) -> dict[str, Any]:
    """Without the checksum, which would have nearly all that is altered refused for the same reason."""
    return {key: value for key, value in json.loads(text).items() if key != KEY}


def _explained(costs: tuple[str, ...]) -> dict[str, Any]:
    """Results of inverse optimal control, of enough reaches to fit to."""
    row = {
        "name": "a", "error": "", "q_start_deg": [10.0] * 3, "q_end_deg": [30.0] * 3,
        "alpha": [0.5, 0.3, 0.2], "covariance": np.diag([0.01] * 3).ravel().tolist(), "factors": [1.0] * 3,
        "rest_factors": [1.0] * 3,
    }  # fmt: skip
    return {"costs": list(costs), "reaches": [row] * 12}


# ------------------------------------------------------------------ settings
@cache
def setting_trees() -> dict[str, tuple[Any, ...]]:
    """Content of YAML files, by what reads them."""
    scenario = load_shipped("table_reach").model_dump(mode="json")
    experiment = yaml.safe_load(find_experiment("transfer").read_text())
    boxes = [{"center": [0.5, 0.0, 0.1], "size": [0.1, 0.1, 0.3]}]
    return {
        "scenario": (scenario, {**scenario, "obstacles": boxes}),
        "experiment": (experiment, {**experiment, "boxes": boxes, "weights": {"task": 1.0}}),
        "parameters": (
            {"ptomp": {"replan_interval": 0.05, "planner.margin": 0.1}, "person": {"seed": 3}},
            {
                "predictor": {"calibration_rate": 0.1},
                "recorder": {"flush_period": 0.5},
                "simulator": {},
            },
        ),
        "predictor": ({"person_correlation": 0.3, "change_rate": 0.1},),
        "training": ({"cell": "gru", "units": [9, 9], "seed": 3},),
        "dyads": (
            {"sessions": [{"bag": "one", "case": 13, "subject": "ann", "bodies": ["a", "b"]}]},
            {"sessions": [{"bag": "one", "case": "case_1", "subject": "ann", "side": "left"}]},
        ),
    }
