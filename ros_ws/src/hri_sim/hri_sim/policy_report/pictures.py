"""Pictures after the thesis' figures 5.4 to 5.6."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.integration import accelerations
from hri_planner.rnn.metrics.correlation import correlations
from hri_planner.rnn.metrics.reaching import reach_steps
from hri_planner.rnn.metrics.warping import distances
from hri_planner.rnn.model import STEP_S, PolicyModel
from hri_sim.dyads.setups import draw_setups
from hri_sim.media.look import BLUE, GREEN, GREY, PURPLE, VERMILION
from hri_sim.policies.evaluation import NOISE_M, situations
from hri_sim.policies.evaluation_picture import examples
from hri_sim.policies.likeness_table import policy_paths
from hri_sim.policy_report.laboratory import Laboratory, kept_test
from hri_sim.policy_report.likeness import COUNT, SMOKE_COUNT, STREAM, promp_samples
from hri_sim.policy_report.routes import on_one_way
from hri_sim.policy_report.watched import Watched, watch
from hri_sim.reproduction.drawing import drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

FOLDER = "rnn"
AXES = "xyz"
_STATES_S = 3.0
_SHOWN = 6
_SAMPLES = 12
"""Encounters in the picture of correlations."""


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Draw them; file and caption of each, by name."""
    folder = laboratory.out / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    laboratory.progress.say("pictures")
    triple, plain, lstm = laboratory.compared()
    models = {one.job.name: one.read(laboratory.runs) for one in (triple, plain, lstm)}
    test = kept_test(triple.job.data, triple.data_seed, laboratory.smoke)
    found: dict[str, Any] = {}

    def add(name: str, caption: str) -> Path:
        found[name] = {"file": f"{FOLDER}/{name}.png", "caption": caption}
        return folder / f"{name}.png"

    text = (
        f"A path of `{lstm.name}` and a sample of a ProMP of people on this way, each beside the person's "
        "path that is nearest by warping (figure 5.4a), "
        "how far away is said above; thin: all people on this way. Unseen setup."
    )
    draw_nearest(
        models[lstm.job.name], SMOKE_COUNT if laboratory.smoke else COUNT, add("nearest", text)
    )
    shown = examples(test, 1)[0]
    text = (
        f"Hands in one encounter, that of all tests in which the hands of both people come nearest to each "
        f"other: the person's, the partner's, and those of three policies, {', '.join(models)}, in the "
        "person's place (figure 5.4b). Dotted: the goal."
    )
    draw_hands(models, shown, add("hands", text))
    noise = _noise_text(models, triple.job.name, plain.job.name, test)
    text = (
        f"Outputs of the second layer of `{triple.name}` (GRU3t) and `{plain.name}` (GRU) in the same "
        "encounter, without noise (dark) and with N(0, 9 mm²) on goal and partner (light), and the "
        f"difference that noise makes (figure 5.5a, b): {noise}"
    )
    draw_states(
        {"GRU3t": models[triple.job.name], "GRU": models[plain.job.name]}, shown,
        add("states", text),
    )  # fmt: skip
    text = (
        f"Accelerations that the person's path has and that `{triple.name}` asks for, in the same "
        "encounter (figure 5.5c). The policy sees the hand where its own accelerations have led it."
    )
    draw_accelerations(models[triple.job.name], shown, add("accelerations", text))
    text = (
        f"Normalised correlation (eq. 5.18) of the outputs of both layers of `{triple.name}` with "
        f"acceleration, velocity, position and features over time, until the goal is reached (figure 5.6). "
        f"Each unit has a line for each of {min(_SAMPLES, len(test))} encounters: stripes across mean that "
        "it differs from encounter to encounter."
    )
    draw_correlations(models[triple.job.name], test, add("correlations", text))
    return found


def _noise_text(
    models: Mapping[str, PolicyModel], triple: str, plain: str, test: tuple[Encounter, ...]
) -> str:
    """What noise does to states, of all tests."""
    rms = {name: noise_on_states(models[name], test) for name in (triple, plain)}
    return (
        f"over all tests noise moves them by {rms[triple]:.4f} (GRU3t) and {rms[plain]:.4f} (GRU) of their "
        "own standard deviation, root mean square."
    )


