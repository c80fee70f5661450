"""The text of ``hybrid.md``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hri_prediction.motor_control.results_table import markdown
from hri_prediction.results.origin import origin_line
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL, STRAIGHT

BARS_CM = {"0": 2.7, "2": 2.0, "5": 1.5}
"""After so many reaches, target and duration told, from the first guess of optimal control."""
BAR_DIVERGENCE = 0.05
BAR_END_MM = 41.0
"""Median end point of recorded reaches, within a subject, neither target nor duration told."""
BAR_P50_MS = 1.0
"""From a sample to the prediction from it."""
CALIBRATION = {50: (0.42, 0.58), 95: (0.90, 0.98)}
"""Shares of samples of recorded reaches that are to be within the central 50 % and 95 %."""
MISSED = "**missed**"
"""Verdict of a bar that is not met."""


def report(content: Mapping[str, Any]) -> str:
    """The whole text."""
    setting = content["setting"]
    smoke = " --smoke" if setting["smoke"] else ""
    text = [
        "# A first guess by optimal control, mended by a person's own reaches\n",
        f"Made by `scripts/reproduce_hybrid.py --seed {setting['seed']}{smoke}`.\n",
        f"{origin_line(content['origin'])}\n",
        f"{setting['people']} simulated people of each family reached for four targets from one "
        "posture. "
        f"Their mean paths lie {setting['offset_cm']:.0f} cm aside of where the shoulder is taken to be, "
        f"drift off by {setting['drift_cm']:.0f} cm until they end, and are {setting['scale']:.0%} "
        f"larger or smaller than measured lengths say; each reach strays from them by "
        f"{setting['variability_mm']:.0f} mm (root mean square). The predictor sees the first 30 % of "
        "a reach and predicts the rest of the wrist's path: "
        "errors are distances by dynamic time warping, by sample. "
        f"Means over people and targets, {setting['judged']} reaches each that are not learnt.\n",
    ]
    for family, found in content["families"].items():
        text += _family(family, found)
    text += _bars(content)
    text += _real(content["real"])
    text += _latency(content["latency"])
    return "\n".join(text) + "\n"


def _cm(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f} cm"


def _curve_table(found: Mapping[str, Any], kind: str) -> str:
    counts = list(found[GUESSES[0]][kind])
    head = ("first guess", *(f"after {count}" for count in counts))
    rows = [(guess, *(f"{found[guess][kind][count]:.2f}" for count in counts)) for guess in GUESSES]
    return markdown(head, rows)


def _sure_table(found: Mapping[str, Any]) -> str:
    counts = list(found[GUESSES[0]]["nll"])
    head = ("first guess", *(f"after {count}" for count in counts))
    rows = [
        (
            guess,
            *(
                f"{sure['nll'][count]:.1f}, {sure['inside50'][count]:.0%}, {sure['inside95'][count]:.0%}"
                for count in counts
            ),
        )
        for guess in GUESSES
        for sure in [found[guess]]
    ]
    return markdown(head, rows)


def _family(family: str, found: Mapping[str, Any]) -> list[str]:
    weights = found["weights"]
    text = [
        f"## Simulated people, `{family}`\n",
        "Rest of the path [cm], target and duration told (as the thesis has it):\n",
        _curve_table(found["curves"], "warped_cm"),
        "Its end point [cm], likewise:\n",
        _curve_table(found["curves"], "end_cm"),
        "Rest of the path [cm], neither told, as the node predicts:\n",
        _curve_table(found["curves"], "untold_cm"),
        "How sure predictions are: negative log density of the samples [nats, of metres], share of them "
        "within the central 50 % and 95 % of what was predicted; told:\n",
        _sure_table(found["sure"]),
        "The same, not told:\n",
        _sure_table(found["sure_untold"]),
    ]
    if weights["explained"]:
        text.append(
            f"Mean paths explained after all reaches: {weights['explained']}"
            + (f", not explained {len(weights['failed'])}" if weights["failed"] else "")
            + f". The optimum is {_cm(weights['before_cm'])} from the mean path with the weights that "
            "were expected (of a person's first target, as of anybody; of later ones, by what was found "
            f"before too), {_cm(weights['after_cm'])} with those that were found (medians)."
        )
    if weights["alpha_error_person"] is not None:
        text.append(
            "Weights of a target that was not explained yet are off by "
            f"{weights['alpha_error_people']:.3f} as guessed from all people, and by "
            f"{weights['alpha_error_person']:.3f} as guessed with what this person's other targets taught."
        )
    return [*text, ""]


def _cell(value: float, met: bool, text: str) -> str:
    return f"{value:{text}}, {'met' if met else MISSED}"


def _settled(found: Mapping[str, Any]) -> str:
    if found["median"] is None:
        return f"none of {found['tasks']} tasks"
    some = "" if found["settled"] == found["tasks"] else f", {found['settled']} of {found['tasks']}"
    return f"{found['median']:.0f}; {found['most']}{some}"


def _bars(content: Mapping[str, Any]) -> list[str]:
    families = content["families"]
    curves = {name: found["curves"] for name, found in families.items()}
    rows = [
        (
            f"rest of the path after {count} reaches [cm]",
            f"≤ {bar}",
            *(
                f"{_cell(value, value <= bar, '.2f')} ({min(people):.1f} to {max(people):.1f})"
                for name, curve in curves.items()
                for value in [curve[OPTIMAL]["warped_cm"][count]]
                for people in [families[name]["of_people_cm"][count]]
            ),
        )
        for count, bar in BARS_CM.items()
        if count in next(iter(curves.values()))[OPTIMAL]["warped_cm"]
    ]
    rows.append(
        (
            "the same before any reach, less that of the straight line [cm]",
            "< 0",
            *(
                _cell(less, less < 0.0, "+.2f")
                for curve in curves.values()
                for less in [curve[OPTIMAL]["warped_cm"]["0"] - curve[STRAIGHT]["warped_cm"]["0"]]
            ),
        )
    )
    if all(len(found["divergence"]) >= 10 for found in families.values()):
        rows.append(
            (
                "Kullback-Leibler divergence by weight of the 10th update (median)",
                f"< {BAR_DIVERGENCE}",
                *(
                    _cell(value, value < BAR_DIVERGENCE, ".4f")
                    for found in families.values()
                    for value in [found["divergence"][9]]
                ),
            )
        )
    rows.append(
        (
            "reaches until the loop asks why (median; most)",
            "–",
            *(_settled(found["until_settled"]) for found in families.values()),
        )
    )
    text = [
        "## What is asked for\n",
        "By family; target and duration told; in brackets single people. `optimal` moves as "
        "the models of the predictor do, by laws drawn as those were that its weights were fitted to; the "
        "others do not. Each of `other_laws` weighs costs in a way of their own, alike in all postures.\n",
        markdown(("what", "bar", *(f"`{name}`" for name in families)), rows),
        "Errors of each person and target by reaches seen, and the divergence of each update (like figure "
        "3.9 of the thesis); distance of the optimum to the mean path with guessed and with new weights, "
        "and the new weights (like figure 3.10), beside the true ones where people have any: what goes "
        "round something, or straight, is the optimum of none.\n",
    ]
    for name in families:
        text += [
            f"![Errors, {name}](hybrid/errors_{name}.png)\n",
            f"![Weights, {name}](hybrid/weights_{name}.png)\n",
        ]
    return text


def _real(found: Mapping[str, Any]) -> list[str]:
    if "skipped" in found:
        return ["## Recorded people\n", f"Left out: {found['skipped']}.\n"]
    text = [
        "## Recorded people\n",
        f"{found['number']} people of `reach_adl_vicon` (github.com/MiaH-kin/UE_ADLdatabase), each arm, "
        "each of two targets, up to five reaches; each reach is the first one in turn. Where a target was, "
        "is not recorded: it is taken to be the median of where the person's wrist ends in all reaches but "
        "the one that is predicted, which optimal control and the straight line are told, and other "
        "people's mean and the wide guess are not. Rest of the path [cm], target and duration told:\n",
        _curve_table(found["curves"], "warped_cm"),
        "Its end point [cm]:\n",
        _curve_table(found["curves"], "end_cm"),
        "Rest of the path [cm], neither told: which of the arm's two targets it is, and how long the reach "
        "takes, the predictor finds out:\n",
        _curve_table(found["curves"], "untold_cm"),
        "Negative log density, and share of samples within the central 50 % and 95 %; told:\n",
        _sure_table(found["sure"]),
        "The same, not told:\n",
        _sure_table(found["sure_untold"]),
        "Kullback-Leibler divergence by weight of each update (median): "
        + ", ".join(f"{value:.3f}" for value in found["divergence"])
        + f". Reaches until the loop asks why (median; most): {_settled(found['until_settled'])}.\n",
        f"Mean paths explained: {found['explained']}, the optimum {_cm(found['before_cm'])} from them "
        f"with guessed and {_cm(found['after_cm'])} with new weights (medians)."
        if found["explained"]
        else "No mean path was explained.",
    ]
    text.append(_by_others(found["others_weights"]))
    text += _real_bars(found)
    if found["not_expected"]:
        text.append(
            f"\nOf {found['not_expected']} more beginnings of a reach nothing could be expected, with the "
            "target where the others put it: these are left out."
        )
    if found["not_explained"]:
        text.append(
            "\nLeft out: "
            + "; ".join(f"{name}: {why}" for name, why in found["not_explained"].items())
            + "."
        )
    return [*text, ""]


def _real_bars(found: Mapping[str, Any]) -> list[str]:
    """What is asked for of recorded people, and the pictures of each."""
    curves, ends = found["curves"], found["untold_end_median_mm"]
    counts = list(ends)
    less = [
        curves[OPTIMAL]["warped_cm"][count] - curves[STRAIGHT]["warped_cm"][count]
        for count in counts
    ]
    rows = [
        (
            "end point, median, neither told [mm]",
            f"≤ {BAR_END_MM:.0f}",
            *(_cell(ends[count], ends[count] <= BAR_END_MM, ".0f") for count in counts),
        ),
        (
            "rest of the path, less that from the straight line [cm]",
            "< 0, before any reach",
            _cell(less[0], less[0] < 0.0, "+.2f"),
            *(f"{each:+.2f}" for each in less[1:]),
        ),
    ]
    for said, kind in (("told", "sure"), ("not told", "sure_untold")):
        for share, (low, high) in CALIBRATION.items():
            of = found[kind][OPTIMAL][f"inside{share}"]
            rows.append(
                (
                    f"samples within the central {share} %, {said}",
                    f"{low:.0%} to {high:.0%}",
                    *(_cell(of[count], low <= of[count] <= high, ".0%") for count in counts),
                )
            )
    return [
        "\nWhat is asked for, from the first guess of optimal control:\n",
        markdown(("what", "bar", *(f"after {count}" for count in counts)), rows),
        "Each arm and target, as above for simulated people:\n",
        "![Errors, recorded people](hybrid/errors_recorded.png)\n",
        "![Weights, recorded people](hybrid/weights_recorded.png)\n",
    ]


def _by_others(found: Mapping[str, Any]) -> str:
    if "skipped" in found:
        return f"\nWeights fitted to other recorded people were not tried: {found['skipped']}."
    return (
        f"\nBefore any reach was seen, with the weights that ship: {_cm(found['shipped_cm'])}; with a "
        "process of weights fitted to those that explain all *other* recorded people: "
        f"{_cm(found['others_cm'])} (means over {found['reaches']} reaches)."
    )


def _latency(found: Mapping[str, Any]) -> list[str]:
    rows: Sequence[tuple[str, ...]] = [
        (
            name,
            _cell(each["p50"], each["p50"] <= BAR_P50_MS, ".2f") if each["count"] else "–",
            f"{each['p99']:.2f}" if each["count"] else "–",
            f"{each['most']:.1f}" if each["count"] else "–",
            str(each["count"]),
            str(each["learnt"]),
            str(each["explained"]),
        )
        for name, each in found.items()
    ]
    return [
        "## Whether predictions wait\n",
        "Time from a sample to the prediction from it, all waiting included, at 250 Hz in real time, with "
        "and without the process that learns beside, in turn and back again. That process rests between "
        "reaches: it was at work where the time that it has had a processor grew from one prediction to "
        f"the next. Asked for is a median of {BAR_P50_MS:g} ms at most:\n",
        markdown(
            ("", "p50 [ms]", "p99 [ms]", "most [ms]", "predictions", "learnt", "explained"), rows
        ),
    ]
