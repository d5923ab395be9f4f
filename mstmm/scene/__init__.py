"""Public interface of scenes: the tables of a scene, and functions to read one."""

from __future__ import annotations

from .files import read_tables
from .load import load_scene
from .scene import Scene
from .tables.beam import Beam, Modes, Section, Shapes
from .tables.body import Body, End
from .tables.bushing import Bushing
from .tables.chain import Chain
from .tables.closures import Constraint, Coupling
from .tables.elastic import Arrays, Box, Elastic, ElasticEnd
from .tables.flexible_keys import Damping, InitialDeformation
from .tables.hinge import Hinge, HingeRating, Initial
from .tables.inputs import Input, Output, Signal
from .tables.law import Friction, Law, LawEntry, Limits, SpringLaw
from .tables.loads import Event, Load, Spring
from .tables.names import Names
from .tables.shape import Shape
from .validators.scalars_and_vectors import split_reference

__all__ = [
    "Arrays",
    "Beam",
    "Body",
    "Box",
    "Bushing",
    "Chain",
    "Constraint",
    "Coupling",
    "Damping",
    "Elastic",
    "ElasticEnd",
    "End",
    "Event",
    "Friction",
    "Hinge",
    "HingeRating",
    "Initial",
    "InitialDeformation",
    "Input",
    "Law",
    "LawEntry",
    "Limits",
    "Load",
    "Modes",
    "Names",
    "Output",
    "Scene",
    "Section",
    "Shape",
    "Shapes",
    "Signal",
    "Spring",
    "SpringLaw",
    "load_scene",
    "read_tables",
    "split_reference",
]  # fmt: skip
