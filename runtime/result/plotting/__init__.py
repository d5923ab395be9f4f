"""Pictures of quantities: what is drawn if nobody chose, panels of curves, figures."""
