"""From bytes to text that can be parsed: encoding, size and characters that no specification may hold."""

from __future__ import annotations

from dataclasses import dataclass

from cfmkit.specs.units.strict_decimal_number import odd_character

MAX_FILE_BYTES = 1_000_000
MOST_KINDS = 20
_FOREIGN_MARKS = {
    b"\xff\xfe\x00\x00": "UTF-32",
    b"\x00\x00\xfe\xff": "UTF-32",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}


@dataclass(frozen=True)
class Fault:
    """Something wrong at a place of a source, before it is known whose source that is."""

    line: int
    column: int
    path: tuple[str | int, ...]
    message: str
    makes_value_unusable: bool = True  # whether nothing more should be said about the value at `path`


class Unreadable(Exception):
    """The source cannot be read any further."""

    def __init__(self, fault: Fault) -> None:
        """Keep the fault that ended the reading."""
        self.fault = fault
        super().__init__(fault.message)


def decode(data: bytes | str) -> str:
    """Return the text of a source without its byte order mark.

    Raises Unreadable if it is too large, or not UTF-8.
    """
    if len(data) > MAX_FILE_BYTES:
        raise Unreadable(Fault(1, 1, (), f"the file is larger than {MAX_FILE_BYTES} bytes; put long data elsewhere"))
    if isinstance(data, str):
        return data.removeprefix("\ufeff")
    for mark, name in _FOREIGN_MARKS.items():
        if data.startswith(mark):
            raise Unreadable(Fault(1, 1, (), f"the file is {name}; save it as UTF-8"))
    try:
        return data.decode("utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        what = f"the byte 0x{data[error.start]:02x} at offset {error.start} is not UTF-8; save the file as UTF-8"
        raise Unreadable(Fault(*_position(before, len(before)), (), what)) from None


def replace_odd_characters(text: str) -> tuple[str, list[Fault]]:
    """Return the text with a space for every character that is refused, and a fault for each kind of them."""
    kinds = {char: found[1] for char in set(text) if (found := odd_character(char))}
    first = sorted((text.index(char), char) for char in sorted(kinds)[:MOST_KINDS])
    faults = [_odd(text, index, kinds[char], text.count(char)) for index, char in first]
    return text.translate(dict.fromkeys(map(ord, kinds), " ")), faults


def _odd(text: str, index: int, what: str, count: int) -> Fault:
    more = f" ({count} in all)" if count > 1 else ""
    return Fault(*_position(text, index), (), f"here is {what}{more}")


def _position(text: str, index: int) -> tuple[int, int]:
    """Return (line, column) of an index, both from 1; lines end with LF, CRLF or CR."""
    before = text[:index].replace("\r\n", "\n").replace("\r", "\n")
    return before.count("\n") + 1, len(before) - before.rfind("\n")
