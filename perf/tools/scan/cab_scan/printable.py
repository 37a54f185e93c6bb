"""Text of strangers, made safe for a line of a terminal, for the table and for a spreadsheet."""

import re
from typing import Any, TextIO

# First and last of the characters that scenes/import/printable.cpp hides, which says what they are. The table of
# Python's unicodedata would depend on its version.
_HIDDEN_RANGES = (
    (0x0, 0x1F), (0x7F, 0x9F), (0xAD, 0xAD), (0x34F, 0x34F), (0x61C, 0x61C), (0x115F, 0x1160), (0x17B4, 0x17B5),
    (0x180B, 0x180F), (0x200B, 0x200F), (0x2028, 0x202E), (0x2060, 0x206F), (0x3164, 0x3164), (0xFE00, 0xFE0F),
    (0xFEFF, 0xFEFF), (0xFFA0, 0xFFA0), (0xFFF0, 0xFFFB), (0x1BCA0, 0x1BCA3), (0x1D173, 0x1D17A), (0xE0000, 0xE0FFF),
    (0xD800, 0xDFFF),  # halves of surrogate pairs, which are bytes that are no UTF-8
)
_HIDDEN = re.compile("[" + "".join(f"{chr(first)}-{chr(last)}" for first, last in _HIDDEN_RANGES) + "]")
# With these a spreadsheet takes a text for a formula; the apostrophe is what marks a text.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "'")
_LONELY = re.compile("[\ud800-\udfff]")
_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]+)?")


def printable(text: str) -> str:
    """The text with "?" for every character that has no shape of its own, as the command cab prints names."""
    return _HIDDEN.sub("?", text)


def shortened(text: str, most: int, end: int) -> str:
    """A text of at most `most` characters: of a longer one the middle is left out, and the last `end` stay."""
    return text if len(text) <= most else f"{text[:most - 5 - end]} ... {text[-end:]}"


def tell(text: str, file: TextIO) -> None:
    """Prints a line of printable text, also where the terminal lacks some of its characters."""
    line = printable(text)
    print(line.encode(file.encoding or "utf-8", "replace").decode(file.encoding or "utf-8"), file=file)


def table_text(name: str) -> str:
    """A name as UTF-8 can write it: a byte that is no UTF-8 becomes \\xHH, another half of a surrogate pair \\uHHHH.

    Each backslash becomes two, so that different names stay different.
    """
    return "".join(map(_table_character, name)) if "\\" in name or _LONELY.search(name) else name


def _table_character(character: str) -> str:
    if character == "\\":
        return "\\\\"
    number = ord(character)
    if 0xDC80 <= number <= 0xDCFF:  # how Python has a byte of a file's name that is no UTF-8
        return f"\\x{number - 0xDC00:02x}"
    return f"\\u{number:04x}" if 0xD800 <= number <= 0xDFFF else character


def csv_cell(value: Any) -> Any:
    """A text that a spreadsheet would take for a formula gets an apostrophe before it. Numbers stay numbers."""
    if isinstance(value, str) and value.startswith(_FORMULA) and not _NUMBER.fullmatch(value):
        return "'" + value
    return value


def text_of_cell(cell: str) -> str:
    """The text that a cell of the command's or of `csv_cell` was made from."""
    return cell[1:] if cell.startswith("'") else cell
