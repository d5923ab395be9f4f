"""`mstmm check`: validation of scenes, elements and files, without simulating or writing."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import ElementError, LoopClosureError, MstmmError

from .error_boundary import message_and_code
from .model_loading import compile_file, generate_elements
from .options import Json, flag, option, quote, require_python_file
from .run_summary import count_text
from .stored_elements import find_element
from .terminal_output import print_error, print_json, print_lines

if TYPE_CHECKING:
    from mstmm.pipeline.crosscheck import CrossCheckReport as Crosscheck
    from mstmm.runtime.engine.loops.loop_analysis import LoopAnalysis
    from mstmm.scene import Scene

Report = dict[str, Any]

_ASSEMBLED_HELP = "Print the scene with assembled initial conditions (all loops closed)."


def check(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE_OR_ELEMENT...",
            help="Scenes (.toml, .json), Python files defining elements, or element names (mstmm "
            "list).",
        ),
    ],
    echo: Annotated[bool, flag("--echo", "Print scenes with every default filled in.")] = False,
    assembled: Annotated[bool, flag("--assembled", _ASSEMBLED_HELP)] = False,
    hinge: Annotated[
        list[str] | None, option("--hinge", "FILE", "Python file that defines user elements.")
    ] = None,
    json: Json = False,
) -> None:
    """Validate scenes and element definitions, and verify kernels against their equations."""
    generate_elements(hinge or [])
    reports: list[Report] = []
    highest_code = 0
    for name in what:
        try:
            report = _check_function(name)(name)
            text, model = report.pop("text"), report.pop("model", None)
            if assembled and model is not None:
                from mstmm.pipeline.assembled_scene import assembled_scene

                report["toml"] = assembled_scene(model).to_toml()
            if (echo or assembled) and "toml" in report:
                text = report["toml"].rstrip("\n")
            if not json:
                print_lines(text)
        except MstmmError as error:
            message, code = message_and_code(error)
            highest_code = max(highest_code, code)
            report = {"ok": False, "message": message, "exit_code": code}
            if isinstance(error, LoopClosureError):
                report |= {"gap": error.gap, "nearest_pose": error.pose}
                message = "\n".join([message, *_pose_lines(name, error)])
            print_error(message)
        reports.append({"name": name, **report})
    if json:
        print_json({"ok": highest_code == 0, "checked": reports})
    if highest_code:
        raise typer.Exit(highest_code)


def _check_function(what: str) -> Callable[[str], Report]:
    from mstmm.scene.load import is_scene_file

    ending = os.path.splitext(what)[1].lower()
    if is_scene_file(what):
        return _check_scene
    if ending == ".py":
        return _check_file
    if not what or ending or "/" in what or "\0" in what or os.path.exists(what):
        raise MstmmError(
            f"{quote(what)}: expected a scene (.toml or .json), a Python file (.py) with elements,"
            " or the name of an element; mstmm list shows the names"
        )
    return _check_element


# --- scenes ---------------------------------------------------------------------------------------


def _check_scene(path: str) -> Report:
    """Validate, compile, and evaluate the accelerations once."""
    import mstmm
    from mstmm.runtime.packing.simplification import COUNT_TEXTS
    from mstmm.runtime.run.step_stability import find_fastest_motion

    scene = mstmm.load_scene(path)
    model = compile_file(path, scene)
    sizes = {
        "bodies": len(scene.bodies), "beams": len(scene.beam), "elastic": len(scene.elastic),
        "hinges": len(scene.hinges), "coordinates": model.nq, "speeds": model.nu,
        "springs": len(scene.spring), "bushings": len(scene.bushing), "loads": len(scene.load),
        "events": len(scene.event),
    }  # fmt: skip
    notes = [
        f"{name}: {note}" for name, body in model.flexible_bodies.items() for note in body.notes
    ]
    notes += [str(one) for one in model.simplifications if one.kind in COUNT_TEXTS]
    warnings = list(scene.warnings)
    warnings += (text for body in model.flexible_bodies.values() for text in body.warnings)
    is_examined = model.nu <= _MAX_EXAMINED_SPEEDS
    fastest = find_fastest_motion(model.looped, *model.initial_state()) if is_examined else None
    report = {
        "ok": True, "kind": "scene", **sizes, "warnings": warnings, "choices": notes,
        "loops": _loop_data(model.loops),
        "fastest": None if fastest is None else {"rate": fastest[0], "element": fastest[1]},
    }  # fmt: skip
    lines = [_scene_text(path, scene, sizes, warnings, notes), *_loop_lines(model.loops)]
    if fastest is not None:
        lines.append(_fastest_line(*fastest))
    text = "\n".join(lines)
    return {**report, "toml": scene.to_toml(), "text": text, "model": model}


#: Largest number of speeds for which the fastest motion is determined.
_MAX_EXAMINED_SPEEDS = 10_000

#: Rate (1/s) of a motion above which explicit methods need many steps.
_MIN_FAST_RATE = 1e4


def _fastest_line(rate: float, element: str) -> str:
    """Line with the fastest motion at the start, and its step limit for explicit methods."""
    line = f"  fastest motion at the start: {rate:.3g} 1/s, by {element}"
    if rate < _MIN_FAST_RATE:
        return line
    return f"{line}; explicit methods need at least {rate / 6:.1g} steps per second: --method auto"


#: Nouns that are not the plural without its s: singular, and the plural where it differs.
_NOUNS = {"bodies": ("body", "bodies"), "elastic": ("elastic body", "elastic bodies")}


def _scene_text(
    path: str, scene: Scene, sizes: dict[str, int], warnings: list[str], choices: list[str]
) -> str:
    counts = ", ".join(
        count_text(number, *_NOUNS.get(name, (name.removesuffix("s"),)))
        for name, number in sizes.items() if number
    )  # fmt: skip
    lines = [f"{path}: ok; {counts or 'empty scene'}", *(f"  note: {w}" for w in warnings)]
    lines += [f"  {choice}" for choice in choices]
    return "\n".join(lines + _tree_lines(scene))


#: Largest number of bodies, loops and coordinates that are listed.
_MAX_SHOWN = 40


def _tree_lines(scene: Scene) -> list[str]:
    """Lines of the tree of bodies, each with its inboard hinge."""
    from mstmm.scene.checks.topology import build_topology

    skeleton = scene.skeleton
    tree = build_topology(skeleton)
    depth: dict[int, int] = {-1: 0}  # of the first body of every run
    lines = ["  ground"] if tree.runs else []
    shown_count = 0
    for run in tree.runs:
        if len(lines) > _MAX_SHOWN:
            break
        run_start = max((p for p in depth if p <= run.parent), default=-1)
        first = 1 + (depth[run_start] + run.parent - run_start if run_start >= 0 else 0)
        depth[run.position] = first
        hinge, body = skeleton.hinges[run.hinge], skeleton.bodies[run.body]
        description = f"{body.name}  ({hinge.name}: {hinge.type})"
        if run.count > 1:
            last = skeleton.bodies.name(run.body + run.count - 1)
            description = f"{body.name} to {last}  ({hinge.type})"
        lines.append("  " + "  " * min(first, 20) + description)
        shown_count += run.count
    if shown_count < tree.count:
        lines.append(f"  ... and {tree.count - shown_count} more bodies")
    for number in tree.cut_hinges[:_MAX_SHOWN]:
        cut = skeleton.hinges[number]
        lines.append(f"  {cut.name}: {cut.type} closes a loop: {cut.inboard} - {cut.outboard}")
    if len(tree.cut_hinges) > _MAX_SHOWN:
        lines.append(f"  ... and {len(tree.cut_hinges) - _MAX_SHOWN} more loops")
    return lines


def _loop_data(loops: LoopAnalysis) -> Report | None:
    """Data of `model.loops`, for JSON; None without closed loops."""
    if not loops.constraint_rows:
        return None
    gap, name, direction = loops.redundancy_gap
    return {
        "rows": len(loops.constraint_rows), "rank": loops.rank, "mobility": loops.mobility,
        "shapes": loops.flexible_mobility, "cut": list(loops.cut_hinges),
        "dropped": [
            {"of": row[0], "direction": row[1], "momentary": row in loops.redundant_in_this_pose}
            for row in loops.redundant_rows
        ],
        "singular": loops.singular, "nearby": loops.generic_rank,
        "misfit": {"gap": gap, "of": name, "direction": direction} if name else None,
        "reactions_unique": not loops.indeterminate_reactions,
        "not_unique": {
            owner: list(words) for owner, words in loops.indeterminate_reactions.items()
        },
    }  # fmt: skip


def _loop_lines(loops: LoopAnalysis) -> list[str]:
    """Lines about closed loops: rank, mobility, redundant rows, indeterminate loads."""
    if not loops.constraint_rows:
        return []
    lines = [f"  loops: {loops.summary}"]
    if loops.redundant_rows:
        lines.append(f"  loops: redundant rows: {loops.redundant_text(_MAX_SHOWN)}")
    if loops.singular:
        lines.append(
            f"  loops: the start is a singular configuration: {loops.rank} independent rows "
            f"there, {loops.generic_rank} nearby"
        )
    if loops.redundancy_gap[0]:
        gap, name, word = loops.redundancy_gap
        lines.append(
            f"  loops: {word} of {name} is redundant, violated by {gap:.1e} (m, rad): "
            "correct axes or lengths"
        )
    if loops.indeterminate_reactions:
        lines.append(f"  loops: indeterminate loads of rigid bodies: {loops.indeterminate_text}")
    return lines


def _pose_lines(path: str, error: LoopClosureError) -> list[str]:
    """Lines with the nearest pose of a loop that cannot be closed, and how to display it."""
    lines = [
        f"  nearest pose: {name}: q = {', '.join(f'{x:.6g}' for x in q)}"
        for name, q in list(error.pose.items())[:_MAX_SHOWN]
    ]
    rest_count = len(error.pose) - len(lines)
    lines += [f"  ... and {rest_count} more"] if rest_count > 0 else []
    return [*lines, f"  to display it: mstmm view {quote(path)}"]


# --- elements -------------------------------------------------------------------------------------


def _check_element(name: str) -> Report:
    """Cross-check a built-in or stored element: equations, intermediate representation and C."""
    from mstmm.pipeline.crosscheck import crosscheck

    return _crosscheck_report([crosscheck(*find_element(name))])


def _check_file(path: str) -> Report:
    """Cross-check every element that a Python file defines; the file is executed."""
    from mstmm.derive.catalogue.registry import load_file
    from mstmm.derive.verification.definition_checks import check_element
    from mstmm.pipeline.crosscheck import crosscheck_definition

    reports = []
    for element in load_file(require_python_file(path)):
        check_element(element)
        reports.append(crosscheck_definition(element))
    return _crosscheck_report(reports)


def _crosscheck_report(reports: list[Crosscheck]) -> Report:
    failed = [report for report in reports if not report.passed]
    if failed:
        raise ElementError("\n".join(str(report) for report in failed))
    text = "\n".join(str(report) for report in reports)
    return {"ok": True, "elements": [report.to_json() for report in reports], "text": text}
