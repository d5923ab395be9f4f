"""Every element and kernel there is, and writing all of them to `generated/`."""
