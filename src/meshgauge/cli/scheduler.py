"""Where the slices of a large mesh are measured: threads, processes, or a cluster of Dask."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor
from types import FrameType

from ..errors import MeshgaugeError, OptionError

VARIABLE = "DASK_SCHEDULER_ADDRESS"

MOST = 1024
"""Processes that may be asked for."""


def check(text: str | None) -> None:
    """Raise `OptionError` unless it is a number of processes or an address."""
    if text is not None and "://" not in text and not (text.isdecimal() and 1 <= int(text) <= MOST):
        raise OptionError(
            f"--scheduler is {text!r}, expected a number of processes up to {MOST}, or the address of a scheduler of "
            "Dask such as tcp://head:8786"
        )


def of_environment() -> str | None:
    """The address of a scheduler of Dask that ``$DASK_SCHEDULER_ADDRESS`` names, as Dask's own programs take it."""
    address = os.environ.get(VARIABLE, "").strip()
    return None if not address else address if "://" in address else f"tcp://{address}"


@contextlib.contextmanager
def executor(text: str | None) -> Iterator[tuple[Executor | None, int]]:
    """The executor that ``--scheduler`` names, and among how many processes of this machine memory is shared.

    None stands for threads of this process.

    Raises
    ------
    OptionError
        If it is neither a number of processes nor an address.
    MeshgaugeError
        If Dask is not installed, or nobody answers at the address.
    """
    check(text)
    if text is None:
        yield None, 1
    elif "://" not in text:
        from concurrent.futures import ProcessPoolExecutor  # which takes as long to load as reading a small mesh
        from multiprocessing import get_context

        # Not forked: threads of Numba and HDF5 do not survive that.
        with ProcessPoolExecutor(int(text), mp_context=get_context("spawn"), initializer=heed_the_second) as pool:
            yield pool, int(text)
    else:
        with _dask(text) as pool:
            yield pool, 1


def heed_the_second() -> None:
    """Have a worker finish its task on the first Ctrl-C, which a terminal sends to all processes: what it has done is
    asked for by a program that is to write the best so far."""
    signal.signal(signal.SIGINT, _first)


def _first(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.default_int_handler)


@contextlib.contextmanager
def _dask(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError:
        raise MeshgaugeError("--scheduler with an address needs Dask: pip install 'meshgauge[dask]'") from None
    try:
        client = Client(address)
    except (OSError, ValueError) as error:
        by = f"${VARIABLE}" if address == of_environment() else "--scheduler"
        raise MeshgaugeError(f"{by} {address}: {error}") from error
    with client:
        yield client.get_executor()
