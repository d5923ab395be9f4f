"""`mstmm export`: conversion of a scene to URDF."""

from __future__ import annotations

from typing import Annotated

import typer

from .import_robot import grouped_notes
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
    from mstmm.runtime.platform_support.safe_files import write_text

    from .terminal_output import print_json, print_lines

    target = new_file(output, scene, ".urdf")
    robot = mstmm.export_robot(mstmm.load_scene(scene), target.stem)
    write_text(target, robot.text)
    if json:
        notes = [{"element": n.element, "text": n.text} for n in robot.notes]
        print_json({"robot": str(target), "notes": notes})
        return
    for line in grouped_notes(robot.notes, "scene"):
        print_lines(line)
    print_lines(f"{target}: {robot.summary}")
