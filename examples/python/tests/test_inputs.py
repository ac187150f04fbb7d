"""Points may lie in arrays of any kind; what does not fit is refused by its name."""
import inspect
import pathlib

import globalmatch
import numpy as np
import pandas
import pytest


def same_bits(map_a, map_b):
    return map_a.stems.tobytes() == map_b.stems.tobytes() and np.array_equal(map_a.up, map_b.up)


def with_strides(points):
    """The same in every other row, backwards, of a wider array."""
    wide = np.zeros((2 * len(points), 7), points.dtype)
    view = wide[::-2, 5:2:-1]
    view[:] = points
    return view


def unaligned(points):
    rows = np.zeros(len(points), [("flag", "u1"), ("xyz", points.dtype, 3)])  # without padding
    rows["xyz"] = points
    return rows["xyz"]


def structured(points, names="xyz"):
    rows = np.zeros(len(points), [("intensity", "u2")] + [(name, points.dtype) for name in names])
    for k, name in enumerate(names):
        rows[name] = points[:, k]
    return rows


forms = {
    "C order": np.ascontiguousarray,
    "Fortran order": np.asfortranarray,
    "strides": with_strides,
    "unaligned": unaligned,
    "read only": lambda points: np.frombuffer(points.tobytes(), points.dtype).reshape(-1, 3),
    "structured": structured,
    "structured, upper case": lambda points: structured(points, "XYZ"),
    "DataFrame": lambda points: pandas.DataFrame(points, columns=list("xyz")),
    "DataFrame, upper case": lambda points: pandas.DataFrame(points, columns=list("XYZ")).assign(n=1),
    "dictionary": lambda points: dict(zip("xyz", points.T)),
    "subclass": lambda points: points.view(np.matrix),
}


@pytest.fixture(scope="module", params=[np.float32, np.float64], ids=["float32", "float64"])
def mapped(request, scans):
    points = scans[1].astype(request.param)
    return points, globalmatch.map_stems(points)


@pytest.mark.parametrize("form", forms)
def test_arrays_of_any_form_give_the_same_bits(mapped, form):
    points, reference = mapped
    assert len(reference) > 30
    assert same_bits(globalmatch.map_stems(forms[form](points)), reference)


def test_columns_of_different_types_are_read_as_they_are(scans):
    points = scans[1].astype(np.float32)
    mixed = {"x": points[:, 0], "y": points[:, 1].astype(np.float64), "z": points[:, 2]}
    assert same_bits(globalmatch.map_stems(mixed), globalmatch.map_stems(points))


@pytest.mark.parametrize("form", forms)
def test_stems_of_any_form_give_the_same_bits(stems, form):
    positions = stems[:, :3].copy()
    reference = globalmatch.match_stems(positions, positions[:30])
    result = globalmatch.match_stems(forms[form](positions), forms[form](positions[:30]))
    assert reference.outcome == "registered"
    assert result.target_from_source.tobytes() == reference.target_from_source.tobytes()
    assert result.uncertainty.covariance.tobytes() == reference.uncertainty.covariance.tobytes()


def test_stems_without_heights_leave_the_height_unknown(stems):
    for flat in (stems[:, :2], pandas.DataFrame(stems[:, :2], columns=["x", "y"])):
        result = globalmatch.match_stems(flat, flat)
        assert result.outcome == "registered"
        assert not result.vertical.is_known
        assert "height_unknown" in dict(result.warnings)


def test_radii_and_sigmas_of_columns_count(stems):
    table = pandas.DataFrame(stems, columns=["x", "y", "z", "radius"]).assign(position_sigma=-1.0)
    with pytest.raises(ValueError, match="source: position_sigma 0 is negative"):
        globalmatch.match_stems(table, stems[:, :3])
    table["position_sigma"] = 0.02
    table["radius"] = table["radius"].astype(str)
    with pytest.raises(TypeError, match="source: column radius: expected float32 or float64"):
        globalmatch.match_stems(table, stems[:, :3])


def test_points_that_are_not_finite_are_counted_in_scans_and_refused_in_stems(scans, stems):
    points = scans[1].copy()
    points[5] = np.nan
    points[7, 2] = np.inf
    assert globalmatch.map_stems(points).not_finite == 2
    with pytest.raises(ValueError, match="target: position 3 is not finite"):
        positions = stems[:, :3].copy()
        positions[3, 1] = np.nan
        globalmatch.match_stems(stems[:, :3], positions)


points = np.zeros((5, 3))


