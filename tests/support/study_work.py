"""Work for executors: a job is (number, what to do with it)."""

import os
import signal
import time
from pathlib import Path


class Doer:
    """Does what a job says; `marks` is a folder that remembers deaths across processes."""

    def __init__(self, marks=None):
        self.marks = marks

    def __call__(self, job):
        number, deed = job
        return getattr(self, deed)(number)

    def square(self, number):
        return number * number

    def pid(self, _number):
        return os.getpid()

    def ten_ms(self, number):
        time.sleep(0.01)
        return number

    def die(self, _number):
        os.kill(os.getpid(), signal.SIGKILL)

    def leave(self, _number):
        os._exit(3)

    def die_once(self, number):
        mark = Path(self.marks, str(number))
        if not mark.exists():
            mark.touch()
            self.die(number)
        return number

    def hang(self, _number):
        time.sleep(600)

    def fail(self, number):
        raise RuntimeError(f"number {number}")

    def talk(self, number):
        print("words on standard output")
        return number

    def bulky(self, number):
        return bytes(300_000) + bytes([number % 256])

    def threads(self, _number):
        return os.environ["OMP_NUM_THREADS"]

    def sleep_after_mark(self, number):
        Path(self.marks, f"{os.getpid()}").touch()
        time.sleep(600)
