"""Graph of a mechanism: which hinges form its spanning tree, and where its loops close.

Bodies and hinges are integers here; -1 is the ground.  Nothing outside this package is imported.
"""
