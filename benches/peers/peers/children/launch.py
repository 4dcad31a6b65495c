"""Runs a program and prints what it cost as JSON: TIMEOUT PROGRAM ARGUMENTS...

A process inherits the peak memory of the one that starts it (Linux keeps ru_maxrss across exec), so a small one must do it. Run with
`python -I -S`; its own ten megabytes are the least that can be read.
"""

import json
import os
import signal
import sys
import time


def main() -> None:
    """Waits for the child alone; its output goes to standard error."""
    timeout, command = float(sys.argv[1]), sys.argv[2:]
    begin = time.monotonic()
    child = os.posix_spawnp(command[0], command, os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, 2, 1)])
    signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
    signal.setitimer(signal.ITIMER_REAL, timeout)
    _, status, usage = os.wait4(child, 0)
    wall = time.monotonic() - begin
    print(json.dumps({"exit": os.waitstatus_to_exitcode(status), "wall": round(wall, 4), "cpu": round(usage.ru_utime + usage.ru_stime, 4),
                      "peak_mb": round(usage.ru_maxrss / 1024, 1)}))


main()
