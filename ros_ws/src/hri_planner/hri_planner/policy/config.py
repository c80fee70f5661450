"""How a policy moves the robot."""

from __future__ import annotations

from dataclasses import dataclass

from hri_planner.dmp.potential_field import FieldConfig
from hri_planner.policy.separation import SeparationConfig
from hri_planner.policy.tool_velocity import ToolVelocityConfig
from hri_prediction.config import parameter, validate


@dataclass(frozen=True)
class PolicyConfig:
    """Parameters of the planner that follows a policy.

    Raises:
        ConfigError: when a value is out of range.
    """

    filter: bool = parameter(
        True, "Keep the set separation, whatever the policy wants; false only in simulation"
    )
    separation: float = parameter(
        0.15,
        "Distance of the tool from the axes of the partner's limbs that is kept",
        unit="m",
        low=0.0,
        high=1.0,
    )
    hand_acceleration: float = parameter(
        8.0, "Largest acceleration of the tool", unit="m/s^2", low=0.1, high=50.0
    )
    partner_acceleration: float = parameter(
        4.0, "Acceleration that the partner's hand is taken to be capable of", unit="m/s^2", low=0.0,
        high=50.0,
    )  # fmt: skip
    approach: float = parameter(
        8.0, "Share of the room to brake in that may be used up a second: smaller brakes more gently",
        unit="1/s", low=0.1,
    )  # fmt: skip
    feedback: float = parameter(
        10.0, "Share of the tool's position error that is made up a second", unit="1/s", low=0.0
    )
    damping: float = parameter(
        ToolVelocityConfig.damping, "Damping of the inverse kinematics at a singularity, where the tool is "
        "to rest in the direction that is lost", unit="m", low=0.0,
    )  # fmt: skip
    speed_share: float = parameter(
        0.9, "Share of the joints' speed limits that is used", low=0.05, high=1.0
    )
    joint_acceleration: float = parameter(
        25.0, "Largest acceleration of a joint", unit="rad/s^2", low=0.1, high=200.0
    )
    box_margin: float = parameter(
        0.02, "Distance of all links from boxes that is kept", unit="m", low=0.0, high=0.5
    )
    table_margin: float = parameter(
        0.01, "Distance of all links from the table that is kept", unit="m", low=0.0, high=0.5
    )
    link_reach: float = parameter(
        0.12, "Distance of people within which upper and lower arm of the robot give way to them, so far "
        "as the tool's motion lets them; 0: never", unit="m", low=0.0, high=0.5,
    )  # fmt: skip
    link_gain: float = parameter(
        4.0, "Share of what is missing to that distance that is made up a second", unit="1/s", low=0.0,
        high=20.0,
    )  # fmt: skip
    field_strength: float = parameter(
        FieldConfig.strength, "Potential field of movement primitives: how strongly what is approached "
        "pushes; 0: not at all", unit="m^2/s", low=0.0, high=10.0,
    )  # fmt: skip
    field_exponent: float = parameter(
        FieldConfig.exponent, "Potential field: the larger, the less what is not straight ahead counts",
        low=2.0, high=10.0,
    )  # fmt: skip
    field_nearest: float = parameter(
        FieldConfig.nearest, "Potential field: distances of surfaces below this count as this",
        unit="m", low=1e-3, high=0.5,
    )  # fmt: skip
    arrived_speed: float = parameter(
        0.02, "Speed below which a hand at its goal counts as at rest", unit="m/s", low=1e-4
    )
    forget_speed: float = parameter(
        0.05, "Joint speed below which a new reach begins without memory of the one before",
        unit="rad/s", low=0.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)
        _ = self.separation_filter  # has a check of its own

    @property
    def separation_filter(self) -> SeparationConfig:
        """Of the filter."""
        return SeparationConfig(
            self.separation, self.hand_acceleration, self.partner_acceleration, self.approach
        )

    @property
    def field(self) -> FieldConfig:
        """The potential field."""
        return FieldConfig(self.field_strength, self.field_exponent, self.field_nearest)

    @property
    def inverse_kinematics(self) -> ToolVelocityConfig:
        """Of the joints."""
        return ToolVelocityConfig(
            feedback=self.feedback,
            damping=self.damping,
            speed_share=self.speed_share,
            joint_acceleration=self.joint_acceleration,
        )
