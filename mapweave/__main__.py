"""The program ``mapweave``, also as ``python -m mapweave``.

Nothing is imported before Ctrl-C is heard: pressed early it ends the program without a trace.
"""

import io
import os
import signal
import sys

_HEARD = signal.getsignal(signal.SIGINT) is signal.default_int_handler
if _HEARD:  # not where a shell started it in the background
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _multiply_alone() -> None:
    """Let matrix products take one thread, unless the environment says how many.

    Ours are small: OpenBLAS shares one between all cores in no less time, and its threads then
    wait for the next one at full speed, for tens of milliseconds each.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read once, as numpy is loaded


def _ready_streams() -> None:
    """Fill what was closed, and let no output fail for a letter that a terminal does not have.

    The next file that is opened would be taken for the stream that was closed.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            empty = os.open(os.devnull, os.O_RDWR)
            os.set_inheritable(empty, True)
            setattr(sys, name, open(empty, "w" if number else "r"))  # noqa: PTH123, SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")


def main() -> int:
    """Run the program and return its exit status."""
    _ready_streams()
    _multiply_alone()
    from mapweave import cli

    if _HEARD:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
