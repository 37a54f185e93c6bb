"""What work costs, whatever else the machine does."""

import resource


def core_seconds() -> float:
    """Seconds of CPU of this process and of the children that it waited for, which read files."""
    own, children = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime
