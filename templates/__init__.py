"""Jinja templates of the C text; `derive.print.render` fills them."""
