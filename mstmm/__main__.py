"""Entry point of `mstmm` and `python -m mstmm`."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line and exit with its code."""
    from .cli.guard import leave

    leave(sys.argv[1:])


if __name__ == "__main__":
    main()
