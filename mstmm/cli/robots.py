"""`mstmm import` and `mstmm export`: conversion of robot files to scenes, and of scenes to URDF."""

from __future__ import annotations

import shutil
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.display import abbreviate_names

from .options import Json, SceneFile, flag, new_file, option, parse_positive
from .terminal_output import print_json, print_lines

if TYPE_CHECKING:
    from mstmm.scene.robots.robot_model import ImportNote
    from mstmm.scene.robots.scene_from_robot import ImportedRobot

#: Largest number of elements named in one note.
_MAX_NAMED = 4

_SCENE_OUTPUT_HELP = "Scene file, .toml; default: robot name, current folder."
_ROBOT_OUTPUT_HELP = "Robot file, .urdf; default: scene name, current folder."
_BASE_HELP = "Attach the base to the ground (fixed) or leave it free."
_STOPS_HELP = "Convert joint limits to stops of this stiffness (N m/rad or N/m)."
_MIMICS_HELP = "Lock mimic joints at their initial values instead of coupling them."


def import_robot(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot file: .urdf, or MJCF (.xml, .mjcf).")
    ],
    output: Annotated[str | None, option("--output/-o", "FILE", _SCENE_OUTPUT_HELP)] = None,
    base: Annotated[str, option("--base", "fixed|free", _BASE_HELP)] = "fixed",
    keep_fixed: Annotated[
        bool, flag("--keep-fixed", "Keep links on fixed joints as separate bodies.")
    ] = False,
    stops: Annotated[
        float | None, option("--stops", "STIFFNESS", _STOPS_HELP, parse_positive)
    ] = None,
    hold_mimics: Annotated[bool, flag("--hold-mimics", _MIMICS_HELP)] = False,
    length: Annotated[
        str, option("--length", "UNIT", "Length unit of the file: m, cm, mm or in.")
    ] = "m",
    mass: Annotated[str, option("--mass", "UNIT", "Mass unit of the file: kg, g, t or lb.")] = "kg",
    json: Json = False,
) -> None:
    """Convert a robot (URDF, MJCF) to a scene, and list what could not be converted."""
    import mstmm
    from mstmm.runtime.platform_support.safe_files import write_text

    target = new_file(output, robot, ".toml")
    imported = mstmm.import_robot(
        robot, base=base, merge=not keep_fixed, stops=stops,
        mimics="held" if hold_mimics else "coupled",
        units={"length": length, "mass": mass},
    )  # fmt: skip
    imported = _with_copied_meshes(imported, target)
    write_text(target, imported.to_toml())
    if json:
        notes = [{"where": n.where, "element": n.element, "text": n.text} for n in imported.notes]
        print_json({"scene": str(target), "names": dict(imported.names), "notes": notes})
    else:
        _print_notes(imported.notes, robot, f"{target}: {imported.scene.summary}")


def _with_copied_meshes(found: ImportedRobot, target: Path) -> ImportedRobot:
    """Copy meshes from elsewhere to a folder next to the scene file, and refer to the copies.

    A scene file may refer only to files in its folder or below.
    """
    from mstmm.runtime.platform_support.safe_files import replace_atomically

    scene_folder, shapes = target.parent.resolve(), []
    folder = scene_folder / f"{target.stem}_meshes"
    copies = dict[Path, Path]()
    for shape in found.tables.get("shape", ()):
        if "file" in shape:
            mesh = Path(shape["file"]).resolve()
            if not mesh.is_relative_to(scene_folder):
                folder.mkdir(exist_ok=True)
                name = f"{len(copies)}_{mesh.name}"
                if mesh not in copies:
                    copies[mesh] = folder / name
                    with replace_atomically(folder / name) as temporary:
                        shutil.copyfile(mesh, temporary)
                mesh = copies[mesh]
            shape = shape | {"file": str(mesh.relative_to(scene_folder))}
        shapes.append(shape)
    return replace(found, tables={**found.tables, "shape": shapes})


def export_robot(
    scene: SceneFile,
    output: Annotated[str | None, option("--output/-o", "FILE", _ROBOT_OUTPUT_HELP)] = None,
    json: Json = False,
) -> None:
    """Convert a scene to URDF, and list what could not be converted."""
    import mstmm
    from mstmm.runtime.platform_support.safe_files import write_text

    target = new_file(output, scene, ".urdf")
    robot = mstmm.export_robot(mstmm.load_scene(scene), target.stem)
    write_text(target, robot.text)
    if json:
        notes = [{"element": n.element, "text": n.text} for n in robot.notes]
        print_json({"robot": str(target), "notes": notes})
    else:
        _print_notes(robot.notes, "scene", f"{target}: {robot.summary}")


def _print_notes(notes: Iterable[ImportNote], file: str, summary: str) -> None:
    """Print one line for each text of notes, with its elements and their positions in `file`."""
    elements_by_text = defaultdict[str, list[str]](list)
    for note in notes:
        position = note.where.removeprefix(file).removeprefix(": ")
        elements_by_text[note.text].append(
            f"{note.element} ({position})" if position else note.element
        )
    for text, elements in elements_by_text.items():
        print_lines(f"{abbreviate_names(elements, _MAX_NAMED)}: {text}")
    print_lines(summary)