def noise_on_states(model: PolicyModel, test: tuple[Encounter, ...]) -> float:
    """How far noise moves the outputs of the last layer, as a share of how far they move at all."""
    found = situations(test)
    exact = watch(model, found, 0.0, np.random.default_rng(0)).outputs[-1]
    noisy = watch(model, found, NOISE_M, np.random.default_rng(0)).outputs[-1]
    return float(np.sqrt(np.mean((noisy - exact) ** 2)) / exact.std())


def draw_nearest(model: PolicyModel, count: int, path: Path) -> None:
    """Figure 5.4a."""
    rng = np.random.default_rng((STREAM, 0))
    people = on_one_way(draw_setups(1, rng)[0], count, rng)[0]
    human = situations(people).human
    made = policy_paths(model, people, rng)
    # Of either the sample of median likeness.
    chosen = {"policy": _median(made, human)}
    chosen["ProMP"] = _median(promp_samples(people, count, rng), human)
    with drawn(path, 9.6, 6.4) as figure:
        panels = figure.subplots(2, 2)
        for row, (name, (own, nearest, apart)) in zip(panels, chosen.items(), strict=True):
            for axes, (x, y), title in zip(
                row, ((0, 1), (0, 2)), ("from above", "from the side"), strict=True
            ):
                for one in human:
                    axes.plot(100 * one[:, x], 100 * one[:, y], color="0.8", lw=0.6)
                axes.plot(
                    100 * nearest[:, x], 100 * nearest[:, y], color=BLUE, lw=2.0, label="nearest person"
                )  # fmt: skip
                axes.plot(100 * own[:, x], 100 * own[:, y], color=VERMILION, lw=2.0, label=name)
                axes.set(xlabel="x [cm]", ylabel=f"{AXES[y]} [cm]")
                axes.set_aspect("equal", adjustable="datalim")
                axes.set_title(f"{name}, {title}" + (f", {apart:.0f} mm away" if y == 1 else ""))
            row[0].legend(loc="best")


