"""A small ray caster for capsules on a table: pictures where there is no OpenGL.

Opaque capsules with soft light and shadows on table and floor, plus translucent capsules for
predictions. The empty scene is drawn once a camera; a frame costs only the pixels near the
capsules.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]
FloatImage = NDArray[np.float32]
Image = NDArray[np.uint8]

_SHADOW = 0.68
_FAR = 1e9


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with z up.

    Attributes:
        eye: Where it stands (3,) [m].
        target: What is in the middle of the picture (3,) [m].
        fov: Vertical field of view [rad].
    """

    eye: tuple[float, float, float] = (0.95, -1.85, 1.25)
    target: tuple[float, float, float] = (0.36, 0.02, 0.28)
    fov: float = 0.56

    def frame(self, width: int, height: int) -> FloatArray:
        """Eye, right, up, forward, (focal length [pixel], half width, half height): (5, 3)."""
        eye = np.array(self.eye)
        forward = np.array(self.target) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        focal = 0.5 * height / math.tan(0.5 * self.fov)
        numbers = np.array([focal, 0.5 * width, 0.5 * height])
        return np.stack((eye, right, np.cross(right, forward), forward, numbers))

    def project(self, points: FloatArray, width: int, height: int) -> FloatArray:
        """Pixel coordinates (..., 2) of points (..., 3) [m]: from the left, from the top."""
        eye, right, up, forward, (focal, half_width, half_height) = self.frame(width, height)
        rays = np.asarray(points) - eye
        depth = rays @ forward
        u = half_width + focal * (rays @ right) / depth
        v = half_height - focal * (rays @ up) / depth
        return np.stack((u, v), axis=-1)


@dataclass(frozen=True)
class Capsules:
    """Capsules to draw.

    Attributes:
        ends: Axis ends (M, 2, 3) [m].
        radii: (M,) [m].
        colours: (M, 3), 0...1.
    """

    ends: FloatArray
    radii: FloatArray
    colours: FloatArray

    @staticmethod
    def joined(parts: list[Capsules]) -> Capsules:
        """All capsules of several sets."""
        return Capsules(
            np.concatenate([part.ends for part in parts]),
            np.concatenate([part.radii for part in parts]),
            np.concatenate([part.colours for part in parts]),
        )

    @staticmethod
    def along(
        points: FloatArray, radius: float | FloatArray, colour: tuple[float, ...]
    ) -> Capsules:
        """A string of capsules through points (K, 3) [m], leaving out those that are NaN."""
        ends = np.stack((points[:-1], points[1:]), axis=1)
        radii = np.broadcast_to(np.asarray(radius, dtype=float), (len(points),))[1:]
        seen = np.isfinite(ends).all(axis=(1, 2))
        colours = np.tile(np.array(colour[:3], dtype=float), (int(seen.sum()), 1))
        return Capsules(ends[seen], radii[seen].copy(), colours)


@njit
def _hit_capsule(o: FloatArray, d: FloatArray, a: FloatArray, b: FloatArray, r: float) -> float:
    """Distance along a unit ray to a capsule, or -1 (I. Quilez, "capsule - intersection")."""
    baba, bard, baoa, rdoa, oaoa = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        ba, oa = b[i] - a[i], o[i] - a[i]
        baba += ba * ba
        bard += ba * d[i]
        baoa += ba * oa
        rdoa += d[i] * oa
        oaoa += oa * oa
    qa = baba - bard * bard
    qb = baba * rdoa - baoa * bard
    qc = baba * oaoa - baoa * baoa - r * r * baba
    y = baoa
    if qa > 1e-12:
        h = qb * qb - qa * qc
        if h < 0.0:
            return -1.0
        t = (-qb - math.sqrt(h)) / qa
        y = baoa + t * bard
        if 0.0 < y < baba:
            return t
    b0, c0 = 0.0, -r * r
    for i in range(3):
        oc = o[i] - a[i] if y <= 0.0 else o[i] - b[i]
        b0 += d[i] * oc
        c0 += oc * oc
    h = b0 * b0 - c0
    return -b0 - math.sqrt(h) if h > 0.0 else -1.0


@njit
def _ray(frame: FloatArray, column: float, row: float, d: FloatArray) -> None:
    focal, half_width, half_height = frame[4, 0], frame[4, 1], frame[4, 2]
    x, y = (column + 0.5 - half_width) / focal, (half_height - row - 0.5) / focal
    norm = 0.0
    for i in range(3):
        d[i] = frame[3, i] + x * frame[1, i] + y * frame[2, i]
        norm += d[i] * d[i]
    norm = math.sqrt(norm)
    for i in range(3):
        d[i] /= norm


