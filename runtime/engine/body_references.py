"""Names of the bodies and ends of a scene in results and measurements."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from mstmm.errors import SceneError
from mstmm.scene import split_reference
from mstmm.scene.tables.body import BodyTable
from mstmm.scene.tables.scene_tables import SceneTables
from mstmm.scene.validators.scalars_and_vectors import GROUND
from mstmm.scene.validators.validation_messages import did_you_mean


class BodyReferences(Collection[str]):
    """Names of all bodies and ends of a scene: "rod1", "rod1.tip".

    `scene` is the skeleton, in which flexible bodies appear as ordinary bodies with ends.
    """

    def __init__(self, scene: SceneTables) -> None:
        self.scene, self.bodies = scene, scene.bodies

    def canonical(self, reference: str) -> str | None:
        """Canonical name of a reference, or None if there is no such body or end.

        Chain members get their index; synonyms of other programs are resolved.
        """
        return self._find_canonical(reference) or self._find_canonical(
            self.scene.names.reference(reference)
        )

    def _find_canonical(self, reference: str) -> str | None:
        name, end_name = split_reference(reference)
        index = self.bodies.find(name)
        ends = self.bodies.ends(name)
        if index is None or ends is None or (end_name and end_name not in ends):
            return None
        return self.bodies.name(index) + (f".{end_name}" if end_name else "")

    def canonical_name(self, reference: str) -> str:
        """Canonical name of a body, an end or the ground; raises SceneError if unknown."""
        canonical_name = self.canonical(reference)
        if canonical_name is not None:
            return canonical_name
        if GROUND in (split_reference(reference)[0], self.scene.names.reference(reference)):
            return GROUND
        raise SceneError(self.unknown(reference))

    def unknown(self, reference: str) -> str:
        """Message for an unknown reference, with the nearest known name."""
        body = split_reference(reference)[0]
        if self.bodies.of_chain(body) and self.bodies.find(body) is None:
            return f'"{reference}": {self.bodies.missing(body)}'
        suggestion = did_you_mean(reference, (*self, *self.scene.names.body))
        return f'"{reference}": there is no such body or end in the scene{suggestion}'

    def __contains__(self, reference: object) -> bool:
        return isinstance(reference, str) and self.canonical(reference) is not None

    def __iter__(self) -> Iterator[str]:
        for body in self.scene.body:
            yield from _body_and_end_names(body.name, body)
        for chain in self.scene.chain:
            for k in range(chain.count):
                yield from _body_and_end_names(f"{chain.name}[{k}]", chain.body_of(k))

    def __len__(self) -> int:
        count = sum(1 + len(body.ends) for body in self.scene.body)
        for chain in self.scene.chain:
            full_periods, remainder = divmod(chain.count, len(chain.body))
            ends = [1 + len(body.ends) for body in chain.body]
            count += full_periods * sum(ends) + sum(ends[:remainder])
        return count


def _body_and_end_names(name: str, body: BodyTable) -> Iterator[str]:
    yield name
    for end in body.ends:
        yield f"{name}.{end}"
