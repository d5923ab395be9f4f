"""Time integration in C: settings, methods and the Python driver of its loop."""
