"""Elements and their derivations as pages for a reader."""
