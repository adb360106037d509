"""The surface of a link as the cover needs it: small pieces, exact distances and a field of distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from sidestep._core import distance_to_triangles
from sidestep.math.matrices import principal_axes, product

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

NEAR_OUTSIDE, NEAR_INSIDE = 5, 2  # in cells: how far from the surface the field is exact to a piece's size
MARGIN = 0.15  # of `size`: how far around the link the field reaches, above any overshoot worth keeping
CANDIDATES = 12  # pieces examined for the distance of a point
_JITTER = np.array([0.3819660, 0.2360680])  # of a cell: keeps rays off vertices and edges of round size


def bisect_to_size(triangles: Array, size: float) -> Array:
    """Cuts triangles (F, 3, 3) at the middle of their longest edge until none is longer than size [m]."""
    done = []
    while len(triangles):
        edges = np.linalg.norm(triangles[:, [1, 2, 0]] - triangles, axis=2)
        longest = edges.argmax(axis=1)
        short = edges.max(axis=1) <= size
        done.append(triangles[short])
        triangles = bisect(triangles[~short], longest[~short])
    return np.concatenate(done) if done else np.empty((0, 3, 3))


def bisect(triangles: Array, edge: NDArray[np.intp]) -> Array:
    """Halves triangles (F, 3, 3) at the middle of edge (F,), which runs from that corner to the next."""
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (edge + shift) % 3] for shift in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Signed distances to a surface on a grid, positive outside [m]; trilinear in between.

    Inside is what at least two of the three axis-parallel rays, counted with the orientation of the
    triangles they cross, take for inside: meshes with small holes and doubled faces have an inside too.
    """

    origin: Array
    spacing: float
    values: Array  # (nx, ny, nz)

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Distance (N,) [m] and its gradient (N, 3) at points (N, 3); points off the grid see its border."""
        shape = np.array(self.values.shape)
        position = (points - self.origin) / self.spacing
        cell = np.clip(position.astype(np.intp), 0, shape - 2)
        t = np.clip(position - cell, 0.0, 1.0)
        flat = (cell[:, 0] * shape[1] + cell[:, 1]) * shape[2] + cell[:, 2]
        steps = np.array([0, shape[1] * shape[2]])[:, None, None] + np.array([0, shape[2]])[:, None]
        corners = (steps + np.array([0, 1])).reshape(-1)
        v = self.values.reshape(-1)[flat[:, None] + corners].reshape(-1, 2, 2, 2)
        x, y, z = t[:, 0, None, None], t[:, 1, None], t[:, 2]
        vx = v[:, 0] + x * (v[:, 1] - v[:, 0])
        vxy = vx[:, 0] + y * (vx[:, 1] - vx[:, 0])
        value = vxy[:, 0] + z * (vxy[:, 1] - vxy[:, 0])
        dx = v[:, 1] - v[:, 0]
        dx = dx[:, 0] + y * (dx[:, 1] - dx[:, 0])
        dy = vx[:, 1] - vx[:, 0]
        gradient = np.stack(
            [
                dx[:, 0] + z * (dx[:, 1] - dx[:, 0]),
                dy[:, 0] + z * (dy[:, 1] - dy[:, 0]),
                vxy[:, 1] - vxy[:, 0],
            ],
            axis=1,
        )
        return value, gradient / self.spacing

    def surely_inside(self, points: Array) -> Flags:
        """Points (N, 3) whose cell has all eight corners inside."""
        shape = np.array(self.values.shape)
        cell = ((points - self.origin) / self.spacing).astype(np.intp)
        within = ((points >= self.origin).all(axis=1)) & (cell < shape - 1).all(axis=1)
        cell = np.clip(cell, 0, shape - 2)
        inside = within.copy()
        for i in (0, 1):
            for j in (0, 1):
                for k in (0, 1):
                    inside &= self.values[cell[:, 0] + i, cell[:, 1] + j, cell[:, 2] + k] < 0.0
        return np.asarray(inside)

    @property
    def nodes(self) -> Array:
        """Positions of the nodes (nx * ny * nz, 3), in the order of `values.reshape(-1)`."""
        axes = [self.origin[i] + self.spacing * np.arange(n) for i, n in enumerate(self.values.shape)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True)
class SurfaceDetail:
    """How finely a link's surface is measured.

    Attributes:
        nodes: of the distance field: with 120,000 cells of 2 to 4 mm on the links of an arm, 0.7 mm on a finger.
        pieces: of equal size on the surface: with 6,000 of 4 to 7 mm on an arm, 1 mm on a finger.
    """

    nodes: int = 120_000
    pieces: int = 6_000


class LinkSurface:
    """Triangles of a link, cut into pieces of equal size, with distances to them.

    Attributes:
        triangles: of the mesh (F, 3, 3) [m]; triangles without area are left out, their edges belong to others.
        pieces: the same surface in small triangles (P, 3, 3).
        size: middle extent of the oriented bounding box [m]: what an overshoot is compared with.
        field: signed distances on a grid.
    """

    def __init__(self, triangles: Array, detail: SurfaceDetail = SurfaceDetail()) -> None:
        cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        areas = 0.5 * np.linalg.norm(cross, axis=1)
        self.triangles = np.ascontiguousarray(triangles)
        self.area = float(areas.sum())
        corners = triangles.reshape(-1, 3)
        centred = corners - corners.mean(axis=0)
        axes = principal_axes(np.einsum("ni,nj->ij", centred, centred))[1]
        self.size = float(np.sort(np.ptp(product(corners, axes), axis=0))[1])
        # right-angled isosceles pieces with a longest edge e have the area e^2 / 4
        self.piece_size = float(np.sqrt(4.0 * self.area / detail.pieces))
        self.pieces = bisect_to_size(self.triangles, self.piece_size)
        centroids = self.pieces.mean(axis=1)
        self._centroids = cKDTree(centroids)
        self.field = self._distance_field(detail.nodes)

    def distance(self, points: Array) -> Array:
        """Unsigned distance (N,) [m] of points (N, 3) to the surface, never too small.

        Exact when the nearest piece is among the CANDIDATES nearest by their centres. Otherwise, at a
        distance d much larger than the pieces' size e, too large by less than e^2 / (2 d).
        """
        count = min(CANDIDATES, len(self.pieces))
        _, index = self._centroids.query(points, k=count)
        return distance_to_triangles(points, self.pieces, index.reshape(len(points), count))

    def overshoot(self, points: Array) -> Array:
        """How far points (N, 3) lie outside the link (N,) [m], 0 inside.

        Inside counts only what is inside by the whole cell of the field, so that an error of the grid makes
        the overshoot larger, never smaller.
        """
        result = np.zeros(len(points))
        outside = ~self.field.surely_inside(points)
        result[outside] = self.distance(points[outside])
        return result

    def points(self, number: int) -> Array:
        """About `number` points (N, 3) spread evenly over the surface, the corners of its triangles among them."""
        return distinct_corners(bisect_to_size(self.triangles, float(np.sqrt(2.0 * self.area / number))))

    def sample(self, count: int, rng: np.random.Generator) -> Array:
        """Points (count, 3) uniform on the surface."""
        edges = self.triangles[:, 1:] - self.triangles[:, :1]
        areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        chosen = rng.choice(len(areas), size=count, p=areas / areas.sum())
        u = rng.random((count, 2))
        u = np.where(u.sum(axis=1, keepdims=True) > 1.0, 1.0 - u, u)
        return np.asarray(self.triangles[chosen, 0] + np.einsum("nk,nki->ni", u, edges[chosen]))

    def _distance_field(self, nodes: int) -> DistanceField:
        corners = self.triangles.reshape(-1, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = MARGIN * self.size
        extents = high - low + 2.0 * margin
        spacing = float((extents.prod() / nodes) ** (1.0 / 3.0))
        shape = np.ceil(extents / spacing).astype(int) + 2
        origin = low - margin - 0.5 * spacing
        field = DistanceField(origin, spacing, np.zeros(tuple(shape)))
        inside = _inside_nodes(self.triangles, origin, spacing, shape)
        marks = np.concatenate([self.pieces.mean(axis=1), distinct_corners(self.pieces)])
        free = np.ones(tuple(shape), dtype=bool)
        free[tuple(np.rint((marks - origin) / spacing).astype(np.intp).T)] = False
        cells = distance_transform_edt(free)
        values = cells * spacing
        near = (cells <= np.where(inside, NEAR_INSIDE, NEAR_OUTSIDE)).reshape(-1)
        values.reshape(-1)[near] = cKDTree(marks).query(field.nodes[near])[0]
        return DistanceField(origin, spacing, np.where(inside, -values, values))


def _inside_nodes(triangles: Array, origin: Array, spacing: float, shape: NDArray[np.intp]) -> Flags:
    """Nodes inside by at least two of three winding numbers, each along the rays of one axis."""
    votes = np.zeros(tuple(shape), dtype=int)
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        winding = _winding_along_rays(((triangles - origin) / spacing)[:, :, order], shape[order])
        votes += np.moveaxis(np.abs(winding) > 0, [0, 1, 2], order)
    return np.asarray(votes >= 2)


def _winding_along_rays(triangles: Array, shape: NDArray[np.intp]) -> NDArray[np.int64]:
    """Winding number of the nodes (nx, ny, nz) from crossings of rays along +z; triangles in node units."""
    flat = triangles[:, :, :2] - _JITTER
    first = np.clip(np.ceil(flat.min(axis=1)), 0, shape[:2]).astype(np.intp)
    last = np.clip(np.floor(flat.max(axis=1)), -1, shape[:2] - 1).astype(np.intp)
    spans = np.maximum(last - first + 1, 0)
    counts = spans.prod(axis=1)
    owner = np.repeat(np.arange(len(triangles)), counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    column = first[owner] + np.stack(np.divmod(number, np.maximum(spans[owner, 1], 1)), axis=1)
    a, b, c = (flat[owner, i] - column for i in range(3))
    weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    total = weights.sum(axis=1)
    hit = ((weights > 0.0).all(axis=1) | (weights < 0.0).all(axis=1)) & (total != 0.0)
    owner, column, weights, total = owner[hit], column[hit], weights[hit], total[hit]
    height = np.einsum("nk,nk->n", weights, triangles[owner, :, 2]) / total
    winding = np.zeros((shape[0], shape[1], shape[2] + 1), dtype=np.int64)
    below = np.clip(np.ceil(height), 0, shape[2]).astype(
        np.intp
    )  # nodes 0 … below - 1 see the crossing above
    np.add.at(winding, (column[:, 0], column[:, 1], below), np.sign(total).astype(np.int64))
    return np.asarray(np.cumsum(winding[:, :, ::-1], axis=2)[:, :, ::-1][:, :, 1:])


def distinct_corners(triangles: Array) -> Array:
    """Corners (N, 3) of triangles, those within a millionth of the whole's extent taken for one."""
    corners = triangles.reshape(-1, 3)
    low = corners.min(axis=0)
    steps = np.rint((corners - low) * (2**20 / np.ptp(corners, axis=0).max())).astype(np.int64)
    _, first = np.unique((steps[:, 0] << 42) + (steps[:, 1] << 21) + steps[:, 2], return_index=True)
    return np.asarray(corners[first])


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
