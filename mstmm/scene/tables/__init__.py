"""The tables of a scene, each with its keys and its own rules."""
