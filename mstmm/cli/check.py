"""`mstmm check`: validation of scenes, elements and files, without simulating or writing."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import ElementError, MstmmError, OpenLoop

from .options import Json, python_file, quoted

if TYPE_CHECKING:
    from mstmm.bridge.crosscheck import Report as Crosscheck
    from mstmm.runtime.engine.loops.closed import Loops
    from mstmm.runtime.model.model import Model
    from mstmm.scene import Scene
    from mstmm.scene.checks.topology import Topology

Report = dict[str, Any]


def check(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE_OR_ELEMENT...",
            help="Scenes (.toml, .json), Python files defining elements, or element names (mstmm "
            "list).",
        ),
    ],
    echo: Annotated[
        bool, typer.Option("--echo", help="Print scenes with every default filled in.")
    ] = False,
    assembled: Annotated[
        bool,
        typer.Option(
            "--assembled",
            help="Print the scene with assembled initial conditions (all loops closed).",
        ),
    ] = False,
    hinge: Annotated[
        list[str] | None,
        typer.Option("--hinge", metavar="FILE", help="Python file that defines user elements."),
    ] = None,
    json: Json = False,
) -> None:
    """Validate scenes and element definitions, and verify kernels against their equations."""
    from .explain import explain
    from .output import complain, emit_json, say

    if hinge:
        from .models import use_files

        use_files(hinge)
    reports: list[Report] = []
    worst = 0
    for each in what:
        try:
            report = _checker(each)(each)
            text, model = report.pop("text"), report.pop("model", None)
            if assembled and model is not None:
                report["toml"] = _assembled(model)
            if (echo or assembled) and "toml" in report:
                text = report["toml"].rstrip("\n")
            if not json:
                say(text)
        except MstmmError as error:
            message, code = explain(error)
            worst = max(worst, code)
            report = {"ok": False, "message": message, "exit_code": code}
            if isinstance(error, OpenLoop):
                report |= {"gap": error.gap, "nearest_pose": error.pose}
                message = "\n".join([message, *_pose_lines(each, error)])
            complain(message)
        reports.append({"name": each, **report})
    if json:
        emit_json({"ok": worst == 0, "checked": reports})
    if worst:
        raise typer.Exit(worst)


def _checker(what: str) -> Callable[[str], Report]:
    from mstmm.scene.load import is_scene_file

    ending = os.path.splitext(what)[1].lower()
    if is_scene_file(what):
        return _scene
    if ending == ".py":
        return _file
    if not what or ending or "/" in what or "\0" in what or os.path.exists(what):
        raise MstmmError(
            f"{quoted(what)}: expected a scene (.toml or .json), a Python file (.py) with elements,"
            " or the name of an element; mstmm list shows the names"
        )
    return _element


# --- scenes ---------------------------------------------------------------------------------------


def _scene(path: str) -> Report:
    """Validate, compile, and evaluate the accelerations once."""
    import mstmm
    from mstmm.runtime.pack.merge.simplification import COUNTED
    from mstmm.runtime.run.stability import find_fastest_motion

    from .models import compiled

    scene = mstmm.load_scene(path)
    model = compiled(path, scene)
    sizes = {
        "bodies": len(scene.bodies), "beams": len(scene.beam), "elastic": len(scene.elastic),
        "hinges": len(scene.hinges), "coordinates": model.nq, "speeds": model.nu,
        "springs": len(scene.spring), "bushings": len(scene.bushing), "loads": len(scene.load),
        "events": len(scene.event),
    }  # fmt: skip
    notes = [f"{name}: {note}" for name, body in model.flexible.items() for note in body.notes]
    notes += [str(one) for one in model.simplifications if one.kind in COUNTED]
    warnings = [*scene.warnings, *(w for body in model.flexible.values() for w in body.warnings)]
    small = model.nu <= _EXAMINED
    fastest = find_fastest_motion(model.looped, *model.initial_state()) if small else None
    report = {
        "ok": True, "kind": "scene", **sizes, "warnings": warnings, "choices": notes,
        "loops": _loops(model.loops),
        "fastest": None if fastest is None else {"rate": fastest[0], "element": fastest[1]},
    }  # fmt: skip
    lines = [_scene_text(path, scene, sizes, warnings, notes), *_loop_lines(model.loops)]
    if fastest is not None:
        lines.append(_fastest_line(*fastest))
    text = "\n".join(lines)
    return {**report, "toml": scene.to_toml(), "text": text, "model": model}


#: Largest number of speeds for which the fastest motion is determined.
_EXAMINED = 10_000

#: Rate (1/s) of a motion above which explicit methods need many steps.
_FAST = 1e4


def _fastest_line(rate: float, element: str) -> str:
    """Line with the fastest motion at the start, and its step limit for explicit methods."""
    line = f"  fastest motion at the start: {rate:.3g} 1/s, by {element}"
    if rate < _FAST:
        return line
    return f"{line}; explicit methods need at least {rate / 6:.1g} steps per second: --method auto"


def _assembled(model: Model) -> str:
    from mstmm.bridge.assembled import assembled

    return assembled(model).to_toml()


_ONE = {
    "bodies": "body", "beams": "beam", "elastic": "elastic body", "hinges": "hinge",
    "coordinates": "coordinate", "speeds": "speed", "springs": "spring", "bushings": "bushing",
    "loads": "load", "events": "event",
}  # fmt: skip


_MANY = {"elastic": "elastic bodies"}


def _scene_text(
    path: str, scene: Scene, sizes: dict[str, int], warnings: list[str], choices: list[str]
) -> str:
    from . import summary

    said = ", ".join(
        summary.count(number, _ONE[name], _MANY.get(name, name))
        for name, number in sizes.items()
        if number
    )
    lines = [f"{path}: ok; {said or 'empty scene'}", *(f"  note: {w}" for w in warnings)]
    lines += [f"  {choice}" for choice in choices]
    return "\n".join(lines + _tree_lines(scene))


#: Largest number of bodies, loops and coordinates that are listed.
_SHOWN = 40


def _tree_lines(scene: Scene) -> list[str]:
    """Lines of the tree of bodies, each with its inboard hinge."""
    from mstmm.scene.checks.topology import build

    skeleton = scene.skeleton
    tree = build(skeleton)
    depth: dict[int, int] = {-1: 0}  # of bodies that may carry others
    lines = ["  ground"] if tree.runs else []
    shown = 0
    for run in tree.runs:
        if len(lines) > _SHOWN:
            break
        first = 1 + _depth(tree, depth, run.parent)
        depth[run.place] = first
        hinge, body = skeleton.hinges[run.hinge], skeleton.bodies[run.body]
        what = f"{body.name}  ({hinge.name}: {hinge.type})"
        if run.count > 1:
            last = skeleton.bodies.name(run.body + run.count - 1)
            what = f"{body.name} to {last}  ({hinge.type})"
        lines.append("  " + "  " * min(first, 20) + what)
        shown += run.count
    if shown < tree.count:
        lines.append(f"  ... and {tree.count - shown} more bodies")
    for number in tree.cut[:_SHOWN]:
        cut = skeleton.hinges[number]
        lines.append(f"  {cut.name}: {cut.type} closes a loop: {cut.inboard} - {cut.outboard}")
    if len(tree.cut) > _SHOWN:
        lines.append(f"  ... and {len(tree.cut) - _SHOWN} more loops")
    return lines


def _loops(loops: Loops) -> Report | None:
    """Data of `model.loops`, for JSON; None without closed loops."""
    if not loops.rows:
        return None
    gap, name, direction = loops.misfit
    return {
        "rows": len(loops.rows), "rank": loops.rank, "mobility": loops.mobility,
        "shapes": loops.shapes, "cut": list(loops.cut),
        "dropped": [
            {"of": of, "direction": word, "momentary": (of, word) in loops.momentary}
            for of, word in loops.redundant
        ],
        "singular": loops.singular, "nearby": loops.nearby,
        "misfit": {"gap": gap, "of": name, "direction": direction} if name else None,
        "reactions_unique": not loops.not_unique,
        "not_unique": {of: list(words) for of, words in loops.not_unique.items()},
    }  # fmt: skip


def _loop_lines(loops: Loops) -> list[str]:
    """Lines about closed loops: rank, mobility, redundant rows, indeterminate loads."""
    if not loops.rows:
        return []
    lines = [f"  loops: {loops.counted}"]
    if loops.redundant:
        lines.append(f"  loops: redundant rows: {loops.repeated(_SHOWN)}")
    if loops.singular:
        lines.append(
            f"  loops: the start is a singular configuration: {loops.rank} independent rows "
            f"there, {loops.nearby} nearby"
        )
    if loops.misfit[0]:
        gap, name, word = loops.misfit
        lines.append(
            f"  loops: {word} of {name} is redundant, violated by {gap:.1e} (m, rad): "
            "correct axes or lengths"
        )
    if loops.not_unique:
        lines.append(f"  loops: indeterminate loads of rigid bodies: {loops.open_loads}")
    return lines


def _pose_lines(path: str, error: OpenLoop) -> list[str]:
    """Lines with the nearest pose of a loop that cannot be closed, and how to display it."""
    lines = [
        f"  nearest pose: {name}: q = {', '.join(f'{x:.6g}' for x in q)}"
        for name, q in list(error.pose.items())[:_SHOWN]
    ]
    more = len(error.pose) - len(lines)
    lines += [f"  ... and {more} more"] if more > 0 else []
    return [*lines, f"  to display it: mstmm view {quoted(path)}"]


def _depth(tree: Topology, depth: dict[int, int], place: int) -> int:
    """Depth of a body in the tree; `depth` has that of the first body of every run."""
    first = max((p for p in depth if p <= place), default=-1)
    return depth[first] + place - first if first >= 0 else 0


# --- elements -------------------------------------------------------------------------------------


def _element(name: str) -> Report:
    """Cross-check a built-in or stored element: equations, intermediate representation and C."""
    from mstmm.bridge.crosscheck import crosscheck

    from .names import found

    return _report([crosscheck(*found(name))])


def _file(path: str) -> Report:
    """Cross-check every element that a Python file defines; the file is executed."""
    from mstmm.bridge.crosscheck import crosscheck_definition
    from mstmm.derive.audit.definition import check as check_element
    from mstmm.derive.catalogue.registry import load_file

    reports = []
    for element in load_file(python_file(path)):
        check_element(element)
        reports.append(crosscheck_definition(element))
    return _report(reports)


def _report(reports: list[Crosscheck]) -> Report:
    wrong = [report for report in reports if not report.passed]
    if wrong:
        raise ElementError("\n".join(str(report) for report in wrong))
    text = "\n".join(str(report) for report in reports)
    return {"ok": True, "elements": [report.to_json() for report in reports], "text": text}
