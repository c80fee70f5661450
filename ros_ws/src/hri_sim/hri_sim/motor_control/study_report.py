"""The text of ``motor_control.md``: the thesis' figures beside ours."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hri_prediction.motor_control.analyses.discomfort import SIX, THREE
from hri_prediction.motor_control.costs import CHAPTER_2, CHAPTER_3
from hri_prediction.motor_control.results_table import markdown
from hri_prediction.results.origin import origin_line
from hri_sim.motor_control import thesis
from hri_sim.motor_control.chapter_2 import COMPOSITE
from hri_sim.motor_control.differences import differences


def report(content: Mapping[str, Any]) -> str:
    """The whole text."""
    study, smoke = content["study"], " --smoke" if content["smoke"] else ""
    parts: Sequence[Callable[[Mapping[str, Any]], list[str]]] = (
        _errors, _contributions, _selection, _discomfort, _components, _behaviour, _chapter_3, _real,
    )  # fmt: skip
    text = [
        "# Why people reach as they do: the thesis' analyses\n",
        f"Made by `scripts/reproduce_motor_control.py --seed {study['seed']} --people "
        f"{study['people']}{smoke}`.\n",
        f"{origin_line(content['origin'])}\n",
        f"{study['people']} simulated people reached from {study['starts']} postures to "
        f"{study['targets']} targets, three times each, seen by motion capture with 3 mm of "
        "noise. Each has an arm, a pace, postures and a law of weights of their own, drawn "
        "about the thesis' means; they do not roll the shoulder, and their weights are mixes of "
        "hand jerk, joint jerk, torque change and energy. The thesis' recordings are not "
        "public: its figures stand beside ours, and where they differ it may be the people. "
        "What simulated people show is whether the analyses find what was put in.\n",
    ]
    for part in parts:
        text += part(content)
    return "\n".join(text) + "\n"


def _spread(values: Mapping[str, float | None], digits: int = 2) -> str:
    if values["mean"] is None:
        return "–"
    return f"{values['mean']:.{digits}f} ± {values['sd']:.{digits}f}"


def _p(value: float | None) -> str:
    if value is None or value != value:
        return "–"
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


def _f(effect: Mapping[str, Any] | None) -> str:
    if effect is None:
        return "–"
    return f"F({effect['df1']}, {effect['df2']}) = {effect['f']:.1f}, p {_sign(effect['p'])}"


def _sign(p: float) -> str:
    return "< 0.001" if p < 0.001 else f"= {p:.3f}"


def _name(cost: str) -> str:
    return cost.replace("_", " ")


def _errors(content: Mapping[str, Any]) -> list[str]:
    found = content["chapter_2"]["errors"]
    rows = [
        (
            _name(cost),
            thesis.HAND_CM[cost],
            _spread(found["hand_cm"][cost]),
            _f(found["hand_cm_anova"].get(cost)),
            thesis.JOINTS_DEG[cost],
            _spread(found["joint_deg"][cost]),
            _f(found["joint_deg_anova"].get(cost)),
        )
        for cost in (*CHAPTER_2, COMPOSITE)
    ]
    head = (
        "cost", "thesis: hand [cm]", "hand [cm]", "beside the mix", "thesis: joints [deg]",
        "joints [deg]", "beside the mix",
    )  # fmt: skip
    return [
        "## How near optima come (figures 2.3 and 2.7)\n",
        f"Dynamic time warping, by sample; mean ± standard deviation over {found['n']} mean "
        f"reaches. The mix is no farther than the best single cost in {found['not_worse']} of "
        f"{found['n']}. Beside the mix: repeated measures of each person's means; the thesis "
        "took each reach for an independent one (F(1, 1200) of 111 to 4171), which they are not.\n",
        markdown(head, rows),
        "![errors](motor_control/errors.png)\n",
        "![single costs](motor_control/single_costs.png)\n",
    ]


def _range(found: Mapping[str, Any]) -> str:
    """An interval in brackets; empty of too few people for one."""
    return "" if found["low"] is None else f" ({found['low']:.2f} to {found['high']:.2f})"


def _effects(effects: Sequence[Mapping[str, Any]] | None) -> str:
    if effects is None:
        return "–"
    first = effects[0]
    people = first["df2"] // first["df1"] + 1  # F(a - 1, (a - 1)(n - 1))
    said = ", ".join(
        f"{e['f']:.1f}{'' if e['p'] < 0.05 else ' (n. s.)'}{'' if e['p_least'] < 0.05 else '°'}"
        for e in effects
    )
    return f"{said} [{people}]"


def _contributions(content: Mapping[str, Any]) -> list[str]:
    found, known = content["chapter_2"]["contributions"], content["chapter_2"]["recovery"]
    rows = [
        (
            _name(cost),
            thesis.ALPHA.get(cost, "–"),
            _spread(found[cost]),
            thesis.EFFECTS[cost],
            _effects(found[cost]["anova"]),
        )
        for cost in (*CHAPTER_2, "dynamic")
    ]
    head = ("cost", "thesis: weight", "weight", "thesis: F of start, target, both", "F")
    return [
        "## Which costs have a part (section 2.3.2)\n",
        "Two-way analysis of variance with repeated measures. n. s.: p ≥ 0.05; °: not "
        "significant with the smallest degrees of freedom that a lack of sphericity leaves; in brackets "
        f"of how many of {content['study']['people']} people: of those with a value for every task.\n",
        markdown(head, rows),
        f"Of weights that are known here: those found for one reach are off by "
        f"{known['median_largest_error']:.2f} (median of the largest error), explain "
        f"{known['r2']:.2f} of the variance of the true ones, and lie at zero in "
        f"{100 * known['share_at_zero']:.0f} %; the true weight lies within the 95 % interval of "
        f"{100 * known['covered_95']:.0f} % of those that do not. The share of dynamic costs correlates "
        f"with the true one by r = {known['dynamic_correlation']:.2f}. Single reaches say "
        "little, then, and effects on weights are effects on estimates, whose errors depend on "
        "posture, too.\n",
    ]


def _selection(content: Mapping[str, Any]) -> list[str]:
    rows = [
        (
            ", ".join(map(_name, model["names"])),
            f"{model['hand_cm']:.2f}",
            f"{model['aic']:.0f}",
            f"{model['bic']:.0f}",
            f"{model['likelihood_aic']:.0f}",
            f"{model['likelihood_bic']:.0f}",
            _p(model["shapiro_p"]),
        )
        for model in content["chapter_2"]["models"]
    ]
    head = ("costs", "hand [cm]", "AIC", "BIC", "AIC, paths", "BIC, paths", "normal (p)")
    return [
        "## How many costs (section 2.2.6)\n",
        f"Reaches of {content['chapter_2']['models_person']}; smaller is better. AIC and BIC as "
        "the thesis counts: one distance a reach, one parameter a cost. A distance by dynamic "
        "time warping is no residual of a likelihood; *paths* are all coordinates of all "
        "independent samples, with all weights of all reaches. Normal: Shapiro and Wilk of the "
        "distances; the thesis did not reject it. It preferred four costs.\n",
        markdown(head, rows),
    ]


def _discomfort(content: Mapping[str, Any]) -> list[str]:
    found, larger = content["chapter_2"]["discomfort"], content["chapter_3"]["discomfort"]
    rows = [
        ("(2.21), all reaches", "–", f"{found[SIX]['r2']:.2f}", f"{found[SIX]['chance_r2']:.3f}"),
        (
            "the same, smoothed as in the thesis",
            "0.52",
            f"{found[SIX]['smoothed_r2']:.2f}",
            f"{found[SIX]['smoothed_chance_r2']:.2f}",
        ),
        (
            "(3.5), all reaches",
            "–",
            f"{found[THREE]['r2']:.2f}",
            f"{found[THREE]['chance_r2']:.3f}",
        ),
        ("(3.5), mean reaches", "–", f"{larger['r2']:.2f}", f"{larger['chance_r2']:.3f}"),
    ]
    if "truth_r2" in found:
        truth = f"{found['truth_r2']:.2f}", f"{found['truth_chance_r2']:.3f}"
        rows.append(("(2.21), true weights", "–", *truth))
    people = [each["r2"] for each in found["people"].values()]
    above = sum(each["p"] < 0.05 for each in found["people"].values())
    beta = ", ".join(f"{value:.2f}" for value in found[SIX]["beta"])
    return [
        "## Discomfort (figures 2.9 and 3.7)\n",
        "How much of the share of dynamic costs a discomfort that is linear in joint angles "
        "explains, beside what 95 % of random orders of the same shares stay below, in which whole tasks "
        "change places, the same ones in all people.\n",
        markdown(("discomfort", "thesis: R²", "R²", "chance"), rows),
        f"β of (2.21): {beta}. β of (3.5) for the mean reaches: {larger['beta'][1]:.2f}, "
        f"{larger['beta'][2]:.2f} (thesis: 0.82, −0.45). Person by person: R² from {min(people):.2f} to "
        f"{max(people):.2f}, more than chance for {above} of {len(people)}.\n",
        "![discomfort](motor_control/discomfort.png)\n",
        "![transitions](motor_control/transitions.png)\n",
    ]


def _components(content: Mapping[str, Any]) -> list[str]:
    found = content["chapter_2"]["components"]
    ratios = ", ".join(f"{100 * ratio:.0f}" for ratio in found["ratios"])
    linked = ", ".join(f"{r:.2f}" for r in found["correlation_with_dynamic"])
    return [
        "## Principal components of postures (figure 2.8)\n",
        f"Of the six joint angles at both ends: {ratios} % of the variance; the first three "
        f"{100 * found['first_three']:.0f} % (thesis: 64 %). Their correlations with the share "
        f"of dynamic costs: {linked}.\n",
    ]


def _behaviour(content: Mapping[str, Any]) -> list[str]:
    found = content["chapter_2"]["behaviour"]
    rows = []
    for name, linked in thesis.CORRELATION.items():
        pooled = found["correlations"][name]["pooled"]
        own = list(found["correlations"][name]["people"].values())
        rows.append(
            (
                name,
                linked,
                f"{pooled['r']:.2f}{_range(pooled)}",
                f"{min(own):.2f} to {max(own):.2f}",
                thesis.BEHAVIOUR[name],
                _effects(found["anova"][name]),
            )
        )
    head = (
        "quantity", "thesis: r with distance", "r, 95 % over people", "person by person",
        "thesis: F of start, target, both", "F",
    )  # fmt: skip
    kinds = list(next(iter(found["ends"].values())))
    ends = [
        (
            target,
            *(
                f"{_p(theirs)}; {_p(found['ends'][target][kind]['p'])}"
                for kind, theirs in zip(kinds, thesis.ENDS_P[target], strict=True)
            ),
        )
        for target in found["ends"]
    ]
    digits = {"duration_s": 2, "distance_m": 3, "mean_speed": 2, "peak_speed": 2}
    kinematics = [
        (
            target,
            *(
                f"{theirs}; {_spread(row[name], digits[name])}"
                for name, theirs in zip(digits, thesis.FROM_FIRST[target], strict=True)
            ),
        )
        for target, row in found["from_first"].items()
    ]
    return [
        "## How they reach (tables 2.3 and 2.4, figure 2.5)\n",
        markdown(head, rows),
        "From P1, mean ± standard deviation over people, of the thesis (table 2.4); of ours. Reaches are "
        "cut at 5 % of the peak speed:\n",
        markdown(
            ("target", "duration [s]", "distance [m]", "mean speed [m/s]", "peak speed [m/s]"),
            kinematics,
        ),
        "Whether the start posture changes where and how reaches end (p of one-way repeated measures, of "
        "the thesis (table 2.3); of ours. Simulated people end where they mean to, so p < 0.05 is chance "
        "there, one in twenty; of the thesis' people it does change q2 and q3 for most targets):\n",
        markdown(("target", *kinds), ends),
    ]


def _chapter_3(content: Mapping[str, Any]) -> list[str]:
    found = content["chapter_3"]
    errors, heights = found["errors"], found["heights"]
    rows = [
        (
            _name(cost),
            *(
                text
                for key in ("hand_cm", "joint_deg", "joint_deg_without_T1")
                for text in (_spread(errors[key][cost]), _p(errors[f"{key}_p"].get(cost)))
            ),
        )
        for cost in (*CHAPTER_3, COMPOSITE)
    ]
    factors = [effect["source"] for effect in next(iter(found["influences"].values()))]
    of_thesis = dict(zip(("q1_start", "q2_start", "q3_start", "target"), range(4), strict=True))
    influence = [
        (
            _name(cost),
            *(
                f"{thesis.INFLUENCES_F[cost][of_thesis[e['source']]]}; {e['f']:.1f} ({_p(e['p'])})"
                for e in effects
            ),
        )
        for cost, effects in found["influences"].items()
    ]
    moved = (
        "–"
        if heights["mean"] is None
        else f"{heights['mean']:+.2f} (p {_p(heights['p'])} over people)"
    )
    return [
        "## The larger design (figure 3.5, table 3.3, figure 3.6)\n",
        f"The mean reach of all people for each of {errors['n']} tasks, explained by five costs; "
        "p of paired tests beside the mix. These tests, and those below, take tasks for independent, as "
        "the thesis' do; all are of the same people and many of the same posture, so that p are smaller "
        "than they should be.\n",
        markdown(("cost", "hand [cm]", "p", "joints [deg]", "p", "without T1 [deg]", "p"), rows),
        "![mean errors](motor_control/mean_errors.png)\n",
        "What weights depend on: F (p) of an analysis of variance of independent tasks, of the thesis "
        "(table 3.3); of ours. The thesis found q1 and q2 at the start, and the target for the dynamic "
        "costs alone, never q3.\n",
        markdown(("cost", *map(_name, factors)), influence),
        f"Share of dynamic costs of low targets less that of high ones, from P1, for each of three columns "
        f"of targets: {moved}. The thesis found people to differ, some considerably. So do these; but of a "
        "single reach the share is hardly known (above), and three differences of it are not how people "
        "are.\n",
        markdown(
            ("person", "mean", "least", "largest"),
            [
                (person, *(f"{value:+.2f}" for value in (sum(own) / len(own), min(own), max(own))))
                for person, own in heights["changes"].items()
                if own
            ],
        ),
    ]


def _left_out(convention: str, lines: Sequence[str]) -> list[str]:
    """Which reaches could not be used with a convention of joint angles, if there are such."""
    return (
        ["", f"Left out, `{convention}`:\n", *(f"- {line}" for line in lines), ""] if lines else []
    )


def _real(content: Mapping[str, Any]) -> list[str]:
    found = content["real"]
    head = "## Real reaches\n"
    if "skipped" in found:
        return [head, f"Left out: {found['skipped']}.\n"]
    errors, tasks = found["errors"], found["by_task"]
    rows = [
        (
            _name(cost),
            thesis.HAND_CM[cost],
            _spread(errors["hand_cm"][cost]),
            thesis.JOINTS_DEG[cost],
            _spread(errors["joint_deg"][cost]),
        )
        for cost in (*CHAPTER_2, COMPOSITE)
    ]
    weights = [
        (
            _name(cost),
            thesis.ALPHA.get(cost, "–"),
            *(
                f"{each['mean']:.2f} ({each['low']:.2f} to {each['high']:.2f})"
                for each in found["by_task"]["weights"][cost].values()
            ),
            _p(tasks["differ_p"].get(cost)),
        )
        for cost in (*CHAPTER_2, "dynamic")
    ]
    left = f" {len(found['left_out'])} could not be used." if found["left_out"] else ""
    return [
        head,
        f"{errors['n']} reaches of {tasks['people']} people of `reach_adl_vicon` "
        "(MiaH-kin/UE_ADLdatabase, MIT), forward and across, with either arm, seated at a table, each "
        f"explained by itself.{left} Joint angles are counted by `{found['convention']}`, whose "
        f"model comes nearest to elbow and wrist: {found['misfit_cm']:.1f} cm (median), where "
        f"that of the thesis, `yaw_pitch`, stays {found['misfit_cm_yaw_pitch']:.1f} cm off. A "
        "real shoulder rolls; the model's does not.\n",
        markdown(
            ("cost", "thesis: hand [cm]", "hand [cm]", "thesis: joints [deg]", "joints [deg]"), rows
        ),
        f"The mix is no farther than the best single cost in {errors['not_worse']} of {errors['n']}.\n",
        f"One cost alone explains {100 * found['at_vertex']:.0f} % of them as well as any mix "
        f"does; the weights of the others have a standard deviation of {found['sd_median']:.2f} "
        "(median), taking what is left over for noise. That is too little, as reaches are cut: of the "
        "simulated ones, whose weights are known, the true one lies within so wide an interval of 95 % in "
        f"{100 * content['chapter_2']['recovery']['covered_95']:.0f} %. Weights, with 95 % intervals of "
        "the mean over people, and p of a paired test (Wilcoxon) between tasks:\n",
        markdown(
            ("cost", "thesis: weight", *tasks["tasks"], "differ (p)"),
            weights,
        ),
        "![real weights](motor_control/real_weights.png)\n",
        "![real errors](motor_control/real_errors.png)\n",
        differences(found),
        *_left_out(found["convention"], found["left_out"]),
        *_left_out("yaw_pitch", found["left_out_yaw_pitch"]),
    ]
