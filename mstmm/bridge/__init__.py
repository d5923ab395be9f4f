"""What joins derivation and numbers: compiling a scene, fusing it, and comparing both."""
