"""Parameters of speed and separation monitoring, each with where its value is from.

The protective distance is that of ISO/TS 15066:2016, 5.5.4.2.3 (now in ISO 10218-2:2025):

    S_p = S_h + S_r + S_s + C + Z_d + Z_r

S_h is how far the person comes until the robot rests, S_r how far the robot goes until it begins to
stop, S_s how far it goes while it stops; C covers what is not tracked, Z_d and Z_r errors of where
person and robot are.
"""

from __future__ import annotations

from dataclasses import dataclass

from hri_prediction.config import parameter, validate

ASSUMED, MEASURED, PREDICTED = "assumed", "measured", "predicted"
HUMAN_MODES = (ASSUMED, MEASURED, PREDICTED)
"""What is taken for how fast people come nearer."""
BOTH, SEEN = "both", "seen"
"""Which arms of people count: both of everybody, or those that are heard of."""


@dataclass(frozen=True)
class ProtectiveDistanceConfig:
    """What the protective distance is made of."""

    human: str = parameter(
        ASSUMED,
        "How fast people come nearer. assumed: as fast as arm_speed and body_speed say, always; "
        "measured: as "
        "fast as they are seen to, and what human_acceleration makes of that; predicted: as far as the "
        "predictor says, with prediction_sigmas, and what human_acceleration makes of that; whom it says "
        "nothing of, or is not seen where it says, counts as assumed",
        choices=HUMAN_MODES,
    )
    arm_speed: float = parameter(
        2.0,
        "Largest speed of hands and arms; S_h. ISO 13855:2010, 6.2.3: 2 m/s within half a metre",
        unit="m/s",
        low=0.1,
        high=6.0,
    )
    body_speed: float = parameter(
        1.6,
        "Largest speed of trunk and head: that of walking; S_h. ISO 13855:2010, ISO/TS 15066:2016 "
        "5.5.4.2.3",
        unit="m/s",
        low=0.1,
        high=6.0,
    )
    human_acceleration: float = parameter(
        7.0,
        "Acceleration of a person that is reckoned with, where speeds are measured; with predictions, how "
        "far it may be from the predicted one. Point to point reaches of half a second over 0.3 m peak at "
        "7 (minimum jerk: 5.77 D/T^2), usual ones at 2 to 4",
        unit="m/s^2",
        low=0.0,
        high=100.0,
    )
    speed_error: float = parameter(
        0.1,
        "Least error of a person's measured speed that is reckoned with; see sample_noise",
        unit="m/s",
        low=0.0,
        high=2.0,
    )
    sample_noise: float = parameter(
        0.002,
        "Noise of motion capture, the standard deviation of a coordinate: three times what it makes of a "
        "measured speed is reckoned with, 0.11 m/s of 48 ms at 250 Hz, 1.06 of the first three samples "
        "after a gap",
        unit="m",
        low=0.0,
        high=0.05,
    )
    prediction_sigmas: float = parameter(
        3.0,
        "Standard deviations of a predicted place that are reckoned with",
        low=0.0,
        high=10.0,
    )
    stamp_error: float = parameter(
        0.005,
        "How much older samples may be than their stamps say, of people and of joints: by what clocks "
        "differ, and by the time from exposure to stamp that nobody knows; added to their ages, S_h, S_r "
        "and S_s",
        unit="s",
        low=0.0,
        high=0.2,
    )
    reaction_time: float = parameter(
        0.048,
        "From the time that is decided with to where the robot begins to slow down, at the latest, "
        "whatever becomes of the monitor: 4 ms until it has said what it decided (later it does not), 12 "
        "ms of transport and of a period of the controller, and the controller's heartbeat_timeout, 32 "
        "ms; S_h and S_r. Ages of samples are measured and come on top",
        unit="s",
        low=0.0,
        high=2.0,
    )
    stopping_time: float = parameter(
        0.070,
        "From full speed to rest, as the controller ramps (its ramp_down); S_h and S_s",
        unit="s",
        low=0.001,
        high=5.0,
    )
    settling_time: float = parameter(
        0.070,
        "How long the arm itself needs on top, that follows the controller's reference; S_h and S_s",
        unit="s",
        low=0.0,
        high=1.0,
    )
    robot_acceleration: float = parameter(
        10.0,
        "How much faster than now any point of the robot may become a second at full speed, and at a rate "
        "as much less as its square says; S_r and S_s. Planned motions of the table scene: up to 8.9 "
        "through 0.1 s",
        unit="m/s^2",
        low=0.0,
        high=100.0,
    )
    robot_speed: float = parameter(
        1.75,
        "Speed of any point of a robot that sets out, at full speed, before its reference tells it; S_r "
        "and S_s. Planned motions of the table scene: up to 1.73",
        unit="m/s",
        low=0.0,
        high=5.0,
    )
    evasion: bool = parameter(
        False,
        "Whether a part of the robot that moves away from a person is let go on though they come "
        "nearer. Standing "
        "it would be touched sooner, but it may be touched while it moves",
    )
    contact_speed: float = parameter(
        0.0,
        "So slow may the robot's fastest point always be, however near somebody is; 0: the robot rests. A "
        "speed at which a touch does no harm (power and force limiting, ISO/TS 15066:2016 5.5.5) is "
        "found by a "
        "risk assessment of the cell",
        unit="m/s",
        low=0.0,
        high=0.25,
    )
    intrusion: float = parameter(
        0.05,
        "C: how far what is not tracked (fingers, clothes; without `trunk` trunk and head) may be ahead "
        "of what "
        "is. Without `trunk` 0.35 covers a head that is bent forward over the shoulders",
        unit="m",
        low=0.0,
        high=1.5,
    )
    sensor_error: float = parameter(
        0.01, "Z_d: largest error of a tracked place", unit="m", low=0.0, high=0.5
    )
    robot_error: float = parameter(
        0.005,
        "Z_r: largest error of where the robot is: calibration, play, sag",
        unit="m",
        low=0.0,
        high=0.5,
    )

    def __post_init__(self) -> None:
        """Check the ranges."""
        validate(self)


