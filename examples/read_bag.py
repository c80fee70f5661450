"""Read a bag into arrays.

Reading a bag's list of topics and its raw messages needs no ROS; decoding messages needs the
installed message packages (they come with scripts/setup). Without an argument, a small bag is
written first, so that the example runs on its own.

    scripts/_run_in_env python examples/read_bag.py runs/demo_…/bag
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from hri_prediction.bags import BagReader, BagWriter, TopicInfo
from hri_prediction.bags.arms import arm_tracks
from hri_prediction.errors import HriError
from hri_sim.people.training import training_reaches
from hri_sim.scenario.schema import PersonSpec


def write_small_bag(folder: Path) -> None:
    """One simulated reach, as a mocap source publishes it."""
    from rclpy.serialization import serialize_message

    from hri_prediction.ros.conversions import message_from_sample

    person = PersonSpec()
    rng = np.random.default_rng(2)
    track = training_reaches(person, person.home, (0.4, -0.2, 0.15), 1, rng)[0]
    with BagWriter(folder, custom_data={"seed": "2"}) as writer:
        channel = writer.add_topic(TopicInfo("/humans/bodies/person1/arm", "hri_msgs/msg/HumanArm"))
        for number, sample in enumerate(track.samples(start_ns=1_000_000_000), 1):
            data = serialize_message(message_from_sample(sample, "person1"))
            writer.write(channel, data, sample.stamp_ns, sample.stamp_ns, number)


def show(path: Path) -> None:
    """Print topics and provenance; turn arms, joints and clearance into arrays."""
    bag = BagReader(path)
    print(f"{path}: {bag.metadata.message_count} messages, {bag.metadata.duration_ns * 1e-9:.1f} s")
    for name, info in sorted(bag.topics.items()):
        print(f"  {info.message_count:6d}  {name}  [{info.type}]")
    for key in ("seed", "scenario", "recorded_at"):
        print(f"{key}: {bag.custom_data.get(key, 'not recorded')}")

    # Tracked arms, cut into continuous pieces: what training and replay use.
    for track in arm_tracks(path):
        wrist = track.keypoints[:, 2]  # (N, 3) [m], NaN where it was not seen
        extent = np.nanmax(wrist, axis=0) - np.nanmin(wrist, axis=0)
        print(
            f"{track.subject}: {len(track)} samples at {track.rate_hz:.0f} Hz, "
            f"{track.valid.mean():.1%} of keypoints seen, "
            f"the wrist moves over {extent[0]:.2f} x {extent[1]:.2f} x {extent[2]:.2f} m"
        )

    # Any other topic, message by message.
    if "/joint_states" in bag.topics:
        q = np.array([m.decode().position for m in bag.messages(["/joint_states"])])
        print(f"joint angles: array {q.shape}, largest range {np.ptp(q, axis=0).max():.2f} rad")
    if "/sim/state" in bag.topics:
        clearance = np.array([m.decode().clearance for m in bag.messages(["/sim/state"])])
        near = clearance[clearance < 1e8]  # 1e9: nobody was in the scene
        least = f"smallest {near.min() * 1e2:.1f} cm" if len(near) else "nobody was in the scene"
        print(f"true clearance: {least}")


def main() -> None:
    """Show the bag that was named, or a small one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", nargs="?", type=Path, help="bag folder or .mcap file")
    options = parser.parse_args()
    if options.bag is not None:
        show(options.bag)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "small"
        write_small_bag(path)
        show(path)


if __name__ == "__main__":
    try:
        main()
    except (HriError, OSError) as error:
        sys.exit(f"read_bag.py: {error}")
