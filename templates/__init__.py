"""Jinja templates of the C text; `derive.render` fills them."""