@njit
def _hit_box(o: FloatArray, d: FloatArray, low: FloatArray, high: FloatArray) -> tuple[float, int]:
    near, far, axis = -1e18, 1e18, 0
    for i in range(3):
        if d[i] == 0.0:
            continue
        t0, t1 = (low[i] - o[i]) / d[i], (high[i] - o[i]) / d[i]
        if t0 > t1:
            t0, t1 = t1, t0
        if t0 > near:
            near, axis = t0, i
        far = min(far, t1)
    return (near, axis) if near < far and near > 0.0 else (-1.0, 0)


@njit
def _empty_scene(
    frame: FloatArray,
    box: FloatArray,
    floor: float,
    rgb: FloatImage,
    depth: FloatImage,
    surface: Image,
) -> None:
    """Table (surface 1 on top) on a floor (2) that fades into a light background (0)."""
    d = np.empty(3)
    eye = frame[0]
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            _ray(frame, column, row, d)
            t, axis = _hit_box(eye, d, box[0], box[1])
            if t > 0.0:
                light = 0.99 if axis == 2 else (0.72 if axis == 1 else 0.62)
                rgb[row, column, 0] = 0.90 * light
                rgb[row, column, 1] = 0.86 * light
                rgb[row, column, 2] = 0.79 * light
                depth[row, column] = t
                surface[row, column] = 1 if axis == 2 else 0
                continue
            t = (floor - eye[2]) / d[2] if d[2] < -1e-6 else _FAR
            x, y = eye[0] + t * d[0] - 0.4, eye[1] + t * d[1]
            fade = math.exp(-0.12 * (x * x + y * y)) if t < _FAR else 0.0
            for i in range(3):
                rgb[row, column, i] = 0.97 - 0.09 * fade
            depth[row, column] = t
            surface[row, column] = 2 if t < 50.0 else 0


@njit
def _bounds(
    points: FloatArray, margins: FloatArray, frame: FloatArray, width: int, height: int
) -> tuple[int, int, int, int]:
    """Pixel box that holds balls of given radii about points; empty when one is behind the eye."""
    focal, half_width, half_height = frame[4, 0], frame[4, 1], frame[4, 2]
    low_u, low_v, high_u, high_v = 1e9, 1e9, -1e9, -1e9
    for k in range(points.shape[0]):
        x, y, z = 0.0, 0.0, 0.0
        for i in range(3):
            ray = points[k, i] - frame[0, i]
            x += ray * frame[1, i]
            y += ray * frame[2, i]
            z += ray * frame[3, i]
        if z < 0.05 + margins[k]:
            return 0, 0, 0, 0
        u, v = half_width + focal * x / z, half_height - focal * y / z
        reach = 1.25 * focal * margins[k] / (z - margins[k]) + 1.0
        low_u, high_u = min(low_u, u - reach), max(high_u, u + reach)
        low_v, high_v = min(low_v, v - reach), max(high_v, v + reach)
    left, right = max(int(low_u), 0), min(int(high_u) + 1, width)
    return left, right, max(int(low_v), 0), min(int(high_v) + 1, height)


@njit
def _shadows(
    frame: FloatArray,
    ends: FloatArray,
    radii: FloatArray,
    light: FloatArray,
    planes: FloatArray,
    base_depth: FloatImage,
    surface: Image,
    rgb: FloatImage,
    shaded: Image,
) -> None:
    height, width = base_depth.shape
    d, point, spots, margins = np.empty(3), np.empty(3), np.empty((2, 3)), np.empty(2)
    for m in range(ends.shape[0]):
        for plane in range(2):
            for k in range(2):
                rise = (ends[m, k, 2] - planes[plane]) / light[2]
                for i in range(3):
                    spots[k, i] = ends[m, k, i] - rise * light[i]
                margins[k] = 1.3 * radii[m] / light[2]
            left, right, top, bottom = _bounds(spots, margins, frame, width, height)
            for row in range(top, bottom):
                for column in range(left, right):
                    if surface[row, column] != plane + 1 or shaded[row, column]:
                        continue
                    _ray(frame, column, row, d)
                    for i in range(3):
                        point[i] = frame[0, i] + base_depth[row, column] * d[i]
                    if _hit_capsule(point, light, ends[m, 0], ends[m, 1], radii[m]) > 0.0:
                        shaded[row, column] = 1
                        factor = _SHADOW if plane == 0 else 0.9
                        for i in range(3):
                            rgb[row, column, i] *= factor


