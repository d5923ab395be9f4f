"""Many independent runs of one model."""
