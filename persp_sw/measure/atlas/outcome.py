"""Running a case: what it found, or why it found nothing."""

from __future__ import annotations

import os
import traceback
from dataclasses import dataclass
from time import perf_counter

from .case import Case, Finding, Progress, Scale


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a case.

    Attributes
    ----------
    case
        Which.
    findings
        Its metrics; none where it broke off.
    seconds
        It took, references included.
    fault
        Why it broke off, one line; empty if it did not.
    """

    case: Case
    findings: tuple[Finding, ...]
    seconds: float
    fault: str = ""

    @property
    def holds(self) -> bool:
        """Whether it came to its end and all of its findings hold."""
        return not self.fault and all(finding.holds for finding in self.findings)


def outcome_of(case: Case, scale: Scale, progress: Progress) -> Outcome:
    """Run a case. An exception ends this case and not the atlas: it is the failure that the case looks for.

    With PERSP_SW_DEBUG in the environment its traceback is printed, too.
    """
    start = perf_counter()
    findings: tuple[Finding, ...] = ()
    fault = ""
    try:
        findings = tuple(case.run(scale, progress))
    except Exception as error:
        if os.environ.get("PERSP_SW_DEBUG"):
            traceback.print_exc()
        fault = " ".join(f"{type(error).__name__}: {error}".split())
    return Outcome(case, findings, perf_counter() - start, fault)
