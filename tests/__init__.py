"""Tests: `mstmm`, `derive` and `runtime` mirror the product file by file."""
