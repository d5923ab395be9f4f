"""Static starts: static deformations of flexible bodies, with and without closed loops."""