@njit
def _draw(
    frame: FloatArray,
    ends: FloatArray,
    radii: FloatArray,
    colours: FloatArray,
    light: FloatArray,
    glass: bool,
    depth: FloatImage,
    rgb: FloatImage,
) -> None:
    """Nearest capsule at every pixel; ``glass``: blended over what is behind, ``depth`` kept."""
    height, width = depth.shape
    d, normal, margins = np.empty(3), np.empty(3), np.empty(2)
    front = depth.copy() if glass else depth
    colour = np.zeros((height, width, 3), np.float32) if glass else rgb
    for m in range(ends.shape[0]):
        a, b = ends[m, 0], ends[m, 1]
        margins[:] = radii[m]
        left, right, top, bottom = _bounds(ends[m], margins, frame, width, height)
        for row in range(top, bottom):
            for column in range(left, right):
                _ray(frame, column, row, d)
                t = _hit_capsule(frame[0], d, a, b, radii[m])
                # A little nearer only: touching balls of one size must not speckle.
                if t <= 0.0 or t >= front[row, column] - 1e-5:
                    continue
                along, length = 0.0, 0.0
                for i in range(3):
                    axis = b[i] - a[i]
                    along += (frame[0, i] + t * d[i] - a[i]) * axis
                    length += axis * axis
                share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
                lit, facing = 0.0, 0.0
                for i in range(3):
                    normal[i] = frame[0, i] + t * d[i] - a[i] - share * (b[i] - a[i])
                    normal[i] /= radii[m]
                    lit += normal[i] * light[i]
                    facing -= normal[i] * d[i]
                shade = 0.50 + 0.42 * max(lit, 0.0) + 0.10 * normal[2]
                shade *= 0.80 + 0.20 * min(max(facing, 0.0), 1.0)
                gloss = max(lit, 0.0) ** 24 * 0.16
                front[row, column] = t
                for i in range(3):
                    colour[row, column, i] = min(colours[m, i] * shade + gloss, 1.0)
    if not glass:
        return
    for row in range(height):
        for column in range(width):
            if front[row, column] < depth[row, column]:
                for i in range(3):
                    old = rgb[row, column, i]
                    rgb[row, column, i] = old + 0.42 * (colour[row, column, i] - old)


@njit
def _shrink(rgb: FloatImage, factor: int, out: Image) -> None:
    """Average blocks of factor x factor pixels into bytes."""
    weight = 255.0 / (factor * factor)
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            for i in range(3):
                total = 0.0
                for y in range(factor):
                    for x in range(factor):
                        total += rgb[row * factor + y, column * factor + x, i]
                out[row, column, i] = np.uint8(min(max(total * weight, 0.0), 255.0))


class RayCaster:
    """Draws capsules over a table from one camera.

    Args:
        width: Picture width [pixel].
        height: Picture height [pixel].
        camera: Where to look from.
        table_center: Centre of the table (3,) [m].
        table_size: Its edge lengths (3,) [m].
        smoothing: Rays a pixel and direction; 2 removes most stairs, 3 is for print.
    """

    def __init__(
        self,
        width: int,
        height: int,
        camera: Camera,
        table_center: tuple[float, float, float],
        table_size: tuple[float, float, float],
        smoothing: int = 2,
    ) -> None:
        self._factor = smoothing
        self._out = np.empty((height, width, 3), np.uint8)
        shape = (height * smoothing, width * smoothing)
        self._frame = camera.frame(shape[1], shape[0])
        # From above, behind the camera's shoulder: what it sees is lit.
        self._light = np.array([0.25, 0.42 if camera.eye[1] > camera.target[1] else -0.42, 0.87])
        self._light /= np.linalg.norm(self._light)
        self._rgb, self._depth = np.empty((*shape, 3), np.float32), np.empty(shape, np.float32)
        self._surface = np.zeros(shape, np.uint8)
        center, half = np.array(table_center), 0.5 * np.array(table_size)
        self._planes = np.array([center[2] + half[2], center[2] + half[2] - 0.7])
        box = np.stack((center - half, center + half))
        _empty_scene(self._frame, box, self._planes[1], self._rgb, self._depth, self._surface)

    def draw(self, solid: Capsules, glass: Capsules | None = None) -> Image:
        """One picture.

        Args:
            solid: Opaque capsules; they cast shadows.
            glass: Translucent ones.

        Returns:
            (height, width, 3) bytes.
        """
        rgb, depth = self._rgb.copy(), self._depth.copy()
        ends = np.ascontiguousarray(solid.ends, dtype=float)
        radii = np.ascontiguousarray(solid.radii, dtype=float)
        colours = np.ascontiguousarray(solid.colours, dtype=float)
        shaded = np.zeros_like(self._surface)
        _shadows(
            self._frame,
            ends,
            radii,
            self._light,
            self._planes,
            self._depth,
            self._surface,
            rgb,
            shaded,
        )
        _draw(self._frame, ends, radii, colours, self._light, False, depth, rgb)
        if glass is not None and len(glass.radii):
            _draw(
                self._frame,
                np.ascontiguousarray(glass.ends, dtype=float),
                np.ascontiguousarray(glass.radii, dtype=float),
                np.ascontiguousarray(glass.colours, dtype=float),
                self._light,
                True,
                depth,
                rgb,
            )
        _shrink(rgb, self._factor, self._out)
        return self._out.copy()
