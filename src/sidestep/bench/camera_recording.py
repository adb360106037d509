"""What the mask leaves of a real arm and takes of the world: recordings with joints, calibration and masks."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation

from sidestep._core import Controller, DepthCamera, Perception
from sidestep.arm import Arm
from sidestep.bench.camera_scene import told_camera, wrong
from sidestep.bench.link_surfaces import LinkSurfaces, link_triangles
from sidestep.bench.mask_measures import points_of
from sidestep.bench.parallel import Progress
from sidestep.math.pose import moved
from sidestep.perception import DepthNoise, Frame, PixelLabel, open_recording
from sidestep.perception.folder import FolderRecording
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.bool_]
Row = dict[str, Any]

NEAR = 0.05  # [m] from the meshes: the world that is lost nearer than that is counted apart from the rest
APART = 0.03  # [m] from every mesh: what a mask shows farther away is not of the model
FRINGE = 8  # [pixel] around mask and meshes: there the depth of the arm bleeds, and neither is exact
GROWN = (0.05, 0.10)  # [m] masks of the usual recipe
BELIEVED = (0.01, 0.005)  # [m], [rad] by which the calibration itself may be wrong


@dataclass(frozen=True)
class CameraRecordingSettings:
    """Which recording, and how.

    Attributes:
        folder: with `camera.json`, depth images, `joints.csv` and masks `arm_mask_12.png` (white: arm).
        robot: a name, or the path of a description.
        pose: name of one of several poses of the camera; None: the only one.
        translation, rotation: errors that are added to the pose [m], [rad]. draws: of such errors. seed: of them.
        draft: with the body that is prepared in seconds.
    """

    folder: Path
    robot: str
    pose: str | None = None
    translation: float = 0.01
    rotation: float = float(np.radians(1.0))
    draws: int = 3
    seed: int = 0
    draft: bool = False


@dataclass(frozen=True, eq=False)
class RecordedArm:
    """An arm in a real image.

    Attributes:
        mask: (H, W) as given. drawn: (H, W) its meshes at the given pose.
        distance: (H, W) of what was measured from the meshes at the given pose [m]; inf: farther than 5 cm, or nothing.
        points: (H, W, 3) in the world. valid: (H, W) where there is a depth in range.
    """

    mask: Pixels
    drawn: Pixels
    distance: Array
    points: Array
    valid: Pixels


def run_camera_recording(settings: CameraRecordingSettings, *, progress: Progress | None = None) -> list[Row]:
    """A row for each image and each way in which it is masked."""
    arm = Arm.load(settings.robot, draft=settings.draft)
    robot = arm.robot
    if not isinstance(robot, Robot):
        raise ValueError(f"robot {settings.robot!r} has no meshes here, against which masks are measured")
    recording = open_recording(settings.folder, pose=settings.pose)
    if not isinstance(recording, FolderRecording) or len(recording.cameras) != 1:
        raise ValueError(f"{settings.folder} is no folder of one camera")
    camera = recording.cameras[0].camera()
    if camera.distortion_model != "none" or camera.link:
        raise ValueError(f"camera {camera.name!r} must stand in the world and have no distortion")
    order = _joints(robot, recording.joint_names)
    controller, surfaces = Controller(arm), LinkSurfaces(robot, "mesh")
    rows = []
    numbers = [path.stem.removeprefix("depth_") for path in depth_files(settings.folder)]
    for done, (number, frame) in enumerate(zip(numbers, recording.frames(), strict=True)):
        if progress is not None:
            progress(done, len(recording), f"image {number}")
        if frame.q is None:
            raise ValueError(f"image {number} of {settings.folder} has no joints")
        q = frame.q[order]
        mask = read_mask(settings.folder / f"arm_mask_{number}.png", frame.depth.shape)
        image = recorded_arm(frame, q, mask, robot, surfaces, camera)
        from_meshes = partial(_from_meshes, surfaces, surfaces.poses(q))
        for way, told in _ways(camera, settings):
            perception = Perception(controller, [told])
            report = perception.update(told.name, frame.depth, time=0.0, unit=frame.unit, q=q)
            labels = perception.labels(told.name)
            rows.append(
                {
                    "image": number,
                    "way": way,
                    **count_pixels(image, labels, from_meshes),
                    "question": report.question,
                    "seconds": report.total_time,
                }
            )
    return rows


def depth_files(folder: Path) -> list[Path]:
    """The depth images of a folder, by number."""
    files = [path for path in folder.glob("depth_*") if path.stem.removeprefix("depth_").isdigit()]
    return sorted(files, key=lambda path: int(path.stem.removeprefix("depth_")))


def count_pixels(
    image: RecordedArm, labels: npt.NDArray[np.uint8], from_meshes: Callable[[Array], Array]
) -> Row:
    """Pixels of an image, by what they are and what became of them.

    mask: of the given mask with a depth. left_over: of them those that count as obstacle, and what of them is at most 3
    cm from the meshes, and farther: not of the model, such as a tool, or a depth of something behind. drawn_left_over:
    of the meshes as drawn, nearer than 3 cm to them. world: farther than 8 pixels outside of mask and drawn meshes;
    nearer than 5 cm, and of these lost; lost farther away; max_lost: the farthest of these [m], 0: none. fringe: within
    those 8 pixels.

    Args:
        from_meshes: distances (N,) of points (N, 3) of the world to the meshes [m].
    """
    obstacle, arm = labels == int(PixelLabel.obstacle), labels == int(PixelLabel.arm)
    mask, drawn = image.mask & image.valid, image.drawn & image.valid
    around = binary_dilation(image.mask | image.drawn, iterations=FRINGE)
    world, fringe = image.valid & ~around, image.valid & around & ~image.mask & ~image.drawn
    at_model, near = image.distance <= APART, image.distance <= NEAR
    lost = world & arm
    counts: dict[str, Pixels] = {
        "mask": mask,
        "mask_at_model": mask & at_model,
        "left_over": mask & obstacle,
        "left_over_at_model": mask & obstacle & at_model,
        "left_over_apart": mask & obstacle & ~at_model,
        "drawn": drawn & at_model,
        "drawn_left_over": drawn & at_model & obstacle,
        "world": world,
        "world_near": world & near,
        "lost_near": lost & near,
        "lost_far": lost & ~near,
        "fringe_near": fringe & near,
        "fringe_lost": fringe & arm,
    }
    lost_distances = from_meshes(image.points[lost & ~near])
    return {
        "pixels": labels.size,
        **{name: int(pixels.sum()) for name, pixels in counts.items()},
        "max_lost": float(lost_distances.max()) if len(lost_distances) else 0.0,
    }


def recording_table(rows: Sequence[Row]) -> dict[str, Row]:
    """By way: sums over images, shares, and the farthest that is lost."""
    table: dict[str, Row] = {}
    for row in rows:
        cell = table.setdefault(row["way"], {"images": 0, "max_lost": 0.0})
        cell["images"] += 1
        cell["max_lost"] = max(cell["max_lost"], row["max_lost"])
        for name, value in row.items():
            if isinstance(value, int):
                cell[name] = cell.get(name, 0) + value
    for cell in table.values():
        cell["left_over_share"] = cell["left_over_at_model"] / max(1, cell["mask_at_model"])
        cell["lost_near_share"] = cell["lost_near"] / max(1, cell["world_near"])
    return table


def drawn_meshes(robot: Robot, q: Array, camera: DepthCamera) -> Pixels:
    """The pixels (H, W) that the meshes of an arm cover: each triangle in front of the camera, filled."""
    from PIL import Image, ImageDraw

    picture = Image.new("1", (camera.width, camera.height))
    draw = ImageDraw.Draw(picture)
    X_WC = np.asarray(camera.pose)
    for link in robot.links:
        triangles = link_triangles(link, "mesh")
        if not len(triangles):
            continue
        p_W = moved(triangles.reshape(-1, 3), robot.pose(q, link.name))
        p_C = (p_W - X_WC[:3, 3]) @ X_WC[:3, :3]
        in_front = p_C[:, 2].reshape(-1, 3).min(axis=1) > camera.near
        with np.errstate(divide="ignore", invalid="ignore"):
            u = p_C[:, 0] / p_C[:, 2] * camera.fx + camera.cx
            v = p_C[:, 1] / p_C[:, 2] * camera.fy + camera.cy
        for corners in np.column_stack([u, v]).reshape(-1, 6)[in_front]:
            draw.polygon(corners.tolist(), fill=1)
    return np.array(picture, dtype=bool)


def _from_meshes(surfaces: LinkSurfaces, poses: Array, points: Array) -> Array:
    return surfaces.nearest(points, poses).distance


def read_mask(file: Path, shape: tuple[int, ...]) -> Pixels:
    """A mask of an arm, white where it is.

    Raises:
        FileNotFoundError: there is none. ValueError: it has another shape.
    """
    from PIL import Image

    if not file.is_file():
        raise FileNotFoundError(f"there is no mask '{file}'")
    mask = np.asarray(Image.open(file).convert("L")) > 127
    if mask.shape != shape:
        raise ValueError(f"mask '{file}' has shape {mask.shape}, must be {shape}")
    return np.asarray(mask)


def recorded_arm(
    frame: Frame, q: Array, mask: Pixels, robot: Robot, surfaces: LinkSurfaces, camera: DepthCamera
) -> RecordedArm:
    """An image with its truths."""
    depth = frame.metres
    valid = np.isfinite(depth) & (depth >= camera.near) & (depth <= camera.far)
    points = np.zeros((*depth.shape, 3))
    points[valid] = moved(points_of(camera, depth, valid), np.asarray(camera.pose))
    distance = np.full(depth.shape, np.inf)
    distance[valid] = surfaces.nearest(points[valid], surfaces.poses(q), within=NEAR).distance
    return RecordedArm(mask, drawn_meshes(robot, q, camera), distance, points, valid)


def _ways(camera: DepthCamera, settings: CameraRecordingSettings) -> Iterator[tuple[str, DepthCamera]]:
    """The camera as given and with errors that are told, and as masks of 5 and 10 cm see it."""
    rng = np.random.default_rng(settings.seed)
    noise, given = DepthNoise(), np.asarray(camera.pose)
    off = [
        wrong(given, rng, translation=settings.translation, rotation=settings.rotation)
        for _ in range(settings.draws)
    ]
    translation, rotation = BELIEVED
    yield "given", told_camera(camera, noise, pose=given, translation=translation, rotation=rotation)
    yield "given, exact", told_camera(camera, noise, pose=given)
    for growth in GROWN:
        yield f"given, grown {100 * growth:g} cm", told_camera(camera, noise, pose=given, translation=growth)
    for pose in off:
        yield (
            "off",
            told_camera(
                camera,
                noise,
                pose=pose,
                translation=translation + settings.translation,
                rotation=rotation + settings.rotation,
            ),
        )
    for growth, pose in itertools.product(GROWN, off):
        yield f"off, grown {100 * growth:g} cm", told_camera(camera, noise, pose=pose, translation=growth)


def _joints(robot: Robot, names: Sequence[str]) -> list[int]:
    """Where the coordinates of a robot stand among the recorded joints."""
    missing = [name for name in robot.coordinate_names if name not in names]
    if missing:
        raise ValueError(
            f"the recording has no joint {missing[0]!r} of {robot.name}; it has {', '.join(names) or 'none'}"
        )
    return [list(names).index(name) for name in robot.coordinate_names]
