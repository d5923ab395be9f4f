"""The atlas of failures: where methods fail, found anew in every run, and what holds there."""
