"""The elements that a scene names: prebuilt ones and those of the user's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mstmm.errors import SceneError
from mstmm.ir.param import Param
from mstmm.ir.scene_structure import Key
from mstmm.scene import Hinge

from ..kernels import prebuilt_kernels
from ..kernels.prebuilt_kernels import Element

Known = Mapping[Key, Element]

#: The type that a weld runs as which lets go later: it is held until then.
LETS_GO = "free"


def kernel_type(hinge: Hinge, releases: Mapping[str, int]) -> str:
    """Name of the element whose kernels move a hinge."""
    if hinge.is_weld and hinge.name in releases:
        return LETS_GO
    return hinge.type if hinge.facts is None else hinge.facts.runs_as


class Elements:
    """Prebuilt elements and those of the user's, by kind and name."""

    def __init__(self, known: Known) -> None:
        self.known = known

    def __getitem__(self, key: Key) -> Element:
        """KeyError if nobody defines it."""
        return self.known[key] if key in self.known else prebuilt_kernels.elements()[key]

    def __contains__(self, key: Key) -> bool:
        return key in self.known or key in prebuilt_kernels.elements()

    def get(self, kind: str, name: str, user: str) -> Element:
        """The element that `user` names as its type; SceneError if nobody defines it."""
        try:
            return self[kind, name]
        except KeyError:
            raise SceneError(
                f'scene: {kind} "{user}": type: nothing is known of the type "{name}"; '
                f"generate it with: mstmm generate FILE, or mstmm list shows what there is"
            ) from None


def declared_numbers(
    declared: Sequence[Param], given: Mapping[str, float], where: str
) -> tuple[float, ...]:
    """Numbers of declared parameters in their order, defaults filled in.

    Raises SceneError naming the scene's element (`where`) for what is missing or out of bounds.
    """
    numbers = []
    for p in declared:
        value = given.get(p.name, p.default)
        problem = ""
        if value is None:
            problem = "missing; expected a number"
        elif p.minimum is not None and value < p.minimum:
            problem = f"expected {p.minimum:g} {p.unit} or more, found {value:g}"
        elif p.maximum is not None and value > p.maximum:
            problem = f"expected {p.maximum:g} {p.unit} or less, found {value:g}"
        if value is None or problem:
            raise SceneError(f"scene: {where}: parameters.{p.name}: {problem}")
        numbers.append(value)
    return tuple(numbers)
