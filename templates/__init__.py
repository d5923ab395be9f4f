"""Templates of the C text, rendered by `derive.codegen.template_rendering`."""
