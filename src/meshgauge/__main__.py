"""``python -m meshgauge``, and the program ``meshgauge``."""

import _signal  # type: ignore[import-not-found]  # of the interpreter itself: ``signal`` takes milliseconds in which Ctrl-C would be a traceback
import gc
import os
import sys


def run() -> int:
    """The command line as a process; returns the exit code. A signal is no traceback, while all is being loaded too."""
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, _signal.SIG_DFL)  # ends the process without a word
    # Matrices are small here, and threads are our own: those that NumPy would start for its linear algebra take a tenth
    # of the time of a small report, and have nothing to do.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(300_000)  # objects: no sweep over what is loaded, which all of it stays
    try:
        from .cli import interrupts, streams
        from .cli.main import main
    except (MemoryError, ImportError, OSError) as error:  # too little memory is many errors
        print(f"meshgauge: error: cannot be loaded, for want of memory or as it is not whole: {error}", file=sys.stderr)
        return 2
    try:
        interrupts.install()
        streams.prepare()
        streams.set_apart()
        return main()
    except KeyboardInterrupt:
        return interrupts.code()
    finally:
        interrupts.leave()
        gc.freeze()  # the process ends: to look through all that is loaded once more takes longer than a small mesh


def program() -> int:
    """`run`, and with it the process ends; returns the exit code where something has still to be waited for."""
    code = run()
    if (interrupts := sys.modules.get(f"{__package__}.cli.interrupts")) is not None:
        interrupts.end(code)
    return code


if __name__ == "__main__":
    sys.exit(program())
