"""What is looked at before a run, and what is done about risks."""
