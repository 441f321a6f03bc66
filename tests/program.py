"""The command as a user calls it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass


@dataclass(frozen=True)
class Answer:
    """What a call of the command left behind."""

    code: int
    out: str
    err: str

    @property
    def summary(self) -> str:
        """The last line, which counts what became of the units."""
        return self.err.splitlines()[-1]


class Program:
    """Calls the command."""

    def __call__(self, *arguments: object) -> Answer:
        command = [sys.executable, "-m", "bsip_cli", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return Answer(done.returncode, done.stdout, done.stderr)

    def done(self, *arguments: object) -> Answer:
        """Of a call that must succeed."""
        answer = self(*arguments)
        assert answer.code == 0, answer.err
        return answer
