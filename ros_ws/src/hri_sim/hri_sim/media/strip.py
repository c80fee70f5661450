"""The lower part of a video: clearance over time with a moving cursor."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_sim.media.frames import RunRecord
from hri_sim.media.look import BLUE, GREY, VERMILION

Image = NDArray[np.uint8]


class Strip:
    """Draws the plot once and moves only cursor and numbers.

    Args:
        record: The run.
        width: [pixel].
        height: [pixel].

    Attributes:
        height: [pixel].
    """

    def __init__(self, record: RunRecord, width: int, height: int) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.height = height
        self._record = record
        dpi = 100.0 * width / 960.0
        figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi)
        self._canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.075, 0.30, 0.70, 0.54))
        self._plot(axes)
        (self._cursor,) = axes.plot(
            [0.0, 0.0], axes.get_ylim(), color="0.15", lw=1.2, animated=True
        )
        (self._dot,) = axes.plot([], [], "o", ms=5, color=BLUE, animated=True)
        self._value = figure.text(
            0.80, 0.48, "", fontsize=17, fontweight="bold", va="center", animated=True
        )
        self._below = figure.text(0.80, 0.20, "", fontsize=8.5, color="0.3", animated=True)
        title = textwrap.fill(record.title or record.scenario.name, 26, max_lines=2)
        figure.text(0.80, 0.92, title, fontsize=8.5, color="0.3", va="top")
        self._axes = axes
        self._canvas.draw()
        self._empty = self._canvas.copy_from_bbox(figure.bbox)

    def _plot(self, axes: Any) -> None:
        record = self._record
        for reach in record.reaches:
            axes.axvspan(reach.start_s, reach.end_s, color="0.5", alpha=0.12, lw=0)
        curves = [np.where(np.isfinite(record.clearance_m), 1e3 * record.clearance_m, np.nan)]
        if record.baseline is not None:
            theirs = np.where(
                np.isfinite(record.baseline.clearance_m), 1e3 * record.baseline.clearance_m, np.nan
            )
            curves.append(theirs)
            time = record.baseline.time_s
            axes.plot(time, theirs, "--", color=GREY, lw=1.2, label="no replanning")
            axes.fill_between(
                time, theirs, 0.0, where=theirs < 0.0, color=VERMILION, alpha=0.3, lw=0
            )
        axes.plot(record.time_s, curves[0], color=BLUE, lw=1.8, label="executed")
        axes.axhline(0.0, color="black", lw=0.9)
        values = np.concatenate(curves)
        values = values[np.isfinite(values)]
        low, high = (values.min(), values.max()) if len(values) else (0.0, 1.0)
        axes.set_ylim(min(low, 0.0) - 0.08 * (high - low) - 2.0, high + 0.08 * (high - low) + 2.0)
        axes.set_xlim(record.time_s[0], record.time_s[-1])
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8, colors="0.3")
        axes.locator_params(axis="y", nbins=4)
        axes.set_ylabel("clearance [mm]", fontsize=8)
        axes.set_xlabel("time [s]", fontsize=8, labelpad=1)
        if record.baseline is not None:
            axes.legend(
                loc="lower right", bbox_to_anchor=(1.0, 0.95), ncols=2, frameon=False, fontsize=8
            )

    def draw(self, time_s: float) -> Image:
        """The strip at one time [s]: (height, width, 3) bytes."""
        clearance = 1e3 * float(self._record.at(np.array([time_s]))[2][0])
        self._canvas.restore_region(self._empty)
        self._cursor.set_xdata([time_s, time_s])
        artists = [(self._axes, self._cursor)]
        if np.isfinite(clearance):
            self._dot.set_data([time_s], [clearance])
            self._value.set_text(f"{clearance:.0f} mm".replace("-", "\N{MINUS SIGN}"))
            self._value.set_color(BLUE if clearance > 0.0 else VERMILION)
            artists.append((self._axes, self._dot))
        else:
            self._value.set_text("nobody there")
            self._value.set_color("0.4")
        self._below.set_text(f"clearance at {time_s:.2f} s")
        for axes, artist in artists:
            axes.draw_artist(artist)
        for text in (self._value, self._below):
            text.draw(self._canvas.get_renderer())
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()
