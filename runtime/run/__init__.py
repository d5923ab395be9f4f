"""One run or many: the scene as a system, from its start to its trajectory."""
