"""`python3 -m cab` is the command `cab`: it runs the one of this installation, or that of PATH."""

import os
import pathlib
import shutil
import sys


def find_command() -> "str | None":
    """The command beside this file, where a wheel has it; else that of PATH."""
    beside = pathlib.Path(__file__).parent / "bin" / "cab"
    return str(beside) if beside.is_file() else shutil.which("cab")


def main() -> int:
    """Becomes the command, with all arguments; its exit code is ours."""
    command = find_command()
    if command is None:
        print(
            "cab: the command is not part of this installation, and PATH has none: install cab-tools, or build the "
            "package with the command (docs/python.md)",
            file=sys.stderr,
        )
        return 127
    os.execv(command, ["cab", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
