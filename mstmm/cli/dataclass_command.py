"""Commands whose options are the fields of a dataclass, each declared once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from inspect import Parameter, Signature
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import typer

from mstmm.runtime.integrate.methods import FAMILIES

from .options import integer_parser, parse_not_negative

T = TypeVar("T")

_PARSERS: dict[type, Callable[[Any], Any] | None] = {
    float: parse_not_negative, int: integer_parser(0), str: None,
}  # fmt: skip


def dataclass_command(
    options: type[T], run: Callable[[T], None], groups: Mapping[str, Sequence[Parameter]]
) -> Callable[..., None]:
    """Command with a parameter for each field of the dataclass `options`, which `run` receives.

    A field named in `groups` gets a dictionary of the values given for these parameters instead.
    """
    hints = get_type_hints(options, include_extras=True)
    own = [_parameter(f, hints[f.name]) for f in fields(options) if f.name not in groups]  # type: ignore[arg-type]

    def command(**values: Any) -> None:
        for name, parameters in groups.items():
            given = {p.name: values.pop(p.name) for p in parameters}
            values[name] = {key: value for key, value in given.items() if value is not None}
        run(options(**values))

    parameters = [*own, *(p for group in groups.values() for p in group)]
    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    command.__doc__, command.__name__ = run.__doc__, run.__name__
    return command


def _parameter(item: Field[Any], annotation: Any) -> Parameter:
    default = Parameter.empty if item.default is MISSING else item.default
    return Parameter(item.name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def method_parameters() -> list[Parameter]:
    """One parameter for each option of integration methods; None where not given."""
    parameters: dict[str, Parameter] = {}
    for family in FAMILIES:
        hints = get_type_hints(family)
        for item in fields(family):
            if item.name == "name":
                continue
            kind: Any = (get_args(hints[item.name]) or (hints[item.name],))[0]
            option = typer.Option(
                f"--{item.name.replace('_', '-')}", metavar=item.metadata["metavar"],
                help=item.metadata["description"], parser=_PARSERS[kind],
            )  # fmt: skip
            annotation: Any = Annotated[kind | None, option]
            parameters[item.name] = Parameter(
                item.name, Parameter.KEYWORD_ONLY, default=None, annotation=annotation
            )
    return list(parameters.values())
