"""Numbers without numpy: rotations, and numbers with their derivatives."""
