"""Which two bodies are watched."""

from __future__ import annotations

from hri_prediction.ontology.pair import choose_pair


def test_two_are_watched() -> None:
    assert choose_pair(["b", "a"]).bodies == ("b", "a")


def test_fewer_are_not_enough() -> None:
    assert choose_pair([]).reason == "nobody is tracked; an interaction needs two"
    assert choose_pair(["a"]).reason == "only a is tracked; an interaction needs two"
    assert choose_pair(["a"]).bodies is None


def test_a_third_does_not_take_the_place_of_those_who_are_watched() -> None:
    found = choose_pair(["c", "a", "b"], before=("a", "b"))
    assert found.bodies == ("a", "b")
    assert (
        found.besides
        == "3 bodies are tracked (a, b, c): a and b are watched; set pair to watch others"
    )
    # But when one of the two has gone, it does.
    assert choose_pair(["c", "a"], before=("a", "b")).bodies == ("c", "a")


def test_who_is_asked_for_is_watched_or_missed() -> None:
    assert choose_pair(["a", "b", "c"], ("c", "a")).bodies == ("c", "a")
    assert choose_pair(["a", "b", "c"], ("c", "a")).besides == ""
    assert choose_pair(["a", "b"], ("c", "a")).reason == "c is not tracked; who is: a, b"
    assert choose_pair([], ("c", "a")).reason == "c and a are not tracked"
