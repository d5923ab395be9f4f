"""Tables of a scene, with their keys and checks."""
