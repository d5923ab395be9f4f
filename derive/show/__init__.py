"""Pages that display elements and their derivations."""
