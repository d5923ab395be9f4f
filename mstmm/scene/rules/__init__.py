"""What one value of a scene may be, and the words in which it is refused."""
