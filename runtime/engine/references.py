"""Names of the bodies and ends of a scene in results and measurements."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from mstmm.errors import SceneError
from mstmm.scene import split
from mstmm.scene.rules.messages import near
from mstmm.scene.rules.values import GROUND
from mstmm.scene.tables.all import SceneTables
from mstmm.scene.tables.body import BodyTable


class References(Collection[str]):
    """Collection of the names of all bodies and ends of a scene: "rod1", "rod1.tip".

    `scene` is the skeleton, in which flexible bodies are bodies with ends like all others.
    """

    def __init__(self, scene: SceneTables) -> None:
        self.scene, self.bodies = scene, scene.bodies

    def canonical(self, reference: str) -> str | None:
        """Name of a reference in the scene, or None if there is no such body or end.

        Members of chains get their index; synonyms of other programs are resolved.
        """
        return self._known(reference) or self._known(self.scene.names.reference(reference))

    def _known(self, reference: str) -> str | None:
        name, at = split(reference)
        number = self.bodies.find(name)
        ends = self.bodies.ends(name)
        if number is None or ends is None or (at and at not in ends):
            return None
        return self.bodies.name(number) + (f".{at}" if at else "")

    def place(self, reference: str) -> str:
        """Canonical name of a reference, or the ground; SceneError for an unknown one."""
        found = self.canonical(reference)
        if found is not None:
            return found
        if GROUND in (split(reference)[0], self.scene.names.reference(reference)):
            return GROUND
        raise SceneError(self.unknown(reference))

    def unknown(self, reference: str) -> str:
        """Message that there is no such body or end, with the nearest name."""
        body = split(reference)[0]
        if self.bodies.of_chain(body) and self.bodies.find(body) is None:
            return f'"{reference}": {self.bodies.missing(body)}'
        hint = near(reference, (*self, *self.scene.names.body))
        return f'"{reference}": there is no such body or end in the scene{hint}'

    def __contains__(self, reference: object) -> bool:
        return isinstance(reference, str) and self.canonical(reference) is not None

    def __iter__(self) -> Iterator[str]:
        for body in self.scene.body:
            yield from _with_ends(body.name, body)
        for chain in self.scene.chain:
            for k in range(chain.count):
                yield from _with_ends(f"{chain.name}[{k}]", chain.body_of(k))

    def __len__(self) -> int:
        found = sum(1 + len(body.ends) for body in self.scene.body)
        for chain in self.scene.chain:
            repeats, rest = divmod(chain.count, len(chain.body))
            ends = [1 + len(body.ends) for body in chain.body]
            found += repeats * sum(ends) + sum(ends[:rest])
        return found


def _with_ends(name: str, body: BodyTable) -> Iterator[str]:
    yield name
    for end in body.ends:
        yield f"{name}.{end}"
