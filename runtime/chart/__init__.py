"""Cost against accuracy of one scene: every method, every level of model, and which to take."""