@pytest.mark.parametrize(
    "given, error, message",
    [
        (np.zeros((5, 2)), ValueError, r"source: expected an N x 3 array, got shape \(5, 2\)"),
        (np.zeros(0), ValueError, r"source: expected an N x 3 array, got shape \(0,\)"),
        (np.zeros((3, 5, 3)), ValueError, r"source: expected an N x 3 array, got shape \(3, 5, 3\)"),
        (points.astype(int), TypeError, "source: expected float32 or float64 .* got int64"),
        (points.astype(np.float16), TypeError, "source: expected float32 or float64 .* got float16"),
        (points.astype(">f4"), TypeError, "source: expected .* in the byte order of the machine, got >f4"),
        (None, TypeError, "source: expected an N x 3 array"),
        (dict(zip("xy", points.T)), ValueError, r"source: expected columns x, y, z, got \['x', 'y'\]"),
        ({"x": points[:, 0], "y": points[:4, 0], "z": points[:, 0]}, ValueError, "source: columns differ"),
        ({"x": points, "y": points, "z": points}, ValueError, "source: expected one number a row in x"),
        (structured(points, "abc"), ValueError, "source: expected columns x, y, z"),
        (np.ma.array(points), TypeError, r"source: expected an array without a mask; numpy.ma.compress_rows"),
        (np.ma.array(structured(points)), TypeError, r"source: expected an array without .*\.filled\("),
        (
            {"x": points[:, 0], "y": np.ma.masked_less(points[:, 1], 0), "z": points[:, 2]},
            TypeError,
            r"source: column y: expected an array without a mask; \.compressed\(\)",
        ),
    ],
)
def test_what_is_no_scan_is_refused_by_its_name(given, error, message):
    with pytest.raises(error, match=message):
        globalmatch.register_scans(given, points)
    with pytest.raises(error, match=message.replace("source", "target")):
        globalmatch.register_scans(points, given)


@pytest.mark.parametrize("path", ["a.laz", b"a.laz", pathlib.Path("a.laz")])
def test_the_name_of_a_file_is_no_array(path):
    with pytest.raises(TypeError, match=r"scan: expected an array, .*laspy.read\(path\).xyz"):
        globalmatch.map_stems(path)
    with pytest.raises(TypeError, match=r"target: expected an array, got the name of a file"):
        globalmatch.match_stems(points, path)
    with pytest.raises(TypeError, match=r"maps\[0\]: expected an array, got the name of a file"):
        globalmatch.register_survey([path])


def test_points_of_a_scan_are_no_stems():
    scan = np.random.default_rng(1).uniform(0, 20, (20000, 3))
    for call, name in [
        (lambda: globalmatch.match_stems(scan, points), "source"),
        (lambda: globalmatch.match_stems(points, scan[:, :2]), "target"),
        (lambda: globalmatch.register_survey([scan, scan]), "map 0"),
    ]:
        with pytest.raises(ValueError, match=f"{name}: 1.* are points of a scan, not stems.*map_stems finds"):
            call()


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: globalmatch.map_stems(), "map_stems: the argument scan is missing"),
        (lambda: globalmatch.match_stems(points), "match_stems: the argument target is missing"),
        (lambda: globalmatch.match_stems(target=points), "match_stems: the argument source is missing"),
        (lambda: globalmatch.match_stems(points, points, 4), "match_stems: got 3 arguments by place, takes 2"),
        (lambda: globalmatch.register_scans(points, source=points), "register_scans: source is given twice"),
        (lambda: globalmatch.register_maps(points, None), "source: expected a StemMap, .* got ndarray"),
        (lambda: globalmatch.refine_survey(None, []), "survey: expected a Survey, got NoneType"),
        (lambda: globalmatch.write_stem_map("map", points), "map: expected a StemMap, got ndarray"),
        (lambda: globalmatch.read_stem_map("map", threads=2), "there is no argument threads"),
        (lambda: globalmatch.register_survey("map"), "maps: expected a list of stem maps"),
    ],
)
def test_wrong_calls_are_refused_in_a_line(call, message):
    with pytest.raises(TypeError, match=message) as refused:
        call()
    assert "\n" not in str(refused.value)


def test_functions_say_how_they_are_called():
    assert str(inspect.signature(globalmatch.match_stems)) == "(source, target, **options)"
    assert globalmatch.map_stems.__doc__.startswith("Maps the stems of a scan")


def test_what_is_said_of_masks_helps(scans, stems):
    points = np.ma.array(scans[1])
    points[:20] = np.ma.masked
    assert globalmatch.map_stems(points.filled(np.nan)).not_finite == 20
    positions = np.ma.array(stems[:, :3])
    positions[3, 1] = np.ma.masked
    with pytest.raises(TypeError, match="target: expected an array without a mask"):
        globalmatch.match_stems(stems[:, :3], positions)
    rows = np.ma.compress_rows(positions)
    assert len(rows) == len(stems) - 1
    assert globalmatch.match_stems(stems[:, :3], rows).outcome == "registered"


def test_an_empty_scan_is_an_answer_with_a_reason():
    result = globalmatch.register_scans(np.zeros((0, 3)), np.zeros((0, 3)))
    assert result.target_from_source is None
    assert result.outcome == "not_registered" and "0 stems" in result.reason


def test_lists_and_what_numpy_takes_are_read_too(stems):
    class Wrapped:
        def __array__(self, dtype=None):
            return stems[:, :3]

    assert globalmatch.match_stems(stems[:, :3].tolist(), Wrapped()).outcome == "registered"
