"""Compiled scene: packed for the engines, the basis of runs, results and models."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Self

from mstmm.errors import NumericalFailure, SceneError
from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody
from ..kernels import store
from ..pack import parameters as named_parameters
from ..pack import product
from ..pack.elements import Known
from ..pack.layout import Layout
from ..pack.merge.simplification import LINKED, Simplification, Words
from ..pack.pack import pack, unmerged
from ..pack.packed import Packed, resize
from .code import Fusing, NotFused
from .engine import Engine
from .given import GivenInput, at_once, with_inputs
from .loops.closed import Closed
from .loops.freedom import Freedom
from .loops.refinement import of_tree
from .renewed import with_values
from .sizes import speed_sizes
from .slopes import Slopes

#: Options of a compilation: fused code, accuracy of the plain product, sweep, simplifications.
Asked = tuple[Callable[[Packed, Known], Fusing] | None, float | None, str, Words]


class Compiled:
    """Scene that is ready for evaluation.

    Attributes:
        scene: the given scene.
        known: elements that are not prebuilt, by (kind, name).
        looped: looped engine on the packed scene.
        fusion: fused code of the scene.
        closed: its closed loops, assembled; None for a tree.
        sweep: "riccati", "refined" or "qr".
    """

    def __init__(
        self,
        scene: Scene,
        known: Known | None = None,
        fusing: Callable[[Packed, Known], Fusing] | None = None,
        product_accuracy: float | None = None,
        sweep: str = "riccati",
        simplify: Words = LINKED,
    ) -> None:
        self.scene = scene
        self._fusing, self._product_accuracy, self.sweep = fusing, product_accuracy, sweep
        self._simplify = simplify if product_accuracy is None else LINKED
        self.looped = Engine(
            pack(scene, known, product_accuracy, sweep=sweep, simplify=self._simplify)
        )
        self.known = self.packed.elements.known
        self.closed: Closed | None = None
        if self.packed.system.closes:
            try:
                self.closed = Closed(self.looped, len(self.free_speeds))
            except NumericalFailure as failure:
                raise SceneError(f"scene: {failure}") from None
            self.looped = self.closed.engine
            if product_accuracy is not None:
                product.attach(self.packed, product_accuracy)
                resize(self.packed, self.packed.written.slots)
        elif self.packed.refined:
            self.packed.model.refines = of_tree(self.looped)
        self.fusion: Fusing = fusing(self.packed, self.known) if fusing else NotFused()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the scene and the options; compiled code is looked for again when unpickled."""
        return _again, (type(self), self.scene, self._asked, self.fusion.library is not None)

    @property
    def _asked(self) -> Asked:
        return self._fusing, self._product_accuracy, self.sweep, self._simplify

    @cached_property
    def apart(self) -> Engine:
        """Looped engine without merged bodies, for quantities of merged bodies or hinges."""
        packed = unmerged(self.packed)
        if packed is self.packed:
            return self.looped
        engine = Engine(packed)
        return engine if self.closed is None else Closed(engine, len(self.free_speeds)).engine

    @property
    def simplifications(self) -> tuple[Simplification, ...]:
        """Simplifications of the packed scene, which do not change its motion."""
        return self.packed.simplified

    @property
    def packed(self) -> Packed:
        """Packed scene: its numbers in internal frames."""
        return self.looped.packed

    @property
    def engine(self) -> str:
        """Engine in use: "fused" or "looped"."""
        return "looped" if self.fusion.library is None else "fused"

    @property
    def engine_choice(self) -> str:
        """Engine in use, with the reason."""
        f = self.fusion
        if f.library is not None:
            return f"fused: {f.note}"
        if f.obstacle:
            return f"looped: {f.obstacle}"
        return "looped: fused code of this scene is not compiled yet; a long run or batch builds it"

    @property
    def layout(self) -> Layout:
        """Layout of hinges and modes in q and u."""
        return self.packed.layout

    @property
    def flexible(self) -> Mapping[str, ModalBody]:
        """Data of the flexible bodies by name: modes, moments, stiffness, interface nodes."""
        return self.packed.flexible

    @cached_property
    def free_speeds(self) -> tuple[int, ...]:
        """Indices in u of the speeds that no drive prescribes."""
        free = list[int]()
        for number, hinge in enumerate(self.packed.scene.hinges):
            slots = self.layout.slots(number)
            drive = hinge.drive or (None,) * slots.nu
            if not hinge.is_weld:
                free += [slots.u + k for k in range(slots.nu) if drive[k] is None]
        for slots in self.layout.modal.values():
            free += range(slots.u, slots.u + slots.nu)
        return tuple(free)

    @cached_property
    def increments(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of the tangent increment of every free speed.

        They are those of the coordinate if its rate is the speed.
        """
        found = list[tuple[str, str]]()
        for speed in self.free_speeds:
            slots = self.layout.hinge_of_speed(speed)
            k = speed - slots.u
            if slots.straight:
                found.append((f"{slots.name}.{slots.q_names[k]}", slots.q_units[k]))
            else:
                unit = slots.u_units[k].removesuffix("/s")
                found.append((f"{slots.name}.{slots.u_names[k]}_increment", unit))
        return tuple(found)

    @cached_property
    def freedom(self) -> Freedom | None:
        """Independent speeds of closed loops; None for a tree."""
        if self.closed is None:
            return None
        return Freedom(self.looped, self.free_speeds, speed_sizes(self), self.closed)

    @cached_property
    def slopes(self) -> Slopes:
        """Linearisation of the scene by its fused code."""
        return Slopes(self.looped, self.fusion, self.free_speeds)

    @property
    def nq(self) -> int:
        return self.looped.nq

    @property
    def nu(self) -> int:
        return self.looped.nu

    @property
    def parameters(self) -> dict[str, float]:
        """Values of all parameters of the scene by name, such as "rod1.mass"."""
        return named_parameters.read(self.scene)

    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Copy of this model with other parameter values.

        Nothing is recompiled, unless the model is fused and a number that was exactly zero (or an
        axis along a coordinate axis) changes; then other code is compiled or found in the cache.

        Raises SceneError for an unknown name (the nearest one is suggested) or an invalid value.
        """
        return self._with(named_parameters.changed(self.scene, changes))

    def with_inputs(self, inputs: Mapping[str, GivenInput]) -> Self:
        """Copy of this model with other inputs, by name; nothing is recompiled.

        An input is given as a number, as the name of a signal of the scene, as (times, values) with
        linear interpolation (s; times increase), or as the keys of a [[signal]] that it follows:
        {"times": ..., "values": ..., "interpolation": "cubic"}.

        Raises SceneError for an unknown name (the nearest one is suggested) or an invalid value.
        """
        values = at_once(self.scene, inputs)
        if values is not None:
            return self.renewed(with_values(self.packed, values))
        return self._with(with_inputs(self.scene, inputs))

    def renewed(self, packed: Packed) -> Self:
        """Copy of this model with the packed scene under other inputs, without validation.

        The packed scene must fit the existing compiled code.
        """
        known = {
            name: value for name, value in vars(self).items()
            if not isinstance(getattr(type(self), name, None), cached_property)
        }  # fmt: skip
        found = object.__new__(type(self))
        found.__dict__.update(known, scene=packed.described, looped=Engine(packed))
        found.fusion = self.fusion.under(packed.system)
        return found

    def _with(self, scene: Scene) -> Self:
        """Compile the same scene with other numbers, with the same options."""
        changed = type(self)(scene, self.known, *self._asked)
        changed.fusion.follow(self.fusion)
        return changed


def _again(
    kind: type[Compiled],
    scene: Scene,
    asked: Asked,
    fused: bool,
) -> Compiled:
    """Restore a pickled model, with its fused code if that is in the cache here."""
    known, definitions = store.known(store.needed(scene))
    scene.check_types(definitions)
    made = kind(scene, known, *asked)
    if fused:
        made.fusion.find()
    return made
