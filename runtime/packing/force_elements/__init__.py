"""What acts between two ends without mass: springs, elements of users' types, and bushings."""
