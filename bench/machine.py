"""The measuring machine and its load."""

import os
import platform
from datetime import datetime, timezone
from pathlib import Path
from typing import Any


def read_processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(": ", 1)[1]
    return platform.processor()


def describe_machine() -> dict[str, Any]:
    return {"processor": read_processor(), "cores": len(os.sched_getaffinity(0)),
            "kernel": platform.release()}


def now() -> str:
    return datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def read_memory_kb(process_id: int) -> int:
    """Resident memory; 0 if the process has ended."""
    try:
        status = Path(f"/proc/{process_id}/status").read_text()
    except OSError:
        return 0
    for line in status.splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    return 0
