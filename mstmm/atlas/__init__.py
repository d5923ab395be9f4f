"""Atlas of failures: where methods fail, measured in every run, and which remedies hold there."""
