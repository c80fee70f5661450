"""Every coordinate of every sample, against readers of a few lines made for this test alone.

They know nothing but these files: fixed separators, no checks. Files that hold the same trial in
several formats are compared with each other as well.
"""

import csv
import os
import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hri_prediction.tracks.importers.recognise import read_markers

ENDINGS = (".c3d", ".trc", ".bvh", ".csv")
ROOT = Path(os.environ["HRI_DATA_DIR"]) / "file_samples" if "HRI_DATA_DIR" in os.environ else None
FILES = [] if ROOT is None else sorted(p for p in ROOT.rglob("*") if p.suffix in ENDINGS)
needs_data = pytest.mark.skipif(
    not FILES, reason="HRI_DATA_DIR is not set, or without file_samples"
)


def vax(words):
    """Floating point numbers of a VAX (F format) from pairs of little-endian words."""
    bits = (words[..., 0].astype(np.uint32) << 16) | words[..., 1]
    return np.where(bits == 0, 0.0, bits.astype("<u4").view("<f4") / 4.0)


def plain_c3d(content):
    """Points (N, M, 3) of an Intel or DEC file; NaN where the residual is negative."""
    dec = content[(content[0] - 1) * 512 + 3] == 85
    points, analog = struct.unpack_from("<2H", content, 2)
    first, last = struct.unpack_from("<2H", content, 6)
    raw = np.frombuffer(content[12:16], "<u2").reshape(1, 2)
    scale = float(vax(raw)[0]) if dec else struct.unpack_from("<f", content, 12)[0]
    start = (struct.unpack_from("<H", content, 16)[0] - 1) * 512
    count, width = last - first + 1, 4 * points + analog
    if scale > 0:
        rows = np.frombuffer(content, "<i2", count * width, start).reshape(count, width)
        factor = scale
    elif dec:
        words = np.frombuffer(content, "<u2", 2 * count * width, start)
        rows, factor = vax(words.reshape(count, width, 2)), 1.0
    else:
        rows = np.frombuffer(content, "<f4", count * width, start).reshape(count, width)
        factor = 1.0
    values = rows[:, : 4 * points].reshape(count, points, 4)
    places = values[..., :3].astype(float) * factor
    places[values[..., 3] < 0] = np.nan
    return places


def number(text):
    return float(text) if text.strip() else np.nan


def plain_trc(content):
    lines = content.decode().splitlines()
    separator = "\t" if "\t" in lines[3] else ","
    names = [cell for cell in lines[3].split(separator)[2:] if cell.strip()]
    rows = [line.split(separator) for line in lines[5:] if line.strip(separator)]
    rows = [[number(cell) for cell in row[2 : 2 + 3 * len(names)]] for row in rows]
    rows = [row + [np.nan] * (3 * len(names) - len(row)) for row in rows]
    return np.array(rows).reshape(len(rows), len(names), 3)


def plain_csv(content):
    rows = list(csv.reader(content.decode("utf-8-sig").splitlines()))
    top = next(n for n, row in enumerate(rows) if row and row[0] == "Trajectories")
    count = sum(1 for cell in rows[top + 2] if cell)
    table = []
    for row in rows[top + 5 :]:
        if not any(row):
            break
        table.append([number(cell) for cell in row[2 : 2 + 3 * count]])
    return np.array(table).reshape(len(table), count, 3)


def plain_bvh(content):
    """Places of joints and end sites, one frame in fifty, frame by frame and joint by joint."""
    head, motion = content.decode().split("MOTION")
    words = head.split()
    rows = [[float(v) for v in line.split()] for line in motion.splitlines()[3:] if line.strip()]
    frames = []
    for row in rows[::50]:
        values, stack, places, offset = iter(row), [], [], np.zeros(3)
        for at, word in enumerate(words):
            if word == "{":
                stack.append(stack[-1] if stack else (np.zeros(3), Rotation.identity()))
            elif word == "}":
                stack.pop()
            elif word == "OFFSET":
                offset = np.array([float(v) for v in words[at + 1 : at + 4]])
                place, turn = stack[-1]
                stack[-1] = (place + turn.apply(offset), turn)
                places.append(stack[-1][0])
            elif word == "CHANNELS":
                names = words[at + 2 : at + 2 + int(words[at + 1])]
                given = dict(zip(names, values, strict=False))
                place, turn = stack[-1]
                if "Xposition" in given:
                    place = np.array([given[f"{axis}position"] for axis in "XYZ"])
                    places[-1] = place
                turns = [(n[0], given[n]) for n in names if n.endswith("rotation")]
                axes = "".join(axis for axis, _ in turns)
                angles = [angle for _, angle in turns]
                stack[-1] = (place, turn * Rotation.from_euler(axes, angles, degrees=True))
        frames.append(places)
    return np.array(frames)


PLAIN = {".c3d": plain_c3d, ".trc": plain_trc, ".csv": plain_csv, ".bvh": plain_bvh}


@needs_data
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_coordinate(path):
    wanted = PLAIN[path.suffix](path.read_bytes())
    found = read_markers(path).positions
    if path.suffix == ".bvh":
        found = found[::50]
    assert found.shape == wanted.shape
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6)


@needs_data
@pytest.mark.parametrize("other", ["pc_int", "dec_real", "dec_int"])
def test_byte_orders_and_number_formats_of_one_trial(other):
    folder = ROOT / "kineticstoolkit_apache2"
    one, two = read_markers(folder / "pc_real.c3d"), read_markers(folder / f"{other}.c3d")
    assert one.labels == two.labels
    assert one.rate_hz == two.rate_hz
    np.testing.assert_array_equal(np.isnan(one.positions), np.isnan(two.positions))
    # The whole numbers count in steps of 0.2812 mm.
    np.testing.assert_allclose(two.positions, one.positions, rtol=1e-6, atol=0.2813)


@needs_data
def test_formats_of_one_trial():
    folder = ROOT / "pyomeca_apache2"
    one, two = read_markers(folder / "markers_analogs.c3d"), read_markers(folder / "markers.csv")
    assert one.labels == two.labels
    assert (one.rate_hz, one.unit) == (two.rate_hz, two.unit)
    np.testing.assert_array_equal(one.frames, two.frames)
    np.testing.assert_allclose(one.positions, two.positions, atol=1e-2)


@needs_data
def test_missing_values_of_different_spellings():
    path = ROOT / "opensim_apache2" / "dataWithNaNsOfDifferentCases.trc"
    words = [w for w in path.read_text().split() if w.lower() == "nan"]
    assert len(set(words)) > 1
    assert np.isnan(read_markers(path).positions).sum() == len(words)
