"""The schedule of the sweep: every word in it is known, and C cannot mistake what it says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import mstmm
from mstmm.cli import stored_elements
from mstmm.derive.codegen.kernel_calls import (
    NAMED_CALLEES,
    POINTER_CALLEES,
    collect_callees,
    kernel_calls_header,
)
from mstmm.derive.codegen.sweep_text import all_passes, function_text, sweep_files
from mstmm.derive.schedule.differentiated_passes import D, DifferentiatedCall, ports_of
from mstmm.derive.schedule.pass_steps import Call, Pass, Step, all_steps, call
from mstmm.derive.schedule.slot_definitions import CONSTANTS, ROLES, SLOTS, TRAITS
from mstmm.derive.schedule.sweeps import SWEEPS
from mstmm.ir import KernelIR

specs = cache(stored_elements.generated_specs)


def steps() -> Iterator[Step]:
    for whole in all_passes():
        for step in whole.steps:
            yield from all_steps(step)


def calls() -> list[Call]:
    return [step for step in steps() if isinstance(step, Call)]


def kernel_of(step: Call) -> KernelIR:
    """A kernel with the ports of the one that is called."""
    element, _, name = step.kernel.partition(".")
    key = NAMED_CALLEES.get(element, ("sweep", element))
    if element.startswith("generic{"):
        key = ("sweep", "generic6")
    elif element in POINTER_CALLEES:
        key, names = POINTER_CALLEES[element]
        name = names.get(name, name)
    return next(kernel for kernel in specs()[key].kernels if kernel.name == name)


def slots_of(step: Step) -> Iterator[str]:
    """Every slot that a step names."""
    if isinstance(step, Call):
        yield from (slot for port, slot in ports_of(step).items() if port != "n")
    for field in ("to", "source", "free", "imposed", "places", "rotation", "position", "motion",
                  "subspace", "offset", "pivots", "own", "whole", "expression"):  # fmt: skip
        value = getattr(step, field, "")
        if isinstance(value, str) and value:
            yield value


def test_every_slot_is_explained() -> None:
    used = {slot.removeprefix(D).partition("[")[0] for step in steps() for slot in slots_of(step)}
    named = {slot for slot in used if not slot.startswith("local.")}
    fields = {slot for slot in named if slot.startswith(("moments.", "drag."))}
    roles = {slot for slot in named if slot.partition(".")[0] in ROLES}
    numbers = {slot for slot in named if re.fullmatch(r"section\.([gh]_[xyz]|r|phi|theta)", slot)}
    assert {f"body.{slot.partition('.')[2]}" for slot in roles} <= SLOTS.keys()
    known = SLOTS.keys() | CONSTANTS.keys()
    assert named - fields - roles - numbers <= known
    unused = SLOTS.keys() - named - {f"body.{slot.partition('.')[2]}" for slot in roles}
    assert not unused


def test_every_condition_is_explained() -> None:
    conditions = [step.when for step in steps()]
    conditions += [run.when for sweep in SWEEPS for run in sweep.runs]
    conditions += [x for whole in all_passes() for x in (whole.skip, whole.spares_links)]
    assert {word.lstrip("!") for when in conditions for word in when.split()} == TRAITS.keys()


def test_every_call_hands_over_every_port() -> None:
    for step in calls():
        kernel, ports = kernel_of(step), ports_of(step)
        names = {port.name for port in (*kernel.inputs, *kernel.outputs)}
        assert {port.name for port in kernel.inputs} <= ports.keys(), step
        assert isinstance(step, DifferentiatedCall) or ports.keys() <= names | {"work", "n"}, step


def test_slots_are_as_long_as_the_ports_that_meet_them() -> None:
    """Sizes that are numbers; those of speeds and modes are counted as 6 and 1."""
    sizes = {"nu": 6, "free": 6, "n": 1}
    for step in calls():
        ports = {port.name: port for port in (*kernel_of(step).inputs, *kernel_of(step).outputs)}
        for name, slot in step.ports:
            role, _, rest = slot.partition(".")
            known = SLOTS.get(f"body.{rest}" if role in ROLES else slot)
            if known is None or name not in ports:
                continue
            words = known.size.split()
            if not all(word.isdigit() or word in sizes for word in words):
                continue
            length = 1
            for word in words:
                length *= sizes.get(word) or int(word)
            if step.kernel.startswith(("hinge.", "link.", "law.", "generic0.")) and "nu" in words:
                continue  # one hinge stands for all
            assert ports[name].length(1) <= length, (step.kernel, name, slot)


def test_reasons_of_failure_are_those_of_the_engine() -> None:
    root = Path(mstmm.__file__).parent
    headers = [*(root / "runtime/engine/c").glob("*.h"), *(root / "generated").glob("*.h")]
    known = re.findall(r"#define MSTMM_FAILED_(\w+) ", "".join(h.read_text() for h in headers))
    reasons = {getattr(step, "fails", "") for step in steps()} - {""}
    assert {reason.upper() for reason in reasons} <= set(known)


# --- the printed C ----------------------------------------------------------------------------


def reverse_inputs(kernel: KernelIR) -> KernelIR:
    return replace(kernel, inputs=tuple(reversed(kernel.inputs)))


def test_the_order_of_ports_may_change() -> None:
    """A kernel with other places for its arrays is called by the same words, and rightly."""
    frames = specs()["sweep", "frames"]
    kernels = tuple(reverse_inputs(k) if k.name == "pose" else k for k in frames.kernels)
    other = specs() | {("sweep", "frames"): replace(frames, kernels=kernels)}

    def pose_arguments(text: str) -> str:
        found = re.search(r"return mstmm_sweep_frames_pose\(\s*([^)]*)\)", text)
        assert found
        return " ".join(found[1].split())

    assert pose_arguments(kernel_calls_header(specs())) == "to.A_I, to.x_I, to.Rc, to.r, to.A, to.x"
    assert pose_arguments(kernel_calls_header(other)) == "to.r, to.Rc, to.x_I, to.A_I, to.A, to.x"
    assert re.findall(r"\.A_I = [^,]*", sweep_files(other)["sweep_steps.c"]) == re.findall(
        r"\.A_I = [^,]*", sweep_files(specs())["sweep_steps.c"]
    )


def test_hinges_of_one_room_have_the_same_ports() -> None:
    pin = specs()["hinge", "pin"]
    kernels = tuple(reverse_inputs(k) if k.name == "condense" else k for k in pin.kernels)
    with pytest.raises(ValueError, match="condense: not every element has the same ports"):
        collect_callees(specs() | {("hinge", "pin"): replace(pin, kernels=kernels)})


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (call("frames.speed_power", tau="body.tau", P="local.P"), "no slot for the port 'u'"),
        (call("frames.speed_power", tau="body.tau", u="body.u", x="body.x", P="local.P"),
         "has no port x"),
        (call("frames.speed_power", tau="body.tau", u="body.speed", P="local.P"),
         "pass wrong: unknown slot 'body.speed'"),
        (call("frames.speed_power", when="modall", tau="body.tau", u="body.u", P="local.P"),
         "unknown condition 'modall'"),
    ],
)  # fmt: skip
def test_names_that_nobody_knows_are_not_printed(step: Call, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        function_text(Pass("wrong", "body", "", (step,)), collect_callees(specs()))


def test_a_pass_is_printed_from_its_description_alone() -> None:
    """What is handed over, skipped, local, failing and done under a condition."""
    whole = Pass(
        "power_of_links", "body", "Power at P.",
        (
            call("frames.velocity", when="rigid", Rc="body.R", r="body.r", v_I="parent.v",
                 w_I="parent.w", v_rel="hinge.v", v="local.v"),
            call("frames.speed_power", when="!rigid", tau="body.tau[2]", u="given.T", P="local.P"),
        ),
        skip="idle", given=("given.T",),
    )  # fmt: skip
    text = " ".join(function_text(whole, collect_callees(specs())).split())
    assert "mstmm_at_power_of_links(mstmm_state *state, int index, real *given_T)" in text
    assert "if (mstmm_idle(state->observed, body)) return 0;" in text
    assert "real v[3]; real P[1];" in text
    assert "if (body->kernels->rigid) {" in text
    assert "} else {" in text
    assert ".tau = mstmm_of_speeds(block, nu, MSTMM_SPEED_TAU) + 2, .u = given_T, .P = P" in text
