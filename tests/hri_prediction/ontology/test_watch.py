"""Two arms watched: segments and their features, live and offline, and what goes wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from two_arms import arm_track

from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.cutting import merged, segments_of
from hri_prediction.ontology.features import EXCHANGED, pair_features
from hri_prediction.ontology.segment import Segment
from hri_prediction.ontology.watch import SILENT_S, DyadWatch
from hri_prediction.tracks.segmentation import find_reaches
from hri_prediction.tracks.track import ArmTrack

Spoil = Callable[[np.ndarray], np.ndarray]

A = arm_track([(0.5, 0.8, 0.3), (2.0, 0.8, -0.3)], 3.5)
B = arm_track([(0.7, 0.9, 0.2)], 3.5, away=0.6, name="b")


def watched(tracks: tuple[ArmTrack, ArmTrack], watch: DyadWatch | None = None) -> list[Segment]:
    watch = watch or DyadWatch()
    return [s for agent, sample in merged(tracks) for s in watch.push(agent, sample)]


def newest(watch: DyadWatch) -> tuple[int, np.ndarray]:
    """The newest features, which there are."""
    found = watch.now()
    assert found is not None
    return found


def test_segments_are_the_reaches_of_either_wrist() -> None:
    found = segments_of((A, B))
    for agent, track in enumerate((A, B)):
        wanted = find_reaches(track.time_s, track.keypoints[:, 2])
        own = [segment for segment in found if segment.agent == agent]
        assert len(own) == len(wanted) == (2, 1)[agent]
        for segment, reach in zip(own, wanted, strict=True):
            assert segment.onset_ns == pytest.approx(reach.onset_s * 1e9, abs=1e3)
            assert segment.end_ns == pytest.approx(reach.end_s * 1e9, abs=1e3)


def test_features_are_the_means_over_the_segment_of_whoever_moves_first() -> None:
    for segment in segments_of((A, B)):
        instants = (
            np.arange(np.ceil(segment.onset_ns / 2e7), np.floor(segment.end_ns / 2e7) + 1) * 0.02
        )
        points = [
            np.array(
                [np.interp(instants, t.time_s, column) for column in t.keypoints.reshape(-1, 12).T]
            ).T.reshape(-1, 4, 3)
            for t in (A, B)
        ]
        wanted = pair_features(*points).mean(axis=0)
        assert segment.features is not None
        found = segment.features[EXCHANGED] if segment.agent else segment.features
        np.testing.assert_allclose(found, wanted, atol=2e-4)


def test_live_is_offline_whatever_the_order_of_arrival() -> None:
    offline = segments_of((A, B))
    watch, late = DyadWatch(), []
    held: list = []
    found: list[Segment] = []
    for agent, sample in merged((A, B)):
        late.append((agent, sample))
        # Samples of b come 40 ms after those of a.
        if agent == 1:
            held.append(sample)
            if len(held) > 10:
                found += watch.push(1, held.pop(0))
        else:
            found += watch.push(0, sample)
    for sample in held:
        found += watch.push(1, sample)
    found += watch.finish()
    assert sorted((s.agent, s.onset_ns, s.end_ns) for s in found) == sorted(
        (s.agent, s.onset_ns, s.end_ns) for s in offline
    )
    by_time = {(s.agent, s.onset_ns): s.features for s in found}
    for segment in offline:
        np.testing.assert_array_equal(by_time[segment.agent, segment.onset_ns], segment.features)


def test_it_does_not_matter_when_watching_began() -> None:
    whole = segments_of((A, B))
    later = segments_of((A.slice(0.3, 3.5), B.slice(0.3, 3.5)))
    assert len(whole) == len(later)
    for one, other in zip(whole, later, strict=True):
        assert one.onset_ns == pytest.approx(other.onset_ns, abs=1e3)
        np.testing.assert_allclose(one.features, other.features, atol=1e-9)


def test_a_segment_is_told_soon_after_its_end() -> None:
    watch = DyadWatch()
    rest_s = watch.segmentation.rest_time + 0.5 * watch.segmentation.window
    for agent, sample in merged((A, B)):
        for segment in watch.push(agent, sample):
            assert sample.stamp_ns - segment.end_ns < (rest_s + 0.05) * 1e9


# Hardly faster than what begins a movement: half its greatest speed is that of an end.
SLOW = arm_track([(0.5, 1.2, 0.06)], 3.5)


@pytest.mark.parametrize("track", [A, SLOW])
def test_what_is_about_to_end_is_known_to_be(track: ArmTrack) -> None:
    ends = [(segment.agent, segment.end_ns) for segment in watched((track, B))]
    assert {agent for agent, _ in ends} == {0, 1}
    watch = DyadWatch()
    ending: dict[tuple[int, int], bool] = {}
    for agent, sample in merged((track, B)):
        watch.push(agent, sample)
        ending |= {(who, sample.stamp_ns): watch.ending(who) for who in (0, 1)}
        assert watch.moving(0) or not watch.ending(0)
    for who, end_ns in ends:
        soon = [told for (one, ns), told in ending.items() if one == who and 0 <= ns - end_ns < 6e7]
        assert len(soon) > 5
        assert all(soon)
    # Not all the time.
    assert 0.1 < np.mean([told for (who, _), told in ending.items() if who == 0]) < 0.4


def test_what_is_under_way_is_known_so_far() -> None:
    watch = DyadWatch()
    seen = {False: 0, True: 0}
    for agent, sample in merged((A, B)):
        watch.push(agent, sample)
        running = watch.running(0)
        assert (running is None) == (not watch.moving(0))
        seen[watch.moving(0)] += 1
        if running is not None:
            until_ns, features = running
            assert features.shape == (25,)
            assert np.isfinite(features).all()
            assert 0 < watch.onset_ns(0) < sample.stamp_ns
            # Not behind the samples by as much as smoothing asks for: the two have come alternately.
            assert 0 <= sample.stamp_ns - until_ns < 1e9 * (watch.config.step + 0.012)
    assert min(seen.values()) > 100
    stamp_ns, features = newest(watch)
    assert stamp_ns == pytest.approx(3.48e9)
    assert features.shape == (25,)
    assert watch.onset_ns(0) == 0


def test_what_it_looks_like_by_its_end_is_nearly_what_it_was() -> None:
    """By the last sample before the end, though smoothing asks for later ones."""
    watch = DyadWatch()
    so_far: dict[tuple[int, int], np.ndarray] = {}
    found = []
    for agent, sample in merged((A, B)):
        found += watch.push(agent, sample)
        for who in (0, 1):
            running = watch.running(who)
            if running is not None:
                so_far[who, sample.stamp_ns] = running[1]
    assert len(found) == 3
    for segment in found:
        last = max(ns for who, ns in so_far if who == segment.agent and ns <= segment.end_ns)
        assert segment.features is not None
        np.testing.assert_allclose(so_far[segment.agent, last], segment.features, atol=2e-3)


def test_rest_after_a_movement_is_no_part_of_it() -> None:
    """That it is over is certain 0.2 s later only."""
    watch = DyadWatch()
    last: dict[int, tuple[int, np.ndarray]] = {}
    found = []
    for agent, sample in merged((A, B)):
        for who in (0, 1):
            running = watch.running(who)
            if running is not None:
                last[who] = running
        for segment in watch.push(agent, sample):
            until_ns, features = last[segment.agent]
            assert until_ns > segment.end_ns + 0.1e9
            assert segment.features is not None
            np.testing.assert_allclose(features, segment.features, atol=2e-3)
            found.append(segment)
    assert len(found) == 3


def test_who_is_not_seen_is_not_waited_for() -> None:
    gone = dataclasses.replace(
        B, keypoints=np.where(B.time_s[:, None, None] < 0.6, B.keypoints, np.nan)
    )
    reasons = {s.agent: s.reason for s in watched((A, gone.slice(0.0, 0.6)))}
    assert "both arms were seen for" in reasons[0]
    assert all(s.features is None for s in watched((A, gone)))


def test_a_short_absence_does_not_matter() -> None:
    points = B.keypoints.copy()
    points[(B.time_s > 0.9) & (B.time_s < 1.05), 3] = np.nan  # the hand tip only
    found = segments_of((A, dataclasses.replace(B, keypoints=points)))
    assert [s.reason for s in found] == ["", "", ""]


def test_an_arm_that_is_lost_on_its_way() -> None:
    points = A.keypoints.copy()
    points[(A.time_s > 0.8) & (A.time_s < 1.1)] = np.nan
    first = watched((dataclasses.replace(A, keypoints=points), B))[0]
    assert first.features is None
    assert first.reason == "the arm was lost sight of"


def test_an_arm_that_stays_lost_on_its_way_is_told_of_at_once() -> None:
    points = A.keypoints.copy()
    points[A.time_s > 0.8] = np.nan
    watch, told = DyadWatch(), []
    for agent, sample in merged((dataclasses.replace(A, keypoints=points), B)):
        told += [(sample.stamp_ns, segment) for segment in watch.push(agent, sample)]
        if sample.stamp_ns > 0.95e9:
            assert not watch.moving(0)
    (when_ns, first), *others = told
    assert (first.agent, first.reason) == (0, "the arm was lost sight of")
    assert first.end_ns == pytest.approx(0.8e9, abs=5e6)
    assert when_ns < 0.95e9
    assert {segment.agent for _, segment in others} == {1}


def looks(watch: DyadWatch, since_ns: int, until_ns: int) -> list[tuple[int, Segment]]:
    """What a look every 8 ms finds, and when."""
    times = range(since_ns + 8_000_000, until_ns, 8_000_000)
    return [(now_ns, segment) for now_ns in times for segment in watch.look(now_ns)]


@pytest.mark.parametrize(("until_s", "reason"), [(1.34, ""), (0.9, "the arm was lost sight of")])
@pytest.mark.parametrize("both", [True, False])
@pytest.mark.parametrize("again", [True, False])
def test_a_silence_is_the_end(until_s: float, reason: str, both: bool, again: bool) -> None:
    """Live, by the clock, and in a recording, by what comes after the silence, or by its end."""
    still = arm_track([], 3.5, away=0.6, name="b")
    tracks = (A, still)
    silent = (0, 1) if both else (0,)
    samples = [
        (agent, sample)
        for agent, sample in merged(tracks)
        if agent not in silent
        or sample.stamp_ns <= until_s * 1e9
        or (again and sample.stamp_ns > 2.0e9)
    ]
    recorded, live = DyadWatch(), DyadWatch()
    offline = [s for one in samples for s in recorded.push(*one)] + recorded.finish()
    found, told_ns = [], 0
    stamps = [sample.stamp_ns for _, sample in samples]
    for before_ns, (agent, sample) in zip([0, *stamps], samples, strict=False):
        segments = looks(live, before_ns, sample.stamp_ns)
        told_ns = told_ns or (segments[0][0] if segments else 0)
        found += [segment for _, segment in segments] + live.push(agent, sample)
    segments = looks(live, stamps[-1], stamps[-1] + 1_000_000_000)
    told_ns = told_ns or (segments[0][0] if segments else 0)
    found += [segment for _, segment in segments]
    first, *_ = found
    assert (first.agent, first.reason) == (0, reason)
    assert first.onset_ns < first.end_ns <= until_s * 1e9
    if both:
        assert 0.0 <= told_ns * 1e-9 - until_s - SILENT_S < 0.02
    assert len(found) == len(offline) == (2 if again else 1)
    for one, other in zip(found, offline, strict=True):
        assert (one.agent, one.onset_ns, one.end_ns) == (other.agent, other.onset_ns, other.end_ns)
        assert one.reason == other.reason
        if one.features is not None:
            np.testing.assert_array_equal(one.features, other.features)


def moved(keypoint: int, *way: float) -> Spoil:
    """One of the keypoints elsewhere."""

    def spoil(points: np.ndarray) -> np.ndarray:
        found = points.copy()
        found[keypoint] += way
        return found

    return spoil


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (moved(0, 0.0, 0.0, 0.5), "jump: shoulder"),
        (moved(1, 0.0, 0.0, 0.5), "jump: elbow"),
        (moved(3, 0.5, 0.0, 0.0), "jump: hand tip"),
        (lambda points: points[[0, 2, 1, 3]], "markers swapped"),
    ],
)
def test_keypoints_that_cannot_be_do_not_count(spoil: Spoil, said: str) -> None:
    """Mistaken for others for a moment in mid-movement: told, and the movement is what it was without."""
    points = A.keypoints.copy()
    for row in np.flatnonzero((A.time_s > 0.85) & (A.time_s < 0.9)):
        points[row] = spoil(points[row])
    watch, odd, found = DyadWatch(), set(), []
    for agent, sample in merged((dataclasses.replace(A, keypoints=points), B)):
        found += watch.push(agent, sample)
        odd |= {watch.odd} - {""}
    assert any(text.startswith(said) for text in odd)
    wanted = segments_of((A, B))
    assert [s.reason for s in found + watch.finish()] == [s.reason for s in wanted] == [""] * 3
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one.features, other.features, atol=2e-3)


def test_an_arm_of_other_lengths_does_not_count_from_then_on() -> None:
    """Markers that stay mistaken: no case is told of such an arm, and why is said."""
    points = A.keypoints.copy()
    points[A.time_s > 0.9, 1] += (0.0, 0.0, 0.4)
    watch, found, odd = DyadWatch(), [], ""
    for agent, sample in merged((dataclasses.replace(A, keypoints=points), B)):
        found += watch.push(agent, sample)
        odd = odd if agent else watch.odd
    assert odd.startswith("implausible length: shoulder-elbow 0.")
    assert all(s.features is None for s in found if s.agent == 0)


def test_identities_that_swap_at_rest_are_told_of() -> None:
    watch = DyadWatch()
    jumps = []
    for agent, sample in merged((A, B)):
        if sample.stamp_ns > 0.3e9:
            break
        swapped = 1 - agent if sample.stamp_ns > 0.2e9 else agent
        watch.push(swapped, sample)
        jumps.append(watch.jump)
    told = [jump for jump in jumps if jump]
    assert len(told) == 2
    assert all(jump.startswith("the wrist jumped by ") for jump in told)


def test_identities_that_swap_end_what_is_under_way() -> None:
    swap = A.time_s > 1.0
    one = np.where(swap[:, None, None], B.keypoints, A.keypoints)
    other = np.where(swap[:, None, None], A.keypoints, B.keypoints)
    found = segments_of(
        (dataclasses.replace(A, keypoints=one), dataclasses.replace(B, keypoints=other))
    )
    assert [s.reason.partition(" by ")[0] for s in found[:2]] == [
        "the wrist jumped", "the other one's wrist jumped"
    ]  # fmt: skip
    # What comes after is as it was, the agents exchanged.
    last = next(s for s in segments_of((A, B)) if s.onset_ns > 1.5e9)
    assert (found[-1].agent, found[-1].reason) == (1, "")
    np.testing.assert_allclose(found[-1].features, last.features, atol=1e-9)


@pytest.mark.parametrize("gap_s", [0.0, 0.02, 0.05, 0.08, 0.096])
@pytest.mark.parametrize("away", [0.3, 0.45, 0.7])
@pytest.mark.parametrize("when_s", [0.75, 0.9, 1.05])
def test_identities_that_swap_while_markers_are_lost(
    gap_s: float, away: float, when_s: float
) -> None:
    """No speed is too high then: no movement may have distances to both in it all the same."""
    a = arm_track([(0.5, 0.8, 0.3)], 2.5, noise=0.0005)
    b = arm_track([(0.6, 0.8, -0.2)], 2.5, away=0.3 + away, noise=0.0005, name="b")
    swap = a.time_s > when_s
    lost = swap & (a.time_s <= when_s + gap_s)
    one = np.where(swap[:, None, None], b.keypoints, a.keypoints)
    other = np.where(swap[:, None, None], a.keypoints, b.keypoints)
    one[lost], other[lost] = np.nan, np.nan
    found = segments_of(
        (dataclasses.replace(a, keypoints=one), dataclasses.replace(b, keypoints=other))
    )
    swap_ns = when_s * 1e9
    across = [s for s in found if s.onset_ns < swap_ns < s.end_ns - 1e8 and s.features is not None]
    assert not across, across
    assert any("jumped" in s.reason for s in found)


@pytest.mark.parametrize("hidden_s", [0.2, 0.5, 0.8])
def test_a_wrist_that_is_hidden_for_long_and_stops_meanwhile_has_not_jumped(
    hidden_s: float,
) -> None:
    """Where it was going then lies beyond the other one's wrist, which is nearer to where it stopped."""
    a = arm_track([(0.5, 0.8, 0.3)], 3.0)
    b = arm_track([(1.0, 1.2, -0.1)], 3.0, away=0.5, name="b")
    points = a.keypoints.copy()
    points[(a.time_s > 0.9) & (a.time_s < 0.9 + hidden_s)] = np.nan
    watch, jumps = DyadWatch(), []
    found = []
    for agent, sample in merged((dataclasses.replace(a, keypoints=points), b)):
        found += watch.push(agent, sample)
        jumps.append(watch.jump)
    found += watch.finish()
    assert not any(jumps)
    assert any(s.agent == 0 and s.reason == "the arm was lost sight of" for s in found)
    assert any(s.agent == 1 and s.end_ns > 1.9e9 for s in found)
    assert not any("jumped" in s.reason for s in found)


