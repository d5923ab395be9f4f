"""Commands that ask more of a scene than one run."""
