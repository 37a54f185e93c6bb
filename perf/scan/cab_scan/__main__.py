"""`python3 -m cab_scan`: looks for what it needs, then runs the command."""

import importlib.util
import sys

_HOW_TO_GET = {
    "numpy": "Debian: python3-numpy",
    "dask": "Debian: python3-dask; `./dev deps --cluster` in the sources of cab installs it",
    "distributed": "Debian: python3-distributed; `./dev deps --cluster` in the sources of cab installs it",
    "cab": "docs/python.md of cab says how to install it, or set PYTHONPATH to its folder",
}


def main() -> int:
    """The exit code of the command, or 1 if a package is missing."""
    missing = [name for name in _HOW_TO_GET if importlib.util.find_spec(name) is None]
    for name in missing:
        print(f"cab scan: {sys.executable} has no module {name} ({_HOW_TO_GET[name]})", file=sys.stderr)
    if missing:
        print("cab scan: CAB_PYTHON=/path/to/python3 chooses another Python", file=sys.stderr)
        return 1
    from .command import run

    return run(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
