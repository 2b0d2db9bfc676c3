"""A subcommand in a process that does not outlive the one that started it.

``python -m mapweave_deploy.run.parent_death PARENT COMMAND …`` runs ``mapweave COMMAND …``.
"""

import ctypes
import os
import signal
import sys

from mapweave import cli

PR_SET_PDEATHSIG = 1  # linux/prctl.h


def die_with_parent(parent: int) -> None:
    """Have the kernel kill this process as soon as `parent`, which started it, is gone.

    Elsewhere than on Linux nothing is done: there a launcher that is killed leaves its processes
    behind; one that is interrupted or fails does not.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # It was gone before the kernel was told.
        os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    die_with_parent(int(sys.argv[1]))
    sys.exit(cli.main(sys.argv[2:]))
