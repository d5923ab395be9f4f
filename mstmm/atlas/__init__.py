"""Atlas of failures: where methods fail, measured in every run, and remedies that hold."""
