"""What the gate says, for people, for programs and for what runs in a pipeline. Data in, text out."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import FailedFile
from .. import Check


def text_for(kind: str, checks: Sequence[Check], failures: Sequence[FailedFile] = ()) -> str:
    """The text of a file for other programs: ``junit``, ``sarif``, ``gitlab`` or ``markdown``."""
    from .gitlab import gitlab
    from .junit import junit
    from .markdown import markdown
    from .sarif import sarif

    make = {"junit": junit, "sarif": sarif, "gitlab": gitlab, "markdown": markdown}[kind]
    return make(checks, failures)
