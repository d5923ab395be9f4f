"""Pipeline from a scene to a compiled model: connects derivation and numerical code."""
