"""Talking with the person at the servos: questions on standard error, answers by lines of standard input."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from collections.abc import Callable, Iterator, Sequence

from rich import box
from rich import progress as bars
from rich.console import Console
from rich.table import Table
from rich.text import Text

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.findings import Finding, Severity

_YES, _NO = ("y", "yes", "j", "ja"), ("n", "no", "nein")
_COLOURS = {
    Severity.OK: "green", Severity.NOTE: "blue", Severity.WARNING: "yellow", Severity.REFUSAL: "red",
}  # fmt: skip


class Answers:
    """A `Dialog` on the terminal, or with answers that a script writes line by line.

    Args:
        yes: agree to everything without asking.
        terminal_only: refuse to ask where standard input is no terminal.
    """

    def __init__(self, *, yes: bool, terminal_only: bool = False) -> None:
        self._yes = yes
        self._terminal_only = terminal_only

    def say(self, text: str) -> None:
        """Show a text."""
        print(text, file=sys.stderr, flush=True)

    def wait(self, text: str) -> None:
        """Show what to do, and wait for a line.

        Raises:
            ConfigurationError: nobody is there to answer.
        """
        if self._yes:
            return
        self._line(f"{text}. Then press Enter: ")

    def confirm(self, text: str) -> bool:
        """Ask until the answer is yes or no.

        Raises:
            ConfigurationError: nobody is there to answer.
        """
        if self._yes:
            return True
        while True:
            word = self._line(f"{text} [y/n] ").strip().lower()
            if word in (*_YES, *_NO):
                return word in _YES
            self.say("please answer y or n")

    def _line(self, prompt: str) -> str:
        if self._terminal_only and not sys.stdin.isatty():
            raise ConfigurationError(
                f"{prompt.strip()} Nobody can answer: standard input is no terminal. In a script, add --yes"
            )
        print(prompt, file=sys.stderr, end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            raise ConfigurationError(
                "no answer: standard input has ended. Answer line by line, or add --yes where that is meant"
            )
        return line


def findings_table(findings: Sequence[Finding], title: str) -> Table:
    """Findings as a table, each with its mend."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("", "part", "finding", "what to do"):
        table.add_column(heading, overflow="fold")
    for finding in _grouped(findings):
        state = Text(finding.severity.name.lower(), _COLOURS[finding.severity])
        table.add_row(state, Text(finding.part), Text(finding.text), Text(finding.mend))
    return table


def _grouped(findings: Sequence[Finding]) -> list[Finding]:
    """Findings with those that say the same of several servos as one, and what two checks found only once."""
    groups: dict[tuple[str, str, Severity, int], list[Finding]] = {}
    for index, finding in enumerate(dict.fromkeys(findings)):
        servo = finding.part.startswith("servo ")
        key = (finding.text, finding.mend, finding.severity, servo or index)
        groups.setdefault(key, []).append(finding)
    return [
        group[0] if len(group) == 1 else dataclasses.replace(group[0], part=f"servos {_numbers(group)}")
        for group in groups.values()
    ]


def _numbers(group: Sequence[Finding]) -> str:
    """Numbers of servos with ranges drawn together, ``1-4, 7``."""
    numbers = [int(finding.part.split()[1]) for finding in group]
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def findings_data(findings: Sequence[Finding]) -> list[dict[str, str]]:
    """Findings for ``--json``."""
    return [
        {"part": f.part, "severity": f.severity.name.lower(), "text": f.text, "mend": f.mend}
        for f in findings
    ]


@contextlib.contextmanager
def bar(label: str, total: int) -> Iterator[Callable[[], None]]:
    """A bar on a terminal; piped, nothing."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda: None
        return
    columns = (bars.TextColumn("{task.description}"), bars.BarColumn(), bars.MofNCompleteColumn())
    with bars.Progress(*columns, bars.TimeRemainingColumn(), console=console, transient=True) as shown:
        task = shown.add_task(label, total=total)
        yield lambda: shown.advance(task)
