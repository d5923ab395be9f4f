"""Three-dimensional views of a scene: geometry, motion, pages and films."""
