"""`mstmm export`: a scene as a robot's file."""

from __future__ import annotations

from typing import Annotated

import typer

from .import_robot import together
from .options import Json, new_file


def export_robot(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A scene: .toml, .json.")],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="The robot, .urdf; by default with "
                     "the scene's name, here."),
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Write the robot of a scene, and tell what of the scene URDF does not say."""
    import mstmm
    from mstmm.runtime.host.files import write_text

    from .output import emit_json, say

    target = new_file(output, scene, ".urdf")
    found = mstmm.export_robot(mstmm.load_scene(scene), target.stem)
    write_text(target, found.text)
    if json:
        notes = [{"element": n.element, "text": n.text} for n in found.notes]
        emit_json({"robot": str(target), "notes": notes})
        return
    for line in together(found.notes, "scene"):
        say(line)
    say(f"{target}: {found.summary}")
