"""Operating points of linear models: dry friction, steadiness, and changes along the motion."""
