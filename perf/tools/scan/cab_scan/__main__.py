"""`python3 -P -m cab_scan`: looks for what it needs, then runs the command."""

import errno
import gc
import importlib.util
import os
import sys

from . import stopping

_HOW_TO_GET = {
    "numpy": "Debian: python3-numpy",
    "cab": "docs/python.md of cab says how to install it, or set PYTHONPATH to its folder",
}


def main() -> int:
    """The exit code of the command, or 1 if a package is missing, or the results cannot be printed."""
    if sys.stderr is None:  # it is closed, and so is sys.stdout below
        sys.stderr = open(os.devnull, "w", encoding="utf-8")
    if sys.stdout is None:  # as the other commands of cab say it
        print(f"cab scan: cannot write to standard output: {os.strerror(errno.EBADF)}", file=sys.stderr)
        return 1
    _leave_current_folder()  # with signals as the command cab holds them back
    stopping.begin()
    installed = os.environ.get("CAB_PYTHON_MODULE")  # where the command was installed with the module cab
    if installed and importlib.util.find_spec("cab") is None:
        sys.path.append(installed)
    missing = [name for name in _HOW_TO_GET if importlib.util.find_spec(name) is None]
    for name in missing:
        print(f"cab scan: {sys.executable} has no module {name} ({_HOW_TO_GET[name]})", file=sys.stderr)
    if missing:
        print("cab scan: CAB_PYTHON=/path/to/python3 chooses another Python", file=sys.stderr)
        return 1
    from .command import run

    code = run(sys.argv[1:])
    if code == stopping.CODE:
        stopping.end()
    stopping.ignore()
    gc.freeze()  # Python ends sooner if it does not look for garbage in all modules
    return code


def _leave_current_folder() -> None:
    """Begins anew if modules may come from the current folder, which a stranger may have filled.

    Python before 3.11 knows no PYTHONSAFEPATH. Its option -I does the same, and the processes of workers inherit it.
    """
    if getattr(sys.flags, "safe_path", False) or sys.flags.isolated:
        return
    path = [place for place in sys.path if place]
    given = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    if path and path[0] == os.getcwd() and path[0] not in given:  # -m put it there
        del path[0]
    begin = f"import sys; sys.path[:] = {path!r}; from cab_scan.__main__ import main; sys.exit(main())"
    flags = ["-I", "-B"] if sys.dont_write_bytecode else ["-I"]
    os.execv(sys.executable, [sys.executable, *flags, "-c", begin, *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
