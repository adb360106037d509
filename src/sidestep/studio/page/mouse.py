"""The ball that follows the mouse, and files that are dropped on the page.

viser tells of clicks and drags, not of a mouse that moves. A few lines of JavaScript write where it is into a hidden
text field of the page, which travels through the same guarded connection as every other control.
"""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import from_quaternion, pose_at
from sidestep.studio import messages as m
from sidestep.studio.gallery import MOUSE_BALL, MOUSE_BALL_RADIUS

if TYPE_CHECKING:
    import viser

Array = npt.NDArray[np.float64]

FIELD, DROP = (
    "mouse-place",
    "Load a robot …",
)  # labels of the hidden field and of the button that takes dropped files
FARTHEST = 1.6  # [m] from the base, which stands at the origin
SCRIPT = """
const row = () => {
  let box = [...document.querySelectorAll('label')].find(label => label.textContent.trim() === '%(field)s');
  while (box && !box.querySelector('input')) box = box.parentElement;
  return box;
};
const write = text => {
  const input = row()?.querySelector('input');
  if (!input || input.value === text) return;
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(input, text);
  input.dispatchEvent(new Event('input', {bubbles: true}));
};
let next = '', waiting = 0;
document.addEventListener('pointermove', event => {
  if (event.buttons || event.target.tagName !== 'CANVAS') return;
  const box = event.target.getBoundingClientRect();
  const place = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  next = place.map(x => x.toFixed(4)).join(' ');
  waiting ||= setTimeout(() => { waiting = 0; write(next); }, 40);
});
document.addEventListener('dragover', event => event.preventDefault());
document.addEventListener('drop', event => {
  if (!event.dataTransfer.files.length) return;
  event.preventDefault();
  const button = [...document.querySelectorAll('button')].find(one => one.innerText.trim() === '%(drop)s');
  const input = button?.parentElement.querySelector('input[type=file]');
  if (!input) return;
  input.files = event.dataTransfer.files;
  input.dispatchEvent(new Event('change', {bubbles: true}));
});
setInterval(() => {
  const box = row();
  if (!box || box.style.position) return;
  box.style.cssText = 'position:absolute;width:1px;height:1px;overflow:hidden;opacity:0;pointer-events:none';
  box.querySelector('input').tabIndex = -1;
}, 300);
"""


class MouseBall:
    """Draws the obstacle `MOUSE_BALL` to where the mouse is, in a plane through it that faces the camera.

    Args:
        server: gets the hidden field, where it is called. send: to the loop.
        place: of the ball (3,), None: there is none. follows: whether it is to follow now.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        send: Callable[[m.Command], None],
        place: Callable[[], Array | None],
        follows: Callable[[], bool],
    ) -> None:
        self._send, self._place, self._follows = send, place, follows
        self._field: Any = server.gui.add_text(FIELD, "")
        self._field.on_update(self._pointed)
        code = html.escape(SCRIPT % {"field": FIELD, "drop": DROP}, quote=True)
        server.gui.add_html(
            f'<img alt="" style="display:none" src="data:," onerror="if(!window.sidestepMouse)'
            f'{{window.sidestepMouse=true;{code}}}">'
        )

    async def _pointed(self, event: Any) -> None:  # async: in order
        ball = self._place()
        if event.client is None or ball is None or not self._follows():
            return
        words = str(self._field.value).split()
        if len(words) != 2:
            return
        camera = event.client.camera
        ray = ray_through(float(words[0]), float(words[1]), camera)
        axes = from_quaternion(np.array(camera.wxyz))
        place = on_plane(np.array(camera.position), ray, ball, axes[:, 2])
        if place is not None:
            self._send(m.DragObstacle(MOUSE_BALL, pose_at(within_reach(place))))


def ray_through(right: float, down: float, camera: Any) -> Array:
    """The direction (3,) from a camera through a place of its picture, in shares of width and height."""
    half = float(np.tan(0.5 * camera.fov))
    x, y = (2.0 * right - 1.0) * half * camera.aspect, (2.0 * down - 1.0) * half
    ray: Array = from_quaternion(np.array(camera.wxyz)) @ np.array([x, y, 1.0])
    return ray / np.linalg.norm(ray)


def on_plane(begin: Array, ray: Array, through: Array, normal: Array) -> Array | None:
    """Where a ray (3,) from a point (3,) meets a plane through another; None where it does not."""
    along = float(ray @ normal)
    if along < 1e-6:
        return None
    place: Array = begin + float((through - begin) @ normal) / along * ray
    return place


def within_reach(place: Array) -> Array:
    """The place (3,), or the nearest one above the ground and not far from the arm."""
    far = float(np.linalg.norm(place))
    nearer = place * min(1.0, FARTHEST / max(far, 1e-9))
    return np.array([nearer[0], nearer[1], max(nearer[2], MOUSE_BALL_RADIUS)])
