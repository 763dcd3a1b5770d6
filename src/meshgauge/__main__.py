"""``python -m meshgauge``."""

import sys


def run() -> int:
    """The command line; returns the exit code. Ctrl-C while it is still being loaded is no traceback either."""
    try:
        from .cli.main import main
    except KeyboardInterrupt:
        return 130
    return main()


if __name__ == "__main__":
    sys.exit(run())
