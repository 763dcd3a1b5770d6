"""What a figure was measured with."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path


def versions(*packages: str) -> str:
    """One line: processor, Python and packages."""
    processor = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        processor = f"{len(names)} x {names[0]}" if names else processor
    told = ", ".join(f"{name} {version(name)}" for name in ("meshgauge", "numpy", "numba", *packages))
    return f"{processor}; Python {platform.python_version()}, {told}"
