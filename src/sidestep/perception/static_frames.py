"""Frames that stand still against each other, as a bag's /tf_static says."""

from __future__ import annotations

from collections import deque

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class StaticFrames:
    """A graph of frames; an edge is the pose X_AB of frame B in frame A."""

    def __init__(self) -> None:
        self._edges: dict[str, dict[str, Array]] = {}

    def add(self, parent: str, child: str, *, pose: Array) -> None:
        """States the pose (4, 4) of a child in its parent; a later one replaces it."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        self._edges.setdefault(parent, {})[child] = pose
        self._edges.setdefault(child, {})[parent] = np.asarray(np.linalg.inv(pose), dtype=np.float64)

    def pose(self, frame: str, *, base: str) -> Array:
        """The pose (4, 4) of a frame in a base.

        Raises:
            ValueError: they are not joined; names what the base is joined to.
        """
        frame, base = frame.lstrip("/"), base.lstrip("/")
        found = {base: np.eye(4)}
        queue = deque([base])
        while queue and frame not in found:
            parent = queue.popleft()
            for child, X in self._edges.get(parent, {}).items():
                if child not in found:
                    found[child] = found[parent] @ X
                    queue.append(child)
        if frame in found:
            return found[frame]
        joined = ", ".join(sorted(found.keys() - {base})) or "nothing"
        raise ValueError(f"/tf_static does not join frame {frame!r} to {base!r}, which is joined to {joined}")
