"""Cross-check of the kernels of an element in three forms, and of statements of mechanics.

The three forms are the stated equations at 50 digits (derive/verification/equation_evaluation.py),
the IR at 50 digits, and the compiled C in doubles (where there is no C, the engine's interpreter).
The error of C must not exceed the rounding bound of a running error analysis.  They are compared at
random points, and at points where a formula could fail.  The statements of mechanics are in
derive/verification/mechanics_checks.py.

    report = mstmm.pipeline.crosscheck.crosscheck("hinge", "pin")
    print(report); report.passed
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from ..errors import ElementError
from ..ir import KernelIR
from ..ir.element_spec import ElementSpec
from ..ir.statements import NEGATIVE_DETERMINANT
from ..ir.tape import Tape, compile_tape
from .crosscheck_report import CrossCheckReport, KernelCheck, Statement

if TYPE_CHECKING:
    from ..derive.catalogue.kernels import Kernel
    from ..derive.catalogue.registry import Element as Definition
    from ..derive.verification.mechanics_checks import Property
    from ..derive.verification.sample_points import InputSampler
    from ..runtime.kernels.prebuilt_kernels import Element as Compiled

#: Largest accepted relative difference between specialised and generic kernels in doubles.
MAX_SPECIALISATION_ERROR = 1e-13
#: Largest accepted deviation of a derivative from its difference quotient at 60 digits.
MAX_DERIVATIVE_ERROR = 1e-25


# --- subjects of a check --------------------------------------------------------------------------


def crosscheck(kind: str, name: str, points: int = 2) -> CrossCheckReport:
    """Check a built-in element, or one of the kernel store (its IR and C; its file is not run).

    `points` is the number of random points per kernel in addition to the special ones.  Raises
    ElementError for an unknown name.
    """
    from ..derive.catalogue.kernels import maker
    from ..derive.catalogue.registry import builtin_elements, kind_of
    from ..ir.element_spec import element_from_json
    from ..runtime.kernels import kernel_store, prebuilt_kernels

    make_kernels, compiled = maker(kind, name), prebuilt_kernels.elements().get((kind, name))
    if make_kernels is not None:
        kernels = make_kernels()
        element = next(
            (e for e in builtin_elements() if (kind_of(e), e.name) == (kind, name)), None
        )
        subject = replace(_make_subject(kind, name, element, kernels, compiled), interpreted=True)
        return subject.report(points, ())
    if compiled is not None:  # instances of other elements with some known numbers
        text = (files("mstmm") / "generated" / f"{kind}_{name}.json").read_text(encoding="utf-8")
        subject = _Subject.from_store(element_from_json(text), compiled)
        return subject.report(points, ("its equations are those of the general element",))
    stored = kernel_store.find_spec((kind, name))
    if stored is None:
        raise ElementError(f"there is no {kind} named {name!r}; mstmm list shows all elements")
    compiled = kernel_store.open_element((kind, name), stored.hash())
    subject = _Subject.from_store(stored, compiled)
    return subject.report(
        points, ("its definition is not stored; give its file to check the equations too",)
    )


def crosscheck_definition(element: Definition, points: int = 2) -> CrossCheckReport:
    """Check a user-defined element with its equations, and its C if the store has it."""
    from ..derive.catalogue.element_specs import spec_from
    from ..derive.catalogue.kernels import kernels_of
    from ..derive.catalogue.registry import kind_of
    from ..runtime.kernels import kernel_store

    kernels, key = kernels_of(element), (kind_of(element), element.name)
    stored = kernel_store.find_spec(key)
    current = stored is not None and stored.hash() == spec_from(element, kernels).hash()
    compiled = (
        kernel_store.open_element(key, stored.hash()) if stored is not None and current else None
    )
    return crosscheck_kernels(*key, element, kernels, compiled, points)


def mechanics_statements(
    kind: str, name: str, kernels: Sequence[Kernel], element: Definition | None = None
) -> tuple[Statement, ...]:
    """Statements of mechanics only, for kernels whose derivations are given."""
    subject = _make_subject(kind, name, element, kernels, None)
    return tuple(Statement(*row) for row in subject.statements())


def crosscheck_kernels(
    kind: str,
    name: str,
    element: Definition | None,
    kernels: Sequence[Kernel],
    compiled: Compiled | None,
    points: int,
) -> CrossCheckReport:
    """Check kernels whose derivations are given, and the compiled element if there is one."""
    remarks = () if compiled is not None else ("not generated yet, so there is no C to compare",)
    return _make_subject(kind, name, element, kernels, compiled).report(points, remarks)


def _make_subject(
    kind: str,
    name: str,
    element: Definition | None,
    kernels: Sequence[Kernel],
    compiled: Compiled | None,
) -> _Subject:
    from ..derive.catalogue.combined_hinge_kernels import with_slopes
    from ..derive.definition.element import Hinge
    from ..derive.equations.hinge import speeds_of
    from ..derive.verification.sample_points import InputSampler

    hinge = element if isinstance(element, Hinge) else None
    nu = len(speeds_of(hinge)) if hinge else 0
    if kind == "sweep" and name.startswith("generic"):
        nu = int(name.removeprefix("generic"))
    coordinates = hinge.coordinates if hinge else ()
    source = InputSampler(kind, coordinates, element.parameters if element else ())
    group = kind if kind != "sweep" else name.rstrip("0123456789")
    irs = {ir.name: ir for ir in with_slopes(group, (kernel.ir() for kernel in kernels))}
    derivations = {kernel.name: kernel for kernel in kernels}
    return _Subject(kind, name, nu, source, irs, derivations, compiled)


@dataclass(frozen=True)
class _Subject:
    """Kernels of an element in their three forms; `stated` is empty for a stored element."""

    kind: str
    name: str
    nu: int
    source: InputSampler
    irs: Mapping[str, KernelIR]
    stated: Mapping[str, Kernel]
    compiled: Compiled | None
    interpreted: bool = False  # kernels without a C function, by the engine's interpreter

    @classmethod
    def from_store(cls, spec: ElementSpec, compiled: Compiled) -> _Subject:
        from ..derive.verification.sample_points import InputSampler

        source = InputSampler(spec.kind, spec.coordinates, spec.parameters)
        irs = {kernel.name: kernel for kernel in spec.kernels}
        return cls(spec.kind, spec.name, len(spec.speeds), source, irs, {}, compiled)

    def report(self, points: int, remarks: tuple[str, ...]) -> CrossCheckReport:
        checks = tuple(self._kernel(kernel, points) for kernel in self.irs.values())
        statements = tuple(Statement(*row) for row in self._evaluate_statements())
        return CrossCheckReport(self.kind, self.name, checks, statements, remarks)

    # --- one kernel -----------------------------------------------------------------------------

    def _kernel(self, kernel: KernelIR, points: int) -> KernelCheck:
        largest_errors, worst_point, stopped, count = [0.0, 0.0], "", 0, 0
        problems: list[str] = []
        is_compiled = self._function(kernel) is not None
        interpreted = is_compiled and not self._has_c(kernel)
        for point in self.source.points(kernel, points):
            count += 1
            comparison = self._compare(kernel, point.inputs, point.n)
            if isinstance(comparison, str):
                problems.append(f"at {point.label!r}: {comparison}")
            elif comparison is None:
                stopped += 1
            else:
                if comparison[0] > largest_errors[0] or comparison[1] > largest_errors[1]:
                    worst_point = point.label
                largest_errors = [
                    max(a, b) for a, b in zip(largest_errors, comparison, strict=True)
                ]
        return KernelCheck(
            kernel.name, count, stopped, largest_errors[0] if kernel.name in self.stated else None,
            largest_errors[1] if is_compiled else None, worst_point, tuple(problems), interpreted,
        )  # fmt: skip

    def _compare(
        self, kernel: KernelIR, inputs: dict[str, list[float]], n: int
    ) -> tuple[float, float] | str | None:
        """Errors (equations, compiled); None if guards stop all forms; text if they disagree."""
        from mstmm.ir.interpreter import GuardFailure

        from ..derive.verification.equation_evaluation import Undefined, evaluate_equations
        from ..derive.verification.kernel_evaluation import evaluate

        code, exact = 0, None
        try:
            exact = evaluate(kernel, inputs, n=n)
        except GuardFailure as failure:
            code = failure.code
        stated = None
        if kernel.name in self.stated:
            kernel_definition = self.stated[kernel.name]
            try:
                stated = evaluate_equations(
                    kernel_definition.derivation, inputs, kernel_definition.guards, n=n
                )
            except Undefined as undefined:
                if exact is not None and _is_finite(exact):
                    return f"the equations have no value ({undefined}), the IR has one"
                return None
        rounded = {name: [float(v) for v in row] for name, row in inputs.items()}  # as C has them
        compiled_result = self._c_values(kernel, rounded, n)
        if compiled_result is not None and compiled_result[0] not in (code, NEGATIVE_DETERMINANT):
            return f"C returns {compiled_result[0]}, the IR {code}"
        if exact is None or not _is_finite(exact):
            return None
        equation_error = (
            0.0 if stated is None else _largest_difference(exact, stated.outputs, inputs)
        )
        if stated is not None and stated.asymmetry > 1e-30 * _largest_input(inputs):
            return "a quantity declared as symmetric is not symmetric"
        compiled_error = (
            0.0
            if compiled_result is None
            else self._error_ratio(kernel, rounded, compiled_result[1], n)
        )
        return equation_error, compiled_error

    def _error_ratio(
        self,
        kernel: KernelIR,
        inputs: dict[str, list[float]],
        got: Mapping[str, Sequence[float]],
        n: int,
    ) -> float:
        """Largest error of C relative to its rounding bound."""
        from ..derive.verification.kernel_evaluation import rounding_bounds

        largest_share = 0.0
        for name, limits in rounding_bounds(kernel, inputs, n).items():
            for value, (exact, bound) in zip(got[name], limits, strict=True):
                largest_share = max(
                    largest_share, float(abs(value - exact)) / bound if value == value else math.inf
                )
        return largest_share

    # --- the compiled kernels -------------------------------------------------------------------

    def _function(self, kernel: KernelIR) -> Callable[..., Any] | None:
        if self.compiled is not None and self._has_c(kernel):
            return partial(_call, self.compiled)
        if self.compiled is not None and self.compiled.tape is not None:
            return partial(_interpret, self.compiled.tape) if kernel.name == "hinge" else None
        return partial(_interpret, _cached_tape(kernel)) if self.interpreted else None

    def _has_c(self, kernel: KernelIR) -> bool:
        return self.compiled is not None and kernel.name in self.compiled.functions

    def _c_values(
        self, kernel: KernelIR, inputs: dict[str, list[float]], n: int
    ) -> tuple[int, dict[str, list[float]]] | None:
        function = self._function(kernel)
        return None if function is None else function(kernel, inputs, n)

    # --- statements of mechanics ------------------------------------------------------------------

    def _precisely(self, name: str, inputs: dict[str, Any]) -> dict[str, list[Any]]:
        """Evaluate a kernel at high precision, by its equations if available, else its IR."""
        from ..derive.verification.equation_evaluation import evaluate_equations
        from ..derive.verification.kernel_evaluation import evaluate
        from ..derive.verification.mechanics_checks import DIGITS

        if self.stated:
            return evaluate_equations(self.stated[name].derivation, inputs, (), DIGITS).outputs
        return evaluate(self.irs[name], inputs, DIGITS)

    def _evaluate_statements(self) -> list[tuple[str, float, float]]:
        """Evaluate all statements of mechanics.

        ElementError if the equations have no value for numbers within the bounds of the definition.
        """
        from ..derive.verification.equation_evaluation import Undefined

        try:
            return list(self.statements())
        except Undefined as undefined:
            text = str(undefined)
            for k, parameter in enumerate(self.source.parameters):
                text = text.replace(f"p[{k}, 0]", f"p.{parameter.name}")
            raise ElementError(
                f"{self.kind} {self.name}: {text} for some numbers that its definition allows; "
                'give bounds of parameters and coordinates, such as Param("width", "m", minimum=0)'
            ) from None

    def statements(self) -> Iterator[tuple[str, float, float]]:
        from ..derive.verification import law_checks, mechanics_checks
        from ..derive.verification.derivative_checks import slope_errors

        property_rows: tuple[Property, ...] = ()
        parameter_count = next(
            (
                port.length()
                for kernel in self.irs.values()
                for port in kernel.inputs
                if port.name == "p"
            ),
            0,
        )
        if self.kind == "hinge":
            generic = partial(_evaluate_generic, self.nu)
            property_rows = mechanics_checks.hinge_properties(
                self._precisely, generic, self.source, self.nu
            )
            yield from self._compare_in_doubles()
        elif self.kind == "body":
            property_rows = mechanics_checks.body_properties(
                self._precisely, self.source, parameter_count
            )
        elif self.kind == "force":
            property_rows = mechanics_checks.force_properties(
                self._precisely, self.source, parameter_count
            )
        elif self.name.startswith("generic"):
            property_rows = mechanics_checks.sweep_properties(self._precisely, self.nu)
        elif (self.kind, self.name) == ("sweep", "laws"):
            for kernel, row in law_checks.law_properties(self._precisely, self.source, self.irs):
                yield f"{kernel}: {row.name}", row.error, row.limit
        for row in property_rows:
            yield row.name, row.error, row.limit
        for kernel, error in slope_errors(self.irs, self.source):
            yield f"{kernel} = difference quotient", error, MAX_DERIVATIVE_ERROR

    def _compare_in_doubles(self) -> Iterator[tuple[str, float, float]]:
        """Compare the compiled specialised kernels with the compiled generic ones."""
        from ..derive.catalogue.kernels import generic_kernels
        from ..runtime.kernels import prebuilt_kernels

        if self.compiled is None or self.compiled.tape is not None:
            return
        generic = prebuilt_kernels.element("sweep", f"generic{self.nu}")
        generic_by_name = {kernel.name: kernel for kernel in generic_kernels(self.nu)}
        for name in ("forward", "condense", "recover"):
            largest_error, generic_kernel = 0.0, generic_by_name[name].ir()
            for point in self.source.points(self.irs[name], 3):
                inputs = {"u": [0.0] * self.nu} | point.inputs
                _, hinge_outputs = _call(self.compiled, self.irs["hinge"], inputs)
                code, special_outputs = _call(self.compiled, self.irs[name], inputs)
                generic_code, generic_outputs = _call(
                    generic, generic_kernel, hinge_outputs | inputs | {"J": [0.0] * self.nu}
                )
                if not (code or generic_code):
                    largest_error = max(
                        largest_error, _largest_deviation(special_outputs, generic_outputs, inputs)
                    )
            yield f"{name} in C: specialised = generic", largest_error, MAX_SPECIALISATION_ERROR


# --- calls ----------------------------------------------------------------------------------------


def _evaluate_generic(nu: int, name: str, inputs: dict[str, Any]) -> dict[str, list[Any]]:
    from ..derive.catalogue.kernels import generic_kernels
    from ..derive.verification.equation_evaluation import evaluate_equations
    from ..derive.verification.mechanics_checks import DIGITS

    kernel = next(k for k in generic_kernels(nu) if k.name == name)
    return evaluate_equations(kernel.derivation, inputs, (), DIGITS).outputs


def _call(
    compiled: Compiled, kernel: KernelIR, inputs: Mapping[str, Sequence[float]], n: int = 0
) -> tuple[int, dict[str, list[float]]]:
    """Call a compiled kernel through its descriptor: (code, outputs)."""
    from ..abi.element_library import c_outputs
    from ..runtime.kernels import prebuilt_kernels

    ffi, _ = prebuilt_kernels.module()
    descriptor = compiled.descriptor
    kernel_descriptor = next(
        descriptor.kernels[i]
        for i in range(descriptor.n_kernels)
        if prebuilt_kernels.text(ffi, descriptor.kernels[i].name) == kernel.name
    )
    input_arrays = [ffi.new("real[]", list(inputs[port.name]) or 1) for port in kernel.inputs]
    output_arrays = [ffi.new("real[]", max(1, port.length(n))) for port in c_outputs(kernel)]
    code = kernel_descriptor.call(
        n, ffi.new("real *[]", input_arrays or 1), ffi.new("real *[]", output_arrays or 1)
    )
    return int(code), _outputs_by_name(kernel, output_arrays, n)


def _outputs_by_name(kernel: KernelIR, arrays: Sequence[Any], n: int = 0) -> dict[str, list[float]]:
    """Outputs by name, without a work array that may follow them."""
    return {
        port.name: list(array)[: port.length(n)]
        for port, array in zip(kernel.outputs, arrays, strict=False)
    }


@lru_cache(maxsize=1)  # all points of a kernel, one after the other
def _cached_tape(kernel: KernelIR) -> Tape:
    return compile_tape(kernel)


def _interpret(
    tape: Any, kernel: KernelIR, inputs: Mapping[str, Sequence[float]], n: int = 0
) -> tuple[int, dict[str, list[float]]]:
    """Interpret a kernel without a C function as the engine does: (code, outputs)."""
    from mstmm.runtime.kernels.c_records import c_tape

    from ..runtime.kernels import prebuilt_kernels

    ffi, lib = prebuilt_kernels.module()
    references: list[Any] = []
    input_arrays = [ffi.new("real[]", list(inputs[port.name]) or 1) for port in kernel.inputs]
    output_arrays = [ffi.new("real[]", max(1, port.length())) for port in kernel.outputs]
    slots, packed = ffi.new("real[]", tape.slots), c_tape(ffi, tape, references)
    code = lib.mstmm_tape_run(
        packed,
        ffi.new("real *[]", input_arrays or 1),
        slots,
        ffi.new("real *[]", output_arrays or 1),
    )
    return int(code), _outputs_by_name(kernel, output_arrays)


# --- numbers --------------------------------------------------------------------------------------


def _largest_input(inputs: Mapping[str, Sequence[float]]) -> float:
    return max((abs(v) for row in inputs.values() for v in row if abs(v) < 1e200), default=1.0)


def _largest_deviation(
    one: Mapping[str, Sequence[float]],
    two: Mapping[str, Sequence[float]],
    inputs: Mapping[str, Sequence[float]],
) -> float:
    """Largest difference of outputs, relative to the largest entries of `two`."""
    largest = 0.0
    for name, row in two.items():
        scale = max([abs(v) for v in row] + _input_magnitudes(name, inputs))
        differences = (abs(a - b) for a, b in zip(one[name], row, strict=True))
        largest = max(largest, max(differences, default=0.0) / scale)
    return largest


def _input_magnitudes(name: str, inputs: Mapping[str, Sequence[float]]) -> list[float]:
    """Magnitudes of the inputs that an output is a remainder of: S_I of S, e_I of e and tau."""
    names = {"S_I": ("S",), "e_I": ("e", "tau")}.get(name, ())
    return [1e-300, *(abs(v) for input_name in names for v in inputs[input_name])]


def _is_finite(values: Mapping[str, Sequence[Any]]) -> bool:
    import mpmath

    return all(mpmath.isfinite(v) for row in values.values() for v in row)


def _largest_difference(
    exact: Mapping[str, Sequence[Any]],
    stated: Mapping[str, Sequence[Any]],
    inputs: Mapping[str, Sequence[float]],
) -> float:
    """Largest difference, relative to the largest entry of its array and to the inputs."""
    floor, largest = 1e-8 * _largest_input(inputs), 0.0
    for name, row in exact.items():
        scale = max([abs(v) for v in row] + [floor])
        if scale == 0:
            continue
        for a, b in zip(row, stated[name], strict=True):
            largest = max(largest, float(abs(a - b) / scale))
    return largest


__all__ = [
    "CrossCheckReport",
    "KernelCheck",
    "Statement",
    "crosscheck",
    "crosscheck_definition",
    "crosscheck_kernels",
    "mechanics_statements",
]
