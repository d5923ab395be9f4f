"""Simplifications that do not change the motion: merged bodies, exact right angles."""
