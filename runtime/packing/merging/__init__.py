"""Simplifications of a scene that do not change its motion: merged bodies, exact right angles."""
