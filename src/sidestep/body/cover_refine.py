"""Ellipsoids that cover a link's surface: their starts and their refinement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sidestep import _core
from sidestep.body.cover_surface import Array, LinkSurface
from sidestep.math.matrices import determinant, inverse, principal_axes, product

_AT_ONCE = 4096  # points whose radii are computed together: they stay in the processor's cache


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """Solid ellipsoids {centre + shape u : |u| <= 1}: centres (K, 3) [m], shapes (K, 3, 3) [m]."""

    centres: Array
    shapes: Array

    def __len__(self) -> int:
        return len(self.centres)

    def radii(self, points: Array) -> Array:
        """|shape^-1 (y - centre)|, (N, K): 1 on the boundary, below 1 inside."""
        return np.asarray(np.sqrt(self.squared_radii(points)).T)

    def squared_radii(self, points: Array) -> Array:
        """Their squares, (K, N): by plain sums, so that the same points are inside on every processor."""
        squares = np.empty((len(self), len(points)))
        rows = inverse(self.shapes)
        for start in range(0, len(points), _AT_ONCE):
            x, y, z = np.ascontiguousarray(points[start : start + _AT_ONCE].T)
            for k, centre in enumerate(self.centres):
                dx, dy, dz = x - centre[0], y - centre[1], z - centre[2]
                found = squares[k, start : start + _AT_ONCE]
                found[:] = 0.0
                for a, b, c in rows[k]:
                    u = a * dx
                    u += b * dy
                    u += c * dz
                    u *= u
                    found += u
        return squares

    def scaled(self, factors: Array) -> Ellipsoids:
        return Ellipsoids(self.centres, self.shapes * factors[:, None, None])

    def boundary(self, directions: Array) -> tuple[Array, Array]:
        """Boundary points (K, J, 3) of unit directions (J, 3) and their share of the area (K, J) [m^2]."""
        points = self.centres[:, None] + np.einsum("kij,nj->kni", self.shapes, directions)
        stretch = np.linalg.norm(np.einsum("kji,nj->kni", inverse(self.shapes), directions), axis=2)
        determinants = np.abs(determinant(self.shapes))
        return points, 4.0 * np.pi / len(directions) * determinants[:, None] * stretch


def sphere_directions(count: int) -> Array:
    """Unit vectors (count, 3) spread evenly: the Fibonacci lattice on the sphere."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * i
    return np.stack([np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z], axis=1)


@dataclass(frozen=True)
class RefineSettings:
    """How the refinement descends; the values were chosen by trial on links and fingers of the FR3.

    Attributes:
        steps: of the descent.
        first_rate, last_rate: length of the first and of the last steps, as shares of the link's size.
        stiffness: of the augmented Lagrangian that keeps points covered.
        multiplier_steps: steps between two updates of its multipliers.
        margin: points are held inside by this share of the link's size, so that little growth is left to do.
        slimness: least ratio of the shortest to the longest semi-axis; clearances to slimmer ellipsoids are poor.
        directions: boundary points per ellipsoid at which overshoot is felt.
    """

    steps: int = 800
    first_rate: float = 0.01
    last_rate: float = 0.002
    stiffness: float = 30.0
    multiplier_steps: int = 4
    margin: float = 1e-3
    slimness: float = 0.2
    directions: int = 80


OUTLINE = RefineSettings()
HOP = RefineSettings(steps=400, first_rate=0.006, directions=160)
POLISH = RefineSettings(
    steps=150, first_rate=0.002, last_rate=1e-4, stiffness=100.0, multiplier_steps=5, directions=160
)
NUM_TURNS = 8  # the directions are turned about from step to step, so that no peak stays between them
OVERSHOOT_UNIT = 0.03  # of a link's size: below, the overshoot's mean counts most, above its peaks


