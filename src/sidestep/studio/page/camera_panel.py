"""The tab of the depth camera: what is chosen, what it sees, and what that cost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import look_at
from sidestep.studio import messages as m
from sidestep.studio.camera_choice import HAND, HEIGHT, PLACES, WIDTH, CameraChoice, camera_at
from sidestep.studio.page.camera_words import words_of
from sidestep.studio.page.labelled_image import labelled_image
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.note import add_note

if TYPE_CHECKING:
    import viser

Array = npt.NDArray[np.float64]

VIEWER = "from my view"
FREE, CLOSED = "free", "closed"
SCENE, ONLY = "scene and camera", "camera only"
NOISES = {"none": "none", "d435": "d435", "kinect": "kinect", "structured light": "structured_light"}
NOTE = (
    "The camera sees the simulated scene; the arm is taken out of its images, and the rest becomes obstacles. With "
    "camera only, the controller knows nothing else. Changing place or noise forgets what was seen."
)


class CameraPanel:
    """Switches the camera of the loop, and shows its image."""

    def __init__(self, server: viser.ViserServer, loop: LoopLink) -> None:
        self._loop = loop
        gui = server.gui
        self._on: Any = gui.add_checkbox("depth camera", False)
        self._known: Any = gui.add_dropdown("controller knows", (SCENE, ONLY), initial_value=ONLY)
        self._place: Any = gui.add_dropdown("place", (*PLACES, HAND, VIEWER))
        self._view: Any = gui.add_button("Place it where I look from")
        self._image: Any = gui.add_image(np.zeros((HEIGHT, WIDTH, 3), np.uint8), format="png", visible=False)
        self._words: Any = gui.add_html("")
        self._unseen: Any = gui.add_dropdown("unseen space is", (FREE, CLOSED))
        self._noise: Any = gui.add_dropdown("noise", tuple(NOISES), initial_value="d435")
        self._rate: Any = gui.add_slider("rate [Hz]", min=5, max=30, step=1, initial_value=10)
        self._latency: Any = gui.add_slider("latency [ms]", min=0, max=200, step=10, initial_value=50)
        add_note(gui, NOTE)
        self._seen_from: tuple[Array, str] | None = None  # of the present view
        self._shown = 0
        self._choice: tuple[object, ...] = (False,)
        self._view.on_click(self._take_view)
        for control in (
            self._on,
            self._place,
            self._known,
            self._unseen,
            self._noise,
            self._rate,
            self._latency,
        ):
            control.on_update(self._changed)

    def show(self, snapshot: m.Snapshot) -> None:
        """Shows what the camera of the loop sees."""
        state = snapshot.camera
        self._show_choice(state.choice)
        if state.error and self._on.value:
            self._on.value = False
        words = words_of(state, running=snapshot.running)
        if words != self._words.content:
            self._words.content = words
        sight = state.sight
        if self._image.visible != (sight is not None):
            self._image.visible = sight is not None
        if sight is not None and sight.number != self._shown:
            self._image.image = labelled_image(sight.depth, sight.labels)
        self._shown = 0 if sight is None else sight.number

    def _show_choice(self, choice: CameraChoice | None) -> None:
        """Shows what is chosen, where that has changed: by this window, another one, or a program."""
        known = (False,) if choice is None else settings_of(choice)
        if known == self._choice:
            return
        self._choice = known
        self._on.value = choice is not None
        if choice is not None:
            self._known.value = ONLY if choice.only else SCENE
            self._place.value = choice.place if choice.place in self._place.options else VIEWER
            self._unseen.value = FREE if choice.unseen_is_free else CLOSED
            self._noise.value = next(label for label, name in NOISES.items() if name == choice.noise)
            self._rate.value, self._latency.value = round(choice.rate), round(1e3 * choice.latency)

    def _take_view(self, event: Any) -> None:
        if event.client is None:
            return
        camera = event.client.camera
        with self._loop.telling(event.client):
            pose = look_at(
                np.array(camera.position), np.array(camera.look_at), up=np.array(camera.up_direction)
            )
            self._seen_from = pose, ""
            self._place.value = VIEWER
            self._send()

    def _changed(self, event: Any) -> None:
        if event.client is None:
            return
        with self._loop.telling(event.client):
            if self._place.value == VIEWER and self._seen_from is None:
                self._take_view(event)
            else:
                self._send()

    def _send(self) -> None:
        if not self._on.value:
            if self._choice != (False,):
                self._loop.send(m.SetCamera(None))
            return
        place = str(self._place.value)
        known = self._seen_from if place == VIEWER else None
        pose, link = known or camera_at(place, self._loop.robot)
        self._loop.send(
            m.SetCamera(
                CameraChoice(
                    pose,
                    link,
                    place,
                    noise=NOISES[str(self._noise.value)],
                    rate=float(self._rate.value),
                    latency=1e-3 * float(self._latency.value),
                    unseen_is_free=self._unseen.value == FREE,
                    only=self._known.value == ONLY,
                )
            )
        )


def settings_of(choice: CameraChoice) -> tuple[object, ...]:
    """What the controls show of a choice."""
    return choice.place, choice.only, choice.unseen_is_free, choice.noise, choice.rate, choice.latency
