"""``python -m steradian``: the command line."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Does what the words say, as the program ``steradian``."""
    from . import run

    # What --engine starts is this Python.
    os.environ["STERADIAN_PYTHON"] = sys.executable
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
