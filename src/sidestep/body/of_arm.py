"""The body of a prepared arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep import _core
from sidestep.body.cover import density_fit
from sidestep.body.cover_settings import LinkCover
from sidestep.body.fitting import LinkFit

if TYPE_CHECKING:
    from sidestep.robot import Robot


def contents_of(arm: _core.Arm) -> dict[str, Any]:
    """What arguments of `Body` an arm tells."""
    body = arm.body
    return {
        "links": body.links,
        "weights": body.weights,
        "means": body.means,
        "covariances": body.covariances,
        "levels": body.levels,
        "fingerprint": arm.provenance.fingerprint,
        "link_covers": [
            LinkCover(
                link=proof.link,
                num_components=body.links.count(proof.link),
                coverage=proof.coverage,
                mean_overshoot=proof.mean_overshoot,
                max_overshoot=proof.max_overshoot,
                volume_ratio=proof.volume_ratio,
                volume_of=proof.volume_of,
                interior_coverage=proof.interior_coverage,
                slimness=proof.slimness,
            )
            for proof in arm.proof
        ],
    }


def fits_of(arm: _core.Arm, robot: Robot, seed: int) -> list[LinkFit]:
    """How well the density of each link's cover describes the meshes of `robot`."""
    body, owner = arm.body, np.asarray(arm.body.links)
    return [
        density_fit(robot, link, body.means[own], body.covariances[own], body.weights[own], seed)[0]
        for link in dict.fromkeys(body.links)
        for own in [owner == link]
    ]
