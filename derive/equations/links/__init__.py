"""Combined kernels of a rigid body and its inboard hinge, one per pass."""