def test_movements_that_are_not_told_of_yet_are_broken_off_too() -> None:
    """One is over, and the other one's samples are late; the other's is under way."""
    a = arm_track([(0.5, 0.8, 0.3)], 2.5)
    b = arm_track([(0.6, 1.5, -0.1)], 2.5, away=0.65, name="b")
    watch = DyadWatch()
    moved = False
    for agent, sample in merged((a, b)):
        if agent == 1 and sample.stamp_ns > 1.2e9:
            continue
        assert watch.push(agent, sample) == []
        if moved and not watch.moving(0):
            break
        moved = watch.moving(0)
    found = watch.broken_off("enough")
    assert [(s.agent, s.reason, s.features) for s in found] == [
        (0, "enough", None),
        (1, "enough", None),
    ]
    assert found[0].end_ns == pytest.approx(1.25e9, abs=3e7)
    watch.restart()
    assert watch.broken_off("again") == []


def test_a_jump_of_the_other_one_ends_what_is_under_way() -> None:
    a = arm_track([(0.5, 1.0, 0.3)], 2.5)
    b = arm_track([], 2.5, away=0.6, name="b")
    points = b.keypoints.copy()
    points[b.time_s > 1.0] += (0.4, 0.0, 0.0)
    found = segments_of((a, dataclasses.replace(b, keypoints=points)))
    assert [s.reason for s in found] == ["the other one's wrist jumped by 0.40 m"]
    assert found[0].agent == 0


