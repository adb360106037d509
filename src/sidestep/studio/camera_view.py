"""A page that shows what cameras see: images, what is taken out of them, and the map of cells around the arm."""

from __future__ import annotations

import html
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.body import Body
from sidestep.math.pose import pose_vector
from sidestep.perception.colours import CELLS, MEANINGS, PIXELS, rgb
from sidestep.perception.pictures import depth_picture, label_picture, view_from_beside
from sidestep.perception.seen_stages import CELL_KINDS, SeenStages
from sidestep.robot import Robot
from sidestep.studio.guarded_page import GuardedPage
from sidestep.studio.page.arm import ArmView, BodyView, merged_meshes
from sidestep.studio.page.camera import Viewpoint
from sidestep.studio.page.scene import point_cameras, set_up_scene
from sidestep.studio.show.reading import with_links
from sidestep.studio.show.shapes import drawable_shapes

if TYPE_CHECKING:
    from sidestep._core import PerceptionReport
    from sidestep.arm import Arm

Array = npt.NDArray[np.float64]

PORT = 8892  # beside the studio's and that of `sidestep show`
WIDTH = 420  # [px] of the panel with the images
IMAGE_WIDTH = 480  # [px] of an image on the page, at most
FRUSTUM = 0.06  # [m] length of a camera in the scene
POINT = 1.2  # width of a cell in the scene, in its radius
UNSEEN = 0.006  # [m] a cell that nobody has seen is drawn small: others are seen behind it
PALEST, FAR = 0.5, 4.0  # share of white in the colour of a cell that is so far [m] from the camera


class CameraView(GuardedPage):
    """The page: the arm, cameras and cells in 3-D, and the images beside; stop it with `stop`, or use it as a context.

    Args:
        arm: that is drawn: its meshes, or the ellipsoids of its body where it has none.
        port: where to listen on this machine; 0: any that is free.

    Raises:
        OSError: the port is taken. ModuleNotFoundError: viser is not installed.
    """

    def __init__(self, arm: Arm, *, port: int = PORT) -> None:
        super().__init__(port)
        set_up_scene(self.server)
        self.server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        self.server.gui.main_panel.dock_right()
        self.server.gui.main_panel.set_width(WIDTH)
        robot = arm.robot if isinstance(arm.robot, Robot) else with_links(arm.robot)
        meshes = merged_meshes(drawable_shapes(robot).seen)
        names = [frame.name for frame in robot.frames]
        self._arm = ArmView(self.server, robot, meshes, "/arm", frames=names)
        if not meshes:
            BodyView(self.server, robot, Body.of_arm(arm), "/arm", visible=True)
        self._words: Any = self.server.gui.add_html("<p id='words'>waiting for an image</p>")
        self._pause: Any = self.server.gui.add_checkbox("pause", False)
        self._images: dict[str, tuple[Any, Any]] = {}
        self._placed = False
        self._stopping = threading.Event()

    @property
    def paused(self) -> bool:
        """Whether somebody wants to look longer."""
        return bool(self._pause.value)

    def show(self, stages: SeenStages, report: PerceptionReport, q: Array) -> None:
        """Shows an image and the map after it, and the arm at q (nv,)."""
        with self.server.atomic():
            self._arm.show(q)
            self._show_cells(stages)
            self._show_camera(stages)
            self._words.content = _words_html(stages, report)
        if not self._placed:
            view = view_from_beside(stages)
            eye, along = view[:3, 3], view[:3, 2]
            point_cameras(self.server, Viewpoint(eye, eye + along, FAR, along))
            self._placed = True

    def wait(self, seconds: float | None = None) -> bool:
        """Waits until the page is stopped, or so long; whether it is stopped."""
        if seconds is not None:
            return self._stopping.wait(seconds)
        while not self._stopping.wait(0.2):
            pass
        return True

    def stop(self) -> None:
        """Ends the server."""
        self._stopping.set()
        self.server.stop()

    def _show_cells(self, stages: SeenStages) -> None:
        eye = stages.pose[:3, 3]
        for number, kind in enumerate(CELL_KINDS):
            own = stages.kinds == number
            self._show_points(kind, stages.centres[own], stages.radii[own], eye)
        self._show_points("unseen", stages.unseen, np.full(len(stages.unseen), UNSEEN), eye)

    def _show_points(self, kind: str, points: Array, radii: Array, eye: Array) -> None:
        """Replaces the cells of a kind, all drawn in one size, paler the farther they are from the camera."""
        away = np.linalg.norm(points - eye, axis=1)
        pale = PALEST * np.clip(away / FAR, 0.0, 1.0)[:, None]
        colours = (1.0 - pale) * np.array(rgb(CELLS[kind])) + pale * 255.0
        self.server.scene.add_point_cloud(
            f"/cells/{kind}",
            points.astype(np.float32),
            np.round(colours).astype(np.uint8),
            point_size=POINT * float(np.median(radii)) if len(radii) else UNSEEN,
            point_shape="square",
        )

    def _show_camera(self, stages: SeenStages) -> None:
        camera = stages.camera
        step = -(-camera.width // IMAGE_WIDTH)
        depth = depth_picture(stages.depth[::step, ::step], near=camera.near, far=camera.far)
        labels = label_picture(stages.labels[::step, ::step])
        if camera.name not in self._images:
            gui = self.server.gui
            self._images[camera.name] = (
                gui.add_image(depth, label=f"{camera.name}: depth", format="png"),
                gui.add_image(labels, label=f"{camera.name}: what pixels show", format="png"),
            )
        else:
            for handle, picture in zip(self._images[camera.name], (depth, labels), strict=True):
                handle.image = picture
        place = pose_vector(stages.pose)
        self.server.scene.add_camera_frustum(
            f"/cameras/{camera.name}",
            fov=2.0 * float(np.arctan2(0.5 * camera.height, camera.fy)),
            aspect=camera.width / camera.height,
            scale=FRUSTUM,
            thickness=0.1,
            position=place[:3],
            wxyz=place[3:],
        )


def _words_html(stages: SeenStages, report: PerceptionReport) -> str:
    """Figures of the last image, and the colours with what each is and how old."""
    box = (
        "<div style='display:flex;gap:8px;align-items:baseline'><span style='flex:none;width:12px;height:12px;"
        "border:1px solid #888;background:{}'></span><span>{}</span></div>"
    )
    rows = [
        f"<b>{html.escape(stages.camera.name)}</b>, {stages.time:.3f} s, {1e3 * report.total_time:.1f} ms<br>"
    ]
    if report.question:
        rows.append(f"<b style='color:#D55E00'>{html.escape(report.question)}</b><br>")
    for kind, count in stages.cells().items():
        ages = stages.age_words(kind)
        rows.append(
            box.format(CELLS[kind], f"{MEANINGS[kind]}: {count:,} cells{', ' + ages if ages else ''}")
        )
    for name, count in stages.pixels().items():
        if count:
            rows.append(box.format(PIXELS[name], f"{MEANINGS[name]}: {count:,} pixels"))
    style = "font-size:13px;line-height:1.4;padding:2px 10px"
    return f"<div id='words' style='{style}'>{''.join(rows)}</div>"