@dataclass(frozen=True)
class BodyConfig:
    """What a tracked person is taken to be made of."""

    radius_upper_arm: float = parameter(
        0.05, "Radius of the upper arm", unit="m", low=0.0, high=0.3
    )
    radius_forearm: float = parameter(0.04, "Radius of the forearm", unit="m", low=0.0, high=0.3)
    radius_hand: float = parameter(0.05, "Radius of the hand", unit="m", low=0.0, high=0.3)
    trunk: bool = parameter(
        True,
        "Whether trunk and head are added where the tracked shoulders have them. Of a person with one "
        "tracked "
        "arm they are wider by half of shoulder_breadth, as nobody knows on which side they are",
    )
    shoulder_breadth: float = parameter(
        0.43,
        "From shoulder joint to shoulder joint: biacromial breadth, men's 95th percentile",
        unit="m",
        low=0.1,
        high=0.8,
    )
    trunk_radius: float = parameter(
        0.16,
        "Radius of the trunk about its axis: half of the depth of chest and belly, men's 95th percentile",
        unit="m",
        low=0.05,
        high=0.5,
    )
    trunk_length: float = parameter(
        0.55, "From the shoulders down to the hips", unit="m", low=0.1, high=1.0
    )
    max_lean: float = parameter(
        0.52,
        "How far the trunk may lean forwards, unseen; backwards a third of it. Hips are farther "
        "behind the shoulders then, and the head before them",
        unit="rad",
        low=0.0,
        high=1.2,
    )
    head_height: float = parameter(
        0.22, "From the shoulders up to the middle of the head", unit="m", low=0.05, high=0.5
    )
    head_radius: float = parameter(
        0.20,
        "Radius of the head about its middle: 0.12, and 8 cm for heads that are held or bent forward",
        unit="m",
        low=0.05,
        high=0.4,
    )

    def __post_init__(self) -> None:
        """Check the ranges."""
        validate(self)


@dataclass(frozen=True)
class ReleaseConfig:
    """When the robot is slowed, stopped and let go."""

    min_scale: float = parameter(
        0.05, "Slower than that, as a share of full speed, is a stop", low=0.01, high=1.0
    )
    release_margin: float = parameter(
        0.02,
        "Room beyond the protective distance that lets the robot become faster again; larger chatters less",
        unit="m",
        low=0.0,
        high=0.5,
    )
    release_time: float = parameter(
        0.15,
        "After a stop that room must have been there for so long",
        unit="s",
        low=0.0,
        high=10.0,
    )
    max_joint_age: float = parameter(
        0.1, "Joint states older than this stop the robot", unit="s", low=0.01, high=2.0
    )
    joint_speed_error: float = parameter(
        0.15,
        "Joint speeds that differ by more from what the joint angles of 20 ms make of them stop the robot: "
        "S_r and S_s would be too small with them",
        unit="rad/s",
        low=0.01,
        high=5.0,
    )
    max_sample_age: float = parameter(
        0.085,
        "An arm that has not been seen for so long stops the robot",
        unit="s",
        low=0.02,
        high=2.0,
    )
    max_future: float = parameter(
        0.005,
        "Stamps farther ahead of the clock than that are refused, of people, joints and controller alike. "
        "At most stamp_error, which is to cover what clocks differ by",
        unit="s",
        low=0.0,
        high=0.1,
    )
    max_prediction_age: float = parameter(
        0.1,
        "A prediction whose newest sample is older than that says nothing",
        unit="s",
        low=0.02,
        high=1.0,
    )
    doubt_time: float = parameter(
        0.2,
        "A limb that jumps, faster than plausible_speed, is reckoned with for so long also where it was",
        unit="s",
        low=0.0,
        high=5.0,
    )
    plausible_speed: float = parameter(8.0, "No hand is faster", unit="m/s", low=1.0, high=50.0)
    leaving_time: float = parameter(
        0.5,
        "A person whom motion capture no longer lists is reckoned with for so long all the same, as fast "
        "as assumed",
        unit="s",
        low=0.0,
        high=5.0,
    )
    arms: str = parameter(
        BOTH,
        "Which arms of a person must have been seen before the robot moves. seen: one will do, where no "
        "more are tracked; `intrusion` is then to cover the other",
        choices=(BOTH, SEEN),
    )
    leave_distance: float = parameter(
        0.5,
        "Who was nearer to the robot than that when they were seen last, or since, is not forgotten though "
        "no longer listed: the robot rests until they are listed and seen again, or the monitor is started "
        "anew. Capture sees the way out of somebody who leaves, not of one who is lost beside the robot",
        unit="m",
        low=0.0,
        high=5.0,
    )
    require_tracking: bool = parameter(
        True,
        "Do not let the robot move unless a source says who is tracked (an empty list is an answer)",
    )
    max_list_age: float = parameter(
        0.12,
        "A source that has not said who is tracked for so long is gone, or hangs: somebody may be there "
        "whom nobody lists, and the robot rests",
        unit="s",
        low=0.02,
        high=10.0,
    )

    def __post_init__(self) -> None:
        """Check the ranges."""
        validate(self)
