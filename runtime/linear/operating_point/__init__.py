"""Operating points of linear models: dry friction there, and whether they last."""