@pytest.mark.parametrize("seed", range(6))
def test_markers_that_are_lost_for_a_moment_in_a_fast_reach_have_not_jumped(seed: int) -> None:
    """Half a metre in 0.45 s: 2.1 m/s, and 14 m/s² at most; gaps of up to 0.1 s anywhere in it."""
    rng = np.random.default_rng(seed)
    a = arm_track([(0.5, 0.45, 0.5)], 2.0, noise=0.002)
    b = arm_track([], 2.0, away=0.8, name="b", noise=0.002)
    points = a.keypoints.copy()
    begin = rng.uniform(0.4, 1.0)
    points[(a.time_s > begin) & (a.time_s < begin + rng.uniform(0.02, 0.095))] = np.nan
    found = segments_of((dataclasses.replace(a, keypoints=points), b))
    assert not any("jumped" in s.reason for s in found), found
    assert any(s.agent == 0 and s.features is not None for s in found)


def test_too_short_and_too_long_are_said() -> None:
    flick = arm_track([(0.5, 0.2, 0.05)], 1.5)
    (short,) = [s for s in watched((flick, B.slice(0.0, 1.5))) if s.agent == 0]
    assert short.reason.startswith("too short: 0.")
    slow = arm_track([(0.5, 2.5, 0.6)], 4.0)
    config = WatchConfig(longest=1.0)
    found = watched((slow, arm_track([], 4.0, away=0.6)), DyadWatch(config))
    assert found[0].reason.startswith("too long: ")


