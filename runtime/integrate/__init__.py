"""The time integration in C: settings, methods and the hold on its loop."""
