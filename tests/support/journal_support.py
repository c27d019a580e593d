"""What tests do to journals behind the back of cfmkit."""

import sqlite3
from contextlib import closing


def keys_in(path):
    """Return the keys of all records, also while another process writes."""
    if not path.exists():
        return set()
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
        try:
            return {key for (key,) in database.execute("SELECT key FROM records")}
        except sqlite3.OperationalError:  # it is just being made
            return set()


def damage_a_record(path, key):
    """Change one bit in the record of a key."""
    with closing(sqlite3.connect(path)) as database:
        ((packed,),) = database.execute("SELECT record FROM records WHERE key = ?", (key,))
    content = bytearray(path.read_bytes())
    content[content.index(packed) + 5] ^= 0x10
    path.write_bytes(content)


class NotesInMemory:
    """What a search notes, for as long as the test takes."""

    def __init__(self):
        self.keys = {}

    def find(self, key):
        return self.keys.get(key)

    def add(self, key, record):
        self.keys[key] = record
