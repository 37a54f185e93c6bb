"""A loader of `cab scan` whose parts decide what happens to the worker."""

import ctypes
import os
import signal
import subprocess
import sys
import tempfile
import time

import cab
import numpy
from cab_scan import Sequence


def load(request):
    time.sleep(float(os.environ.get("FAULT_SECONDS", "0")))
    if request.part == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if request.part == "once" and not os.path.exists(request.path + ".killed"):
        open(request.path + ".killed", "w").close()
        os.kill(os.getpid(), signal.SIGKILL)
    if request.part == "stop" and not os.path.exists(request.path + ".stopped"):
        open(request.path + ".stopped", "w").close()
        os.kill(os.getpid(), signal.SIGSTOP)
    if request.part == "eat":
        numpy.ones(1 << 40, dtype=numpy.uint8)
    if request.part == "grow":
        kept = []
        while True:
            kept.append(numpy.ones(1 << 24, dtype=numpy.uint8))
            time.sleep(0.01)
    if request.part == "hang":  # with a process that it started
        words = [sys.executable, "-c", "import time; time.sleep(600)"]
        with open(request.path + ".started", "a") as file:
            file.write(f"{subprocess.Popen(words).pid}\n")
        time.sleep(600)
    if request.part == "folder":
        with open(request.path + ".folder", "w") as file:
            file.write(tempfile.gettempdir())
    if request.part.startswith("hold "):
        ctypes.PyDLL(None).sleep(int(request.part[5:]))  # as PyDLL, unlike CDLL, it keeps Python's lock
    motion = cab.load_motion(request.path)
    yield Sequence(motion.body, motion.poses, motion.fps)
