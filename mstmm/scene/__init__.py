"""Public interface of scenes: the tables of a scene, and functions to read one."""

from __future__ import annotations

from .files.read import read
from .load import load_scene
from .rules.values import split
from .scene import Scene
from .tables.beam import Beam
from .tables.beam_keys import Modes, Section, Shapes
from .tables.body import Body, End
from .tables.bushing import Bushing
from .tables.chain import Chain
from .tables.closures import Constraint, Coupling
from .tables.elastic import Elastic
from .tables.elastic_keys import Arrays, Box, ElasticEnd
from .tables.flexible import Damping, Start
from .tables.hinge import Hinge
from .tables.hinge_keys import Initial, Rated
from .tables.law import Friction, Law, LawEntry, Limits, SpringLaw
from .tables.loads import Event, Load, Spring
from .tables.outside.inputs import Input, Output, Signal
from .tables.outside.names import Names
from .tables.outside.shape import Shape

__all__ = [
    "Arrays", "Beam", "Body", "Box", "Bushing", "Chain", "Constraint", "Coupling", "Damping",
    "Elastic", "ElasticEnd", "End", "Event", "Friction", "Hinge", "Initial", "Input", "Law",
    "LawEntry", "Limits", "Load", "Modes", "Names", "Output", "Rated", "Scene", "Section",
    "Shape", "Shapes", "Signal", "Spring", "SpringLaw", "Start", "load_scene", "read", "split",
]  # fmt: skip
