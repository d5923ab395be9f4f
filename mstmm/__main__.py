"""Entry point of `mstmm` and `python -m mstmm`."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line and exit with its code."""
    from .cli.error_boundary import run_and_exit

    run_and_exit(sys.argv[1:])


if __name__ == "__main__":
    main()
