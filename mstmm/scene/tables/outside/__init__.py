"""What a scene has to do with the outside: what comes in, what is measured, what is seen."""
