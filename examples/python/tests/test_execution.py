"""The GIL is released, progress is reported, Ctrl-C is heard, and scans are not copied."""
import contextlib
import ctypes
import functools
import signal
import subprocess
import sys
import threading
import time

import globalmatch
import numpy as np
import pytest


@pytest.fixture(scope="module")
def long_scan(scans):
    """As many points as take a second and more."""
    return np.vstack([scans[1] + [40.0 * column, 0, 0] for column in range(25)])


def test_other_threads_run_meanwhile(long_scan):
    calls, seen, done = {}, set(), threading.Event()

    def watch():
        while not done.is_set():
            seen.add(len(calls))
            time.sleep(0.001)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        globalmatch.map_stems(long_scan, threads=1, progress=calls.__setitem__)
    finally:
        done.set()
        watcher.join()
    assert any(0 < count < len(calls) for count in seen)  # after the first call of progress, before the last


def test_threads_may_map_at_once(scans):
    reference = globalmatch.map_stems(scans[1]).stems.tobytes()
    results = []
    threads = [
        threading.Thread(target=lambda: results.append(globalmatch.map_stems(scans[1]).stems.tobytes()))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [reference] * 3


def test_the_number_of_threads_does_not_matter(scans):
    maps = [globalmatch.map_stems(scans[1], threads=threads) for threads in (1, 2, 5)]
    assert len({found.stems.tobytes() for found in maps}) == 1


def test_progress_is_called_with_fraction_and_stage(long_scan):
    calls = []
    globalmatch.map_stems(long_scan, progress=lambda fraction, stage: calls.append((fraction, stage)))
    assert len(calls) > 2
    assert all(0 <= fraction <= 1 and isinstance(stage, str) and stage for fraction, stage in calls)
    assert "ground" in {stage for _, stage in calls}


def test_progress_cancels_by_false(scans, stems):
    def stop(_fraction, _stage):
        return False

    assert globalmatch.map_stems(scans[1], progress=stop).cancelled
    result = globalmatch.register_scans(*scans, progress=stop)
    assert result.outcome == "cancelled" and result.target_from_source is None and result.warnings == []
    assert repr(result) == "<Registration: cancelled, cancelled by the progress callback>"
    assert globalmatch.match_stems(stems[:, :3], stems[:, :3], progress=stop).outcome == "cancelled"
    assert globalmatch.register_survey([stems[:, :3]] * 2, progress=stop).cancelled


@pytest.mark.parametrize("answer", [False, np.False_, 0, []])
def test_what_is_false_cancels(scans, answer):
    assert globalmatch.map_stems(scans[1], progress=lambda *_: answer).cancelled


@pytest.mark.parametrize("answer", [None, True, np.True_, 1, "go on"])
def test_none_and_what_is_true_go_on(scans, answer):
    found = globalmatch.map_stems(scans[1], progress=lambda *_: answer)
    assert not found.cancelled and len(found) > 30


def test_an_answer_without_a_truth_value_is_an_error(scans):
    with pytest.raises(ValueError, match="truth value of an array"):
        globalmatch.map_stems(scans[1], progress=lambda *_: np.zeros(2))


def test_what_progress_raises_is_raised(scans):
    def fail(_fraction, stage):
        raise LookupError(stage)

    with pytest.raises(LookupError, match="ground"):
        globalmatch.map_stems(scans[1], progress=fail)


# As progress(fraction, stage) it sends SIGINT to this thread. It is no Python code, where the interpreter would
# hear the signal: that is left to the library, the next time that it asks.
raise_signal = ctypes.PyDLL(None)["raise"]  # other arguments than the first one are not looked at
raise_signal.argtypes, raise_signal.restype = [ctypes.c_int, ctypes.c_double, ctypes.c_wchar_p], None
send_interrupt = functools.partial(raise_signal, signal.SIGINT)


@contextlib.contextmanager
def handler_of_interrupts(handler):
    """Whatever the shell does with them: it ignores them in background jobs."""
    previous = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


def test_signals_are_heard_while_the_library_computes(long_scan):
    heard = []
    with handler_of_interrupts(lambda *_: heard.append(True)):
        found = globalmatch.map_stems(long_scan, threads=1, progress=send_interrupt)
    assert len(heard) > 2  # once only, if they were heard when the call was over
    assert not found.cancelled


def test_ctrl_c_ends_the_call(long_scan):
    heard = []

    def interrupt_second_time(*_):
        heard.append(True)
        if len(heard) == 2:
            raise KeyboardInterrupt

    with handler_of_interrupts(interrupt_second_time), pytest.raises(KeyboardInterrupt):
        globalmatch.map_stems(long_scan, threads=1, progress=send_interrupt)
    assert len(heard) == 2  # nothing went on
    assert len(globalmatch.map_stems(long_scan[:10])) == 0  # what was interrupted leaves nothing behind


# Points of little weight for the library: they fall into few cells.
peak = """
import resource, sys, numpy, pandas, globalmatch
numbers = numpy.random.default_rng(1)
points = numpy.empty((5000000, 3), sys.argv[1], sys.argv[2])
for k in range(3):
    points[:, k] = numbers.random(len(points), numpy.float32)
points = points[:, ::-1]
if sys.argv[3] == "DataFrame":
    points = pandas.DataFrame(points, columns=list("xyz"), copy=False)
globalmatch.map_stems(numpy.zeros((10, 3)))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
globalmatch.map_stems(points, threads=1, understory={"min_height": 50, "max_height": 60})
grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
print(1024 * grown, 3 * len(points) * numpy.dtype(sys.argv[1]).itemsize)
"""


@pytest.mark.parametrize("form", ["array", "DataFrame"])
@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_points_are_not_copied(dtype, order, form):
    command = [sys.executable, "-c", peak, dtype, order, form]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    grown, size = map(int, run.stdout.split())
    assert grown < 0.2 * size
