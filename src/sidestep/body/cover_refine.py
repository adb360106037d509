"""Ellipsoids moved and bent until they cover a link's surface and overshoot it little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.body.cover_surface import Array, LinkSurface


@dataclass(frozen=True, eq=False)
class Ellipsoids:
    """Solid ellipsoids {centre + shape u : |u| <= 1}: centres (K, 3) [m], shapes (K, 3, 3) [m]."""

    centres: Array
    shapes: Array

    def __len__(self) -> int:
        return len(self.centres)

    def radii(self, points: Array) -> Array:
        """|shape^-1 (y - centre)|, (N, K): 1 on the boundary, below 1 inside."""
        inverse = np.linalg.inv(self.shapes)
        flat = inverse.reshape(-1, 3) @ points.T - np.einsum("kij,kj->ki", inverse, self.centres).reshape(
            -1, 1
        )
        return np.asarray(np.sqrt(np.square(flat.reshape(-1, 3, len(points))).sum(axis=1)).T)

    def scaled(self, factors: Array) -> Ellipsoids:
        return Ellipsoids(self.centres, self.shapes * factors[:, None, None])

    def boundary(self, directions: Array) -> tuple[Array, Array]:
        """Boundary points (K, J, 3) of unit directions (J, 3) and their share of the area (K, J) [m^2]."""
        points = self.centres[:, None] + np.einsum("kij,nj->kni", self.shapes, directions)
        stretch = np.linalg.norm(np.einsum("kji,nj->kni", np.linalg.inv(self.shapes), directions), axis=2)
        determinants = np.abs(np.linalg.det(self.shapes))
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
        steps: of the descent (Adam).
        rate: length of the first steps, as a share of the link's size.
        weight_start, weight_end: of bare samples against overshoot, growing from one to the other.
        power: of the overshoot: 2 minimises its mean square, more flattens its peaks.
        margin: bare samples are pulled in by this more [m].
        slimness: least ratio of the shortest to the longest semi-axis; clearances to slimmer ellipsoids are poor.
        directions: boundary points per ellipsoid at which overshoot is felt.
    """

    steps: int = 300
    rate: float = 0.02
    weight_start: float = 0.3
    weight_end: float = 30.0
    power: int = 4
    margin: float = 2e-4
    slimness: float = 0.2
    directions: int = 160


OUTLINE = RefineSettings()
REPAIR = RefineSettings(steps=50, rate=0.002, weight_start=100.0, weight_end=100.0)


def refine(surface: LinkSurface, samples: Array, start: Ellipsoids, settings: RefineSettings) -> Ellipsoids:
    """Minimises overshoot^p over the ellipsoids' boundaries plus a growing penalty on samples left bare."""
    centres, shapes = start.centres.copy(), start.shapes.copy()
    unit = 0.03 * surface.size  # overshoot is measured in this
    directions = sphere_directions(settings.directions)
    m = [np.zeros_like(centres), np.zeros_like(shapes)]
    v = [np.zeros(len(centres)), np.zeros(len(shapes))]
    beta1, beta2 = 0.9, 0.98
    rows = np.arange(len(samples))
    for step in range(settings.steps):
        share = step / settings.steps
        weight = settings.weight_start * (settings.weight_end / settings.weight_start) ** min(
            1.0, share / 0.8
        )
        now = Ellipsoids(centres, shapes)
        inverse = np.linalg.inv(shapes)
        # samples left bare
        z = (inverse.reshape(-1, 3) @ samples.T).reshape(-1, 3, len(samples)) - np.einsum(
            "kij,kj->ki", inverse, centres
        )[:, :, None]
        d = np.sqrt(np.square(z).sum(axis=1))  # (K, N)
        length = np.linalg.norm(samples[None] - centres[:, None], axis=2)
        scale = length / np.maximum(d, 1e-12)
        gap = length - scale
        owner = gap.argmin(axis=0)
        bare = gap[owner, rows] + settings.margin
        bare_rows = np.flatnonzero(bare > 0.0)
        k = owner[bare_rows]
        amount = 2.0 * weight * bare[bare_rows] / unit**2 * scale[k, bare_rows] / len(samples) * 100.0
        direction = z[k, :, bare_rows] / d[k, bare_rows, None]  # ∂d/∂z
        pull = np.einsum("nji,nj->ni", inverse[k], direction) * amount[:, None]  # -∂L/∂centre
        g_centres = np.zeros_like(centres)
        g_shapes = np.zeros_like(shapes)
        np.add.at(g_centres, k, -pull)
        np.add.at(g_shapes, k, -pull[:, :, None] * z[k, :, bare_rows][:, None, :])
        # boundary that overshoots
        points, areas = now.boundary(directions)
        flat = points.reshape(-1, 3)
        height, slope = surface.field(flat)
        over = np.flatnonzero(height > 0.0)
        if len(over):
            own = over // len(directions)
            others = (inverse.reshape(-1, 3) @ flat[over].T).reshape(-1, 3, len(over)) - np.einsum(
                "kij,kj->ki", inverse, centres
            )[:, :, None]
            r = np.square(others).sum(axis=1)
            r[own, np.arange(len(over))] = np.inf
            free = r.min(axis=0) > 1.0 if len(centres) > 1 else np.ones(len(over), dtype=bool)
            over, own = over[free], own[free]
            o = height[over] / unit
            force = (
                (areas.reshape(-1)[over] / surface.area)[:, None]
                * ((2.0 * o + settings.power * o ** (settings.power - 1)) / unit)[:, None]
                * slope[over]
            )
            np.add.at(g_centres, own, force)
            np.add.at(g_shapes, own, force[:, :, None] * directions[over % len(directions)][:, None, :])
        lr = settings.rate * surface.size * (1.0 if share < 0.3 else (1.0 - share) / 0.7 + 0.02)
        for i, (p, g) in enumerate(((centres, g_centres), (shapes, g_shapes))):
            m[i] = beta1 * m[i] + (1 - beta1) * g
            axes = tuple(range(1, g.ndim))
            v[i] = beta2 * v[i] + (1 - beta2) * np.square(g).mean(axis=axes)
            mh = m[i] / (1 - beta1 ** (step + 1))
            vh = np.sqrt(v[i] / (1 - beta2 ** (step + 1))) + 1e-12
            p -= lr * mh / vh.reshape((-1,) + (1,) * (g.ndim - 1))
        if step % 10 == 9 or step == settings.steps - 1:
            shapes[:] = rounded(shapes, settings.slimness)
    return Ellipsoids(centres, shapes)


def rounded(shapes: Array, slimness: float) -> Array:
    """Symmetric shapes of the same ellipsoids, the shortest semi-axis at least `slimness` of the longest."""
    u, s, _ = np.linalg.svd(shapes)
    s = np.maximum(s, slimness * s[:, :1])
    return np.asarray(np.einsum("kij,kj,klj->kil", u, s, u))


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
        cov = np.cov(own.T) + (0.02 * surface.size) ** 2 * np.eye(3)
        w, e = np.linalg.eigh(cov)
        centres.append(own.mean(axis=0))
        shapes.append(e @ np.diag(np.sqrt(4.0 * w)) @ e.T)
    return Ellipsoids(np.array(centres), np.array(shapes))
