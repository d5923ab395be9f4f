"""`mstmm doctor`: diagnosis of the environment, with two test runs."""

from __future__ import annotations

import typer

from .error_messages import ENVIRONMENT
from .options import Json


def doctor(json: Json = False) -> None:
    """Diagnose compiler, CPU, cache, packages and kernels, with two test runs."""
    from mstmm.abi.fused_library import COMPILER_FLAGS, OPTIONAL_FLAGS
    from mstmm.cli import diagnostics as examination
    from mstmm.pipeline.compilation import compile_scene

    from . import terminal_output

    findings = examination.run_diagnostics(compile_scene, COMPILER_FLAGS, OPTIONAL_FLAGS)
    problems = [finding for finding in findings if not finding.ok]
    if json:
        rows = [vars(finding) for finding in findings]
        report = {
            "ok": not problems,
            "interpreter": examination.interpreter_text(),
            "findings": rows,
        }
        terminal_output.print_json(report)
    else:
        terminal_output.print_lines(examination.interpreter_text())
        width = max(len(finding.subject) for finding in findings)
        for finding in findings:
            mark = "ok     " if finding.ok else "PROBLEM"
            terminal_output.print_lines(f"{mark}  {finding.subject:<{width}}  {finding.text}")
        terminal_output.print_lines(_verdict(len(problems)))
    if problems:
        raise typer.Exit(ENVIRONMENT)


def _verdict(problems: int) -> str:
    if not problems:
        return "No problems found."
    return f"{problems} problem{'s' if problems > 1 else ''}; each line gives the remedy."