def _median(
    made: list[FloatArray], human: list[FloatArray]
) -> tuple[FloatArray, FloatArray, float]:
    """A path, the person's next to it, and their distance [mm]."""
    apart = distances([1e3 * one for one in made], [1e3 * one for one in human])
    nearest = apart.min(axis=1)
    row = int(np.argsort(nearest)[len(nearest) // 2])
    return made[row], human[int(apart[row].argmin())], float(nearest[row])


def draw_hands(models: Mapping[str, PolicyModel], shown: Encounter, path: Path) -> None:
    """Figure 5.4b."""
    found = situations([shown])
    length = len(shown) + 15
    with drawn(path, 9.6, 3.4) as figure:
        panels = figure.subplots(1, 3)
        for axis, axes in enumerate(panels):
            axes.axhline(100 * shown.goal[axis], color=GREEN, ls=":", lw=1.4, label="goal")
            axes.plot(
                *_over_time(shown.partner[:, axis]), "--", color=GREY, lw=1.6, label="partner"
            )
            axes.plot(*_over_time(shown.hand[:, axis]), color=BLUE, lw=2.6, label="person")
            for (name, model), colour, style in zip(
                models.items(), (VERMILION, PURPLE, "black"), ("-", "-.", "-"), strict=True
            ):
                moved = watch(model, found, 0.0, np.random.default_rng(0)).positions[0, :length]
                axes.plot(*_over_time(moved[:, axis]), style, color=colour, lw=1.4, label=name)
            axes.set(xlabel="time [s]", ylabel=f"{AXES[axis]} [cm]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)


def _over_time(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    return STEP_S * np.arange(len(values), dtype=float), 100.0 * values


def draw_states(models: Mapping[str, PolicyModel], shown: Encounter, path: Path) -> None:
    """Figure 5.5a and b."""
    found = situations([shown])
    count = round(_STATES_S / STEP_S)
    times = np.arange(count) * STEP_S
    colours = (BLUE, VERMILION, GREEN, PURPLE, (0.9, 0.62, 0.0), "black")
    with drawn(path, 9.6, 5.4) as figure:
        panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2, 1))
        for (name, model), (upper, lower) in zip(models.items(), panels.T, strict=True):
            exact, noisy = (
                watch(model, found, sigma, np.random.default_rng(3)).outputs[-1][0, :count]
                for sigma in (0.0, NOISE_M)
            )
            busiest = np.argsort(exact.std(axis=0))[::-1][:_SHOWN]
            for unit, colour in zip(busiest, colours, strict=False):
                upper.plot(times, noisy[:, unit], color=colour, lw=2.6, alpha=0.35)
                upper.plot(times, exact[:, unit], color=colour, lw=1.2, label=f"unit {unit + 1}")
                lower.plot(times, noisy[:, unit] - exact[:, unit], color=colour, lw=1.0)
            upper.set_title(f"{name}: the {len(busiest)} units that move most")
            upper.legend(ncols=3)
            lower.set_xlabel("time [s]")
        panels[0, 0].set_ylabel("output of layer 2")
        panels[1, 0].set_ylabel("noisy - exact")


def draw_accelerations(model: PolicyModel, shown: Encounter, path: Path) -> None:
    """Figure 5.5c."""
    own = accelerations(shown.hand, STEP_S)
    made = watch(model, situations([shown]), 0.0, np.random.default_rng(0)).accelerations[0]
    count = len(own) + 15
    with drawn(path, 9.6, 3.0) as figure:
        panels = figure.subplots(1, 3, sharey=True)
        for axis, axes in enumerate(panels):
            axes.axhline(0.0, color="0.8", lw=0.8)
            axes.plot(
                np.arange(len(own)) * STEP_S, own[:, axis], color=BLUE, lw=2.2, label="person"
            )
            axes.plot(
                np.arange(count) * STEP_S, made[:count, axis], color=VERMILION, lw=1.6, label="policy"
            )  # fmt: skip
            axes.set_xlabel("time [s]")
            axes.set_title(AXES[axis])
        panels[0].set_ylabel("acceleration [m/s²]")
        panels[0].legend()


def draw_correlations(model: PolicyModel, test: tuple[Encounter, ...], path: Path) -> None:
    """Figure 5.6."""
    some = list(test[:: max(len(test) // _SAMPLES, 1)][:_SAMPLES])
    found = situations(some)
    moved = watch(model, found, 0.0, np.random.default_rng(0))
    until = reach_steps(moved.positions, found.goal)
    tables = [_correlated(moved, row, until[row]) for row in range(len(some))]
    signals = [f"{name}-{axis}" for name in ("acc", "vel", "loc") for axis in AXES]
    signals += [f"{name}-{axis}" for name in ("goal", "partner") for axis in AXES]
    units = [layer.units for layer in model.network.layers]
    with drawn(path, 9.6, 3.2 * len(units)) as figure:
        panels: list[Axes] = list(
            figure.subplots(len(units), 1, sharex=True, squeeze=False).ravel()
        )
        for index, (axes, count) in enumerate(zip(panels, units, strict=True)):
            begin = sum(units[:index])
            # A block for each unit, in it a line for each encounter.
            stacked = np.stack([table[begin : begin + count] for table in tables], axis=1)
            image = axes.imshow(
                stacked.reshape(-1, len(signals)), aspect="auto", cmap="PuOr", vmin=-1.0, vmax=1.0,
                interpolation="nearest",
            )  # fmt: skip
            for unit in range(1, count):
                axes.axhline(unit * len(some) - 0.5, color="black", lw=0.5)
            for column in range(3, len(signals), 3):
                axes.axvline(column - 0.5, color="black", lw=0.5)
            axes.set_yticks((np.arange(count) + 0.5) * len(some) - 0.5)
            axes.set_yticklabels([f"{index + 1}-{unit + 1}" for unit in range(count)])
            axes.set_title(f"layer {index + 1}")
            axes.set_ylabel("layer-unit")
        panels[-1].set_xticks(range(len(signals)))
        panels[-1].set_xticklabels(signals, rotation=60, ha="right")
        figure.colorbar(image, ax=panels, label="correlation", shrink=0.6)


def _correlated(moved: Watched, row: int, until: float) -> FloatArray:
    """Of all units of one motion with all signals (units, 15)."""
    end = moved.positions.shape[1] if np.isnan(until) else max(int(until), 2)
    states = np.concatenate([one[row, :end] for one in moved.outputs], axis=1)
    signals = (moved.accelerations, moved.velocities, moved.positions, moved.inputs)
    return correlations(states, np.concatenate([one[row, :end] for one in signals], axis=1))


def lines(found: Mapping[str, Any]) -> list[str]:
    """Pictures with captions."""
    return [f"![{name}]({one['file']})\n\n{one['caption']}\n" for name, one in found.items()]
