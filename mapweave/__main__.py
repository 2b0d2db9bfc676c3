"""The program ``mapweave``, also as ``python -m mapweave``.

Nothing is imported before Ctrl-C is heard: pressed early it ends the program without a trace.
"""

import signal
import sys

_HEARD = signal.getsignal(signal.SIGINT) is signal.default_int_handler
if _HEARD:  # not where a shell started it in the background
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def main() -> int:
    """Run the program and return its exit status."""
    from mapweave import cli

    if _HEARD:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