def refine(
    surface: LinkSurface,
    points: Array,
    start: Ellipsoids,
    settings: RefineSettings,
    multipliers: Array | None = None,
) -> tuple[Ellipsoids, Array]:
    """Ellipsoids that overshoot little and hold points (N, 3), and the multipliers (N,) of the points.

    The descent itself is `refine_cover` in the core.
    """
    turns = Rotation.random(NUM_TURNS, random_state=0).as_matrix()
    centres, shapes, multipliers = _core.refine_cover(
        origin=surface.field.origin,
        spacing=surface.field.spacing,
        values=surface.field.values,
        points=points,
        multipliers=np.zeros(len(points)) if multipliers is None else multipliers,
        directions=product(sphere_directions(settings.directions), turns.transpose(0, 2, 1)),
        centres=start.centres,
        shapes=start.shapes,
        steps=settings.steps,
        first_rate=settings.first_rate * surface.size,
        last_rate=settings.last_rate * surface.size,
        stiffness=settings.stiffness,
        multiplier_steps=settings.multiplier_steps,
        margin=settings.margin * surface.size,
        unit=OVERSHOOT_UNIT * surface.size,
        area=surface.area,
        slimness=settings.slimness,
    )
    return Ellipsoids(centres, shapes), multipliers


def initial(surface: LinkSurface, samples: Array, number: int, seed: int) -> Ellipsoids:
    """k-means of the surface samples and the interior; every cluster's ellipsoid from its covariance."""
    from scipy.cluster.vq import kmeans2

    rng = np.random.default_rng(seed)
    inside = surface.field.nodes[surface.field.values.reshape(-1) < 0.0]
    if len(inside) > len(samples):
        inside = inside[rng.choice(len(inside), len(samples), replace=False)]
    cloud = np.concatenate([samples, inside])
    _, label = kmeans2(cloud, number, minit="++", rng=rng, iter=30)
    centres, shapes = [], []
    for k in range(number):
        own = cloud[label == k]
        if len(own) < 5:
            own = cloud[rng.choice(len(cloud), 20)]
        middle = own.mean(axis=0)
        spread = np.einsum("ni,nj->ij", own - middle, own - middle) / (len(own) - 1)
        w, e = principal_axes(spread + (0.02 * surface.size) ** 2 * np.eye(3))
        centres.append(middle)
        shapes.append(product(e * np.sqrt(4.0 * w), e.T))
    return Ellipsoids(np.array(centres), np.array(shapes))


SHIFT = 0.06  # of a link's size: how far all centres are moved at random
HALF = 0.6  # of a semi-axis that is left to each half of an ellipsoid


def rearranged(
    surface: LinkSurface, ellipsoids: Ellipsoids, points: Array, weights: Array, rng: np.random.Generator
) -> Ellipsoids:
    """One move of a search: shifts all ellipsoids, or splits one that overshoots and leaves another out.

    Args:
        points: on the boundary of the union (N, 3) [m]. weights: by which one of them is drawn, whose ellipsoid
            is split along one of its axes (N,).
    """
    count = len(ellipsoids)
    if count == 1 or not len(points) or rng.random() < 1.0 / 3.0:
        return Ellipsoids(
            ellipsoids.centres + SHIFT * surface.size * rng.standard_normal((count, 3)), ellipsoids.shapes
        )
    drawn = points[rng.choice(len(points), p=weights / weights.sum())]
    split = int(ellipsoids.radii(drawn[None])[0].argmin())
    left_out = int((split + rng.integers(1, count)) % count)
    shape = ellipsoids.shapes[split]
    squares, directions = principal_axes(product(shape, shape.T))
    axes, directions = np.sqrt(squares[::-1]), directions[:, ::-1]
    along = 0 if rng.random() < 0.5 else int(rng.integers(3))  # the longest in half the cases, else any
    offset = 0.5 * axes[along] * directions[:, along]
    axes[along] *= HALF
    centres, shapes = ellipsoids.centres.copy(), ellipsoids.shapes.copy()
    centres[left_out] = centres[split] + offset
    centres[split] -= offset
    shapes[[split, left_out]] = product(directions * axes, directions.T)
    return Ellipsoids(centres, shapes)
