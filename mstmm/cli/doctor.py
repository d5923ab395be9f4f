"""`mstmm doctor`: diagnosis of the environment, with two test runs."""

from __future__ import annotations

import typer

from .explain import ENVIRONMENT
from .options import Json


def doctor(json: Json = False) -> None:
    """Diagnose compiler, CPU, cache, packages and kernels, with two test runs."""
    from mstmm.border.fused import FLAGS, TUNING
    from mstmm.bridge.compilation import compile_scene
    from mstmm.cli import machine as examination

    from . import output

    findings = examination.examine(compile_scene, FLAGS, TUNING)
    problems = [finding for finding in findings if not finding.ok]
    if json:
        plain = [vars(finding) for finding in findings]
        report = {"ok": not problems, "interpreter": examination.summary(), "findings": plain}
        output.emit_json(report)
    else:
        output.say(examination.summary())
        width = max(len(finding.subject) for finding in findings)
        for finding in findings:
            mark = "ok     " if finding.ok else "PROBLEM"
            output.say(f"{mark}  {finding.subject:<{width}}  {finding.text}")
        output.say(_verdict(len(problems)))
    if problems:
        raise typer.Exit(ENVIRONMENT)


def _verdict(problems: int) -> str:
    if not problems:
        return "No problems found."
    return f"{problems} problem{'s' if problems > 1 else ''}; each line gives the remedy."
