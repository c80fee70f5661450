"""Play a bag or a track file into the motion capture topics."""

from __future__ import annotations

import argparse
import sys
import time

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.parameter import Parameter
from rich.console import Console

from hri_prediction.errors import HriError
from hri_prediction.ros.end_signal import EndSignal
from hri_sim.nodes.replayer_node import ReplayerNode

_LINGER_S = 0.1
"""Time in which the last messages leave the process [s]."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="replay_mocap.py",
        description="Play the arms of a bag, or a trial of a track file (.npz, .csv, QTM .tsv), "
        "into /humans/bodies/<id>/arm and, for the scene, /sim/bodies/<id>/arm. To predict from "
        "them, start the predictor (and, to keep what it says, the recorder) before.",
    )
    parser.add_argument("file", help="bag folder, .mcap file or track file")
    parser.add_argument("--trial", type=int, default=-1, metavar="N", help="track, from 0")
    parser.add_argument(
        "--place", default="", metavar="X,Y,Z,YAW", help="placement in the world [m, degrees]"
    )
    parser.add_argument("--body", default="", metavar="ID", help="body id (track files: person1)")
    parser.add_argument("--rate", type=float, default=1.0, metavar="R", help="speed (1)")
    parser.add_argument("--resample", type=float, default=0.0, metavar="HZ", help="sampling rate")
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument(
        "--topics", nargs="+", default=[], metavar="REGEX", help="topics of the bag to play instead"
    )
    parser.add_argument(
        "--original-stamps",
        action="store_true",
        help="keep the recorded stamps, which nodes on another clock take for stale",
    )
    parser.add_argument("--no-truth", action="store_true", help="leave /sim/bodies/<id>/arm alone")
    parser.add_argument(
        "--delay",
        type=float,
        default=2.0,
        metavar="S",
        help="time before the start (2 s): those who listen take up to a second to find the topics, "
        "and would miss what is played before",
    )
    return parser


def _values(options: argparse.Namespace) -> list[Parameter]:
    values = {
        "file": options.file,
        "trial": options.trial,
        "place": options.place,
        "body_id": options.body,
        "rate": options.rate,
        "resample": options.resample,
        "loop": options.loop,
        "topics": options.topics or [""],
        "original_stamps": options.original_stamps,
        "truth": not options.no_truth,
        "start_delay": options.delay,
        "hold": False,
    }
    return [Parameter(name, value=value) for name, value in values.items()]


def main(argv: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    options = _parser().parse_args(argv)
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    end = EndSignal()
    node: ReplayerNode | None = None
    executor = None
    try:
        node = ReplayerNode(context=context, parameter_overrides=_values(options))
        executor = EventsExecutor(context=context)
        executor.add_node(node)
        playback = node.playback
        console = Console(stderr=True)
        console.print(
            f"playing {playback.name}: {playback.duration_ns * 1e-9:.2f} s "
            f"at speed {options.rate:g} on {', '.join(node.topics)}",
            markup=False,
            highlight=False,
            soft_wrap=True,
        )
        with console.status("playing"):
            end.interrupt = False
            while not (end.asked or node.finished):
                executor.spin_once(timeout_sec=0.1)
    except KeyboardInterrupt:
        pass
    except HriError as error:
        print(f"replay_mocap.py: {error}", file=sys.stderr)
        return 1
    finally:
        end.interrupt = False
        if node is not None:
            node.close()
            time.sleep(_LINGER_S)
        if executor is not None:
            executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown(context=context)
        end.restore()
    return 0


if __name__ == "__main__":
    sys.exit(main())
