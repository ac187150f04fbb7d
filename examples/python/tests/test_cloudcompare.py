"""The plugin for CloudCompare, on a stub of its modules."""
import importlib
import sys
from importlib.metadata import entry_points

import cloudcompare_stub
import numpy as np
import pytest
from conftest import transformed

shifts = [(-1000.0, 0.0, 0.0), (0.0, -500.0, 20.0)]


@pytest.fixture
def open_plugin(monkeypatch):
    """Loads the plugin as CloudCompare does, by its entry point."""

    def load(*selected):
        pycc, cccorelib = cloudcompare_stub.modules(selected)
        monkeypatch.setitem(sys.modules, "pycc", pycc)
        monkeypatch.setitem(sys.modules, "cccorelib", cccorelib)
        sys.modules.pop("globalmatch.cloudcompare", None)
        (entry,) = [e for e in entry_points(group="cloudcompare.plugins") if e.name == "globalmatch"]
        return entry.load()(), pycc

    yield load
    sys.modules.pop("globalmatch.cloudcompare", None)
    importlib.invalidate_caches()


@pytest.fixture
def clouds(scans):
    """Both scans at map coordinates, which CloudCompare shifts."""
    return [
        cloudcompare_stub.ccPointCloud(name, points - np.array(shift), shift)
        for name, points, shift in zip(("one", "two"), scans, shifts)
    ]


def test_the_first_scan_is_registered_with_the_second(open_plugin, clouds, scans, true_transform):
    plugin, pycc = open_plugin("a folder", *clouds)
    assert isinstance(plugin, pycc.PythonPluginInterface)
    plugin.getActions()[0].target()
    (level, message), = pycc.log
    assert level == "Print" and message.startswith("globalmatch: one on two: registered: ")
    expected = transformed(true_transform, scans[0]) - np.array(shifts[1])
    assert np.abs(clouds[0].original() - expected).max() < 0.01
    assert np.abs(clouds[1].original() - (scans[1] - np.array(shifts[1]))).max() < 1e-3


def test_the_second_scan_is_registered_with_the_first(open_plugin, clouds, scans, true_transform):
    plugin, _ = open_plugin(*clouds)
    plugin.getActions()[1].target()
    expected = transformed(np.linalg.inv(true_transform), scans[1]) - np.array(shifts[0])
    assert np.abs(clouds[1].original() - expected).max() < 0.01


def test_without_an_answer_nothing_is_transformed(open_plugin, clouds):
    clouds[1].coordinates = clouds[1].coordinates[:1000]
    before = clouds[0].coordinates
    plugin, pycc = open_plugin(*clouds)
    plugin.getActions()[0].target()
    assert pycc.log[-1][0] == "Error" and "not_registered: " in pycc.log[-1][1]
    assert clouds[0].coordinates is before
    assert any(level == "Warning" for level, _ in pycc.log)


def test_cancel_leaves_all_as_it_was(open_plugin, clouds, monkeypatch):
    monkeypatch.setattr(cloudcompare_stub.ccProgressDialog, "cancel", True)
    before = clouds[0].coordinates
    plugin, pycc = open_plugin(*clouds)
    plugin.getActions()[0].target()
    (level, message), = pycc.log
    assert level == "Warning" and ": cancelled: " in message
    assert clouds[0].coordinates is before


def test_a_report_that_fails_leaves_all_as_it_was(open_plugin, clouds, monkeypatch):
    before = clouds[0].coordinates
    plugin, pycc = open_plugin(*clouds)

    def fail(*_):
        raise LookupError("no report")

    monkeypatch.setattr(sys.modules["globalmatch.cloudcompare"], "describe", fail)
    with pytest.raises(LookupError):
        plugin.getActions()[0].target()
    assert clouds[0].coordinates is before


def test_two_clouds_must_be_selected(open_plugin, clouds):
    plugin, _ = open_plugin(clouds[0])
    with pytest.raises(RuntimeError, match="select two clouds; 1 are selected"):
        plugin.getActions()[0].target()
