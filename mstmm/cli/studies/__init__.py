"""Commands for studies of a scene beyond a single run."""
