"""The sweep of one scene replayed on the graph.  No SymPy: somebody waits."""
