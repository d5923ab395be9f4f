"""Self-contained interactive page of a scene, without network access (extra: view)."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure
from mstmm.optional_packages import missing_package_error

from ..observations import quaternions
from .projection import FIELD_OF_VIEW, choose_camera
from .scene_graph import DeformingSurface, Line, Poses, SceneGraph, Solid
from .solid_meshes import axes_along

#: Positions closer than this, relative to the size of the scene, and quaternions closer than this,
#: are equal.
_POSE_TOLERANCE = 1e-5
#: Position of unselected objects, m, of a scene drawn at 100 m at most.
_HIDDEN_DISTANCE = 1e6
#: Sizes (m) between which viser shows a whole scene, and the size to which others are scaled.
_MIN_SIZE, _MAX_SIZE, _SCALED_SIZE = 0.5, 100.0, 10.0
#: Width of the grid and its distance below everything, relative to the size of the scene; its
#: colours.
_GRID_WIDTH, _GRID_DISTANCE = 1.3, 0.04
_CELL_COLOUR, _SECTION_COLOUR = (186, 190, 196), (150, 154, 160)


def render_page(stage: SceneGraph) -> str:
    """Page as text. EnvironmentFailure without the extra."""
    if not _MIN_SIZE < stage.size < _MAX_SIZE:
        stage = stage.with_scale(_SCALED_SIZE / stage.size)
    with _start_server() as server:
        recorder = server.get_scene_serializer()
        animated_scene = _AnimatedScene(server.scene, stage)
        view_camera = choose_camera(stage)
        server.scene.set_up_direction(tuple(stage.up))
        server.initial_camera.position = tuple(view_camera.position)
        server.initial_camera.look_at = tuple(view_camera.look_at)
        server.initial_camera.up = tuple(view_camera.up)
        server.initial_camera.fov = float(FIELD_OF_VIEW)
        server.scene.configure_default_lights(cast_shadow=False)
        _add_grid(server.scene, stage)
        for k in range(len(stage.times)):
            animated_scene.show_frame(k)
            if k + 1 < len(stage.times):
                duration = float(stage.times[-1] - stage.times[0])
                recorder.insert_sleep(duration / stage.speed / (len(stage.times) - 1))
        text: str = recorder.as_html()
    return _insert_script(text, stage)


@contextmanager
def _start_server() -> Iterator[Any]:
    """Start the server that records a scene; it listens on this machine only, temporarily."""
    try:
        import viser
    except ImportError as error:
        raise missing_package_error("view", "an animation page", error) from None
    try:
        with _silence_console():
            server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    except OSError as error:
        raise EnvironmentFailure(
            f"animation page: viser cannot open a port on this machine ({error}); "
            "write a film or a strip of frames instead: use a name ending in .gif or .png"
        ) from None
    try:
        yield server
    finally:
        with _silence_console():
            server.stop()


@contextmanager
def _silence_console() -> Iterator[None]:
    """Suppress the console output of viser about its server, on a terminal and in a notebook."""
    import rich

    console = rich.get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = was_quiet


class _AnimatedScene:
    """Scene of a server, advanced from one frame to the next."""

    def __init__(self, scene: Any, stage: SceneGraph) -> None:
        self.scene, self.stage = scene, stage
        self.pose_tolerance = _POSE_TOLERANCE * stage.size
        self.clock = scene.add_frame("/clock", show_axes=False)
        for name in stage.choices:  # hidden until selected
            offset = (0.0 if name == stage.choices[0] else _HIDDEN_DISTANCE, 0.0, 0.0)
            scene.add_frame(f"/{name}", show_axes=False, position=offset)
        self.frames = {
            owner: scene.add_frame(f"/{owner}", show_axes=False)
            for owner in {**stage.poses, **stage.labels}
        }
        self.shown_poses: dict[str, tuple[Array, Array]] = {}
        for solid in stage.solids:
            self._add(solid)
        self.deforming_surfaces = [
            (bent, self._add_deforming_surface(bent)) for bent in stage.deforming_surfaces
        ]
        self.lines = [(line, self._draw(line)) for line in stage.lines]

    def _add(self, solid: Solid) -> None:
        self.scene.add_mesh_simple(
            f"/{solid.owner}/{solid.part}",
            vertices=solid.surface.vertices.astype(np.float32),
            faces=solid.surface.faces.astype(np.uint32), color=solid.colour,
            opacity=None if solid.opacity == 1 else solid.opacity, visible=not solid.hidden,
        )  # fmt: skip

    def _add_deforming_surface(self, bent: DeformingSurface) -> Any:
        return self.scene.add_mesh_simple(
            f"/{bent.name}", vertices=bent.vertices[0].astype(np.float32),
            faces=bent.faces.astype(np.uint32), color=bent.colour,
        )  # fmt: skip

    def _draw(self, line: Line) -> Any:
        return self.scene.add_line_segments(
            f"/{line.name}", points=_line_segments(line.points[0]), colors=line.colour,
            thickness=line.width * self.stage.size / 1000,
        )  # fmt: skip

    def show_frame(self, k: int) -> None:
        """Move the objects that moved to frame k."""
        self.clock.position = (float(k), 0.0, 0.0)
        for owner, pose in self.stage.poses.items():
            self._pose(owner, pose, min(k, len(pose.position) - 1))
        for bent, handle in self.deforming_surfaces if k else ():
            handle.vertices = bent.vertices[k].astype(np.float32)
        for line, handle in self.lines if k else ():
            if len(line.points) > 1:
                handle.points = _line_segments(line.points[k])

    def _pose(self, owner: str, pose: Poses, k: int) -> None:
        position, quaternion = pose.position[k], pose.quaternion[k]
        shown_pose = self.shown_poses.get(owner)
        frame = self.frames[owner]
        if shown_pose is None or np.abs(position - shown_pose[0]).max() > self.pose_tolerance:
            frame.position = tuple(position)
        else:
            position = shown_pose[0]
        if shown_pose is None or np.abs(quaternion - shown_pose[1]).max() > _POSE_TOLERANCE:
            frame.wxyz = tuple(quaternion)
        else:
            quaternion = shown_pose[1]
        self.shown_poses[owner] = position, quaternion


def _line_segments(points: Array) -> Any:
    """Segments (n - 1, 2, 3) of a polyline (n, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def _add_grid(scene: Any, stage: SceneGraph) -> None:
    """Add a grid normal to up, below everything."""
    low, high = stage.corners()
    up, middle = stage.up, (low + high) / 2
    floor = float((stage.cloud @ up).min()) - _GRID_DISTANCE * stage.size
    cell = 10.0 ** np.floor(np.log10(stage.size / 2))
    width = float(np.ceil(_GRID_WIDTH * stage.size / cell) * cell)
    axes = axes_along(up)
    scene.add_grid(
        "/grid", width=width, height=width, plane="xy", cell_size=float(cell / 5),
        section_size=float(cell), cell_color=_CELL_COLOUR, section_color=_SECTION_COLOUR,
        shadow_opacity=0.0, wxyz=tuple(quaternions(axes.reshape(1, 9))[0]),
        position=tuple(middle + (floor - middle @ up) * up),
    )  # fmt: skip


def _insert_script(text: str, stage: SceneGraph) -> str:
    """Page with its title, the labels of bodies and hinges, and the script that shows them."""
    page_data = json.dumps(_page_data(stage), separators=(",", ":")).replace("<", "\\u003c")
    script = files(__package__).joinpath("page.js").read_text(encoding="utf-8")
    head = text.index("</head>")
    script_element = f"<script>window.MSTMM={page_data};\n{script}</script>"
    text = text[:head] + script_element + text[head:]
    title = f"<title>{escape(stage.title)}</title>"
    title_start, end = text.find("<title>"), text.find("</title>")
    if title_start < 0:
        return text.replace("<head>", f"<head>{title}", 1)
    return text[:title_start] + title + text[end + len("</title>") :]


def _page_data(stage: SceneGraph) -> dict[str, Any]:
    """Data of the script: numbers as little-endian floats in base64."""
    owners = {
        f"/{owner}": {
            "name": label.name, "text": label.text, "anchor": [float(x) for x in label.anchor],
            "labels": label.labels, "values": _encode_floats(label.values),
        }
        for owner, label in stage.labels.items()
    }  # fmt: skip
    return {
        "title": stage.title, "speed": stage.speed, "times": _encode_floats(stage.times),
        "digits": stage.digits, "notes": stage.notes, "owners": owners, "clock": stage.clock,
        "choices": stage.choices, "away": _HIDDEN_DISTANCE,
    }  # fmt: skip


def _encode_floats(numbers: Array) -> str:
    return b64encode(np.ascontiguousarray(numbers, dtype="<f4").tobytes()).decode("ascii")
