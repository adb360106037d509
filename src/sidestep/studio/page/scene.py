"""What every page has around its arm: ground, light and cameras."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sidestep.studio.page.camera import Viewpoint

if TYPE_CHECKING:
    import viser

GRID_DEPTH = 0.05  # [m] below the base: a planar arm, half as thick, does not lie in the grid
SKY_LIGHT = 2.4  # so that lit faces have about the colour that the legend shows


def set_up_scene(server: viser.ViserServer) -> None:
    """Draws the ground and lights the scene; z points upwards."""
    scene = server.scene
    scene.set_up_direction("+z")
    scene.add_grid(
        "/grid",
        width=3.0,
        height=3.0,
        cell_size=0.1,
        section_size=0.5,
        shadow_opacity=0.2,
        position=(0.0, 0.0, -GRID_DEPTH),
    )
    # Light without an environment map: such a map tints the colours, and takes seconds to prepare in a browser
    # without a graphics card.
    scene.configure_environment_map(hdri=None)
    scene.add_light_hemisphere(
        "/light", sky_color=(255, 255, 255), ground_color=(170, 170, 170), intensity=SKY_LIGHT
    )


def point_cameras(server: viser.ViserServer, viewpoint: Viewpoint) -> None:
    """Where all windows look from, those to come as well."""
    cameras: list[Any] = [client.camera for client in server.get_clients().values()]
    for camera in (server.initial_camera, *cameras):
        camera.position, camera.look_at = viewpoint.position, viewpoint.target
