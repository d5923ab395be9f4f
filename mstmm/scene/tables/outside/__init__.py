"""What a scene has to do with the outside."""
