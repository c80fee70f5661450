from hypothesis import given
from hypothesis import strategies as st
from rclpy.validate_full_topic_name import validate_full_topic_name

from hri_prediction.arm.body_id import valid_body_id
from hri_prediction.ros.arm_bag import body_id_of


def test_names_of_bodies():
    good = ("person1", "Ann_B", "_x", "a__b", "x" * 64)
    assert all(valid_body_id(name) for name in good)
    for name in good:
        validate_full_topic_name(f"/humans/bodies/{name}/prediction")
    bad = ("", "1st", "body-7", "my body", "a/b", "~", "{x}", "ann\n", "é", "x" * 65)
    assert not any(valid_body_id(name) for name in bad)


@given(st.text(max_size=200))
def test_every_person_gives_a_name(subject):
    assert valid_body_id(body_id_of(subject))
