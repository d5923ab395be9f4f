"""A rigid body behind a hinge as one element, a kernel a pass."""
