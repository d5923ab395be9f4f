"""`mstmm export`: conversion of a scene to URDF."""

from __future__ import annotations

from typing import Annotated

import typer

from .import_robot import together
from .options import Json, new_file


def export_robot(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Robot file, .urdf; default: scene "
                     "name, current folder."),
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Convert a scene to URDF, and list what could not be converted."""
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
