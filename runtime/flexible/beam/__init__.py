"""Beams: shapes, frames, moments and the choices that a scene leaves open."""
