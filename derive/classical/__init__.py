"""Classical transfer matrices: one file per element, each a Derivation with its premises."""
