"""Classical discrete-time transfer matrix method: scenes to C records, motions to q and u."""