def test_samples_that_come_too_seldom_say_nothing_of_movements() -> None:
    seldom = dataclasses.replace(A, time_s=A.time_s[::20], keypoints=A.keypoints[::20])
    for tracks in ((seldom, B), (B, seldom)):
        found = segments_of(tracks)
        assert found
        assert {s.kind for s in found} == {"samples come too seldom to find reaches"}
        assert all(s.features is None for s in found)


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        ("too short: 0.12 s", "too short"),
        ("the wrist jumped by 0.61 m", "the wrist jumped"),
        ("both arms were seen for 43 % of it", "both arms were seen for too little of it"),
        ("stamps of anna went back by 3.00 s", "stamps of anna went back"),
        ("samples come at 12.5 Hz, too seldom to find reaches", "samples come too seldom to find reaches"),
        ("the arm was lost sight of", "the arm was lost sight of"),
    ],
)  # fmt: skip
def test_reasons_are_counted_without_their_figures(reason: str, kind: str) -> None:
    assert Segment(0, 0, 1, None, reason).kind == kind


def test_samples_out_of_order_are_left_out_and_restarting_forgets() -> None:
    watch = DyadWatch()
    samples = list(merged((A, B)))
    for agent, sample in samples[:800]:
        watch.push(agent, sample)
    _, before = newest(watch)
    assert watch.push(0, samples[100][1]) == []
    np.testing.assert_array_equal(newest(watch)[1], before)
    watch.restart()
    assert watch.now() is None
    assert not watch.moving(0)


def test_a_long_silence_of_both_does_not_take_long() -> None:
    watch = DyadWatch()
    later = dataclasses.replace(A, time_s=A.time_s + 1e6)
    for track in (A, later):
        for agent in (0, 1):
            for sample in track.slice(track.time_s[0], track.time_s[0] + 0.5).samples(
                round(track.time_s[0] * 1e9)
            ):
                watch.push(agent, sample)
    assert newest(watch)[0] > 1e15
