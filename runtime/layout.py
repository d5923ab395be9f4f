"""Where a hinge's coordinates and speeds stand in q and u: hinges in the scene's order."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class HingeSlots:
    """Place and names of one hinge's coordinates and speeds."""

    name: str
    type: str
    q: int
    u: int
    q_names: tuple[str, ...]
    q_units: tuple[str, ...]
    u_names: tuple[str, ...]
    u_units: tuple[str, ...]
    quaternion: int | None  # first quaternion entry within the hinge

    @property
    def nq(self) -> int:
        return len(self.q_names)

    @property
    def nu(self) -> int:
        return len(self.u_names)

    @property
    def q_slice(self) -> slice:
        return slice(self.q, self.q + self.nq)

    @property
    def u_slice(self) -> slice:
        return slice(self.u, self.u + self.nu)


@dataclass(frozen=True)
class Layout:
    """Layout of q (nq) and u (nu) by hinge name, in the scene's order."""

    hinges: dict[str, HingeSlots] = field(default_factory=dict)
    nq: int = 0
    nu: int = 0

    @property
    def q_names(self) -> list[str]:
        """`hinge.coordinate` for every entry of q."""
        return [f"{h.name}.{n}" for h in self.hinges.values() for n in h.q_names]

    @property
    def u_names(self) -> list[str]:
        """`hinge.speed` for every entry of u."""
        return [f"{h.name}.{n}" for h in self.hinges.values() for n in h.u_names]

    @property
    def quaternions(self) -> list[int]:
        """First index in q of every unit quaternion (w, x, y, z)."""
        return [h.q + h.quaternion for h in self.hinges.values() if h.quaternion is not None]
