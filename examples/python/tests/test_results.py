"""Results are those of the programs and of the truth; they are arrays and small classes."""
import os
import pickle
import subprocess
from pathlib import Path

import globalmatch
import numpy as np
import pandas
import pytest
from conftest import random_stems, rigid, transformed

programs = Path(os.environ["GLOBALMATCH_PROGRAMS"]) if "GLOBALMATCH_PROGRAMS" in os.environ else None


def program(name, *arguments):
    if programs is None:
        pytest.skip("GLOBALMATCH_PROGRAMS does not say where the programs are")
    subprocess.run([programs / name, *map(str, arguments)], check=True, capture_output=True)


def write_ply(path, points):
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
    path.write_bytes(header.encode() + points.astype("<f8").tobytes())


@pytest.fixture(scope="module")
def registration(scans):
    return globalmatch.register_scans(*scans)


def test_scans_are_registered_as_they_stand(registration, true_transform):
    assert registration.outcome == "registered" and registration.reason == ""
    assert registration.refined and registration.icp.converged
    assert np.abs(registration.target_from_source - true_transform).max() < 0.01
    assert registration.target_from_source.shape == (4, 4)
    assert registration.target_from_source.flags.c_contiguous
    assert registration.probability > 0.99
    assert registration.uncertainty.expected_error(registration.uncertainty.center) < 0.02
    assert registration.uncertainty.at((0, 0, 0)).shape == (3, 3)
    assert registration.vertical.is_known


def test_stems_are_those_of_the_plot(registration, stems):
    found = registration.target.stems
    assert len(found) == len(registration.target) > 30
    for x, y, z, radius in found[["x", "y", "z", "radius"]]:
        nearest = stems[np.argmin(np.hypot(stems[:, 0] - x, stems[:, 1] - y))]
        assert np.abs(nearest - (x, y, z, radius)).max() < 0.05
    assert list(pandas.DataFrame(found).columns) == list(found.dtype.names)


def test_stems_of_maps_match_as_they_are(registration, true_transform):
    for form in (np.asarray, pandas.DataFrame):
        result = globalmatch.match_stems(form(registration.source.stems), form(registration.target.stems))
        assert np.abs(result.target_from_source - true_transform).max() < 0.02
        pairs = result.hypotheses[0].correspondences
        assert pairs.dtype == np.uint32 and pairs.shape[1] == 2
        assert pairs[:, 0].max() < len(registration.source)


def test_samples_are_views_of_the_map_that_keep_it_alive(scans):
    found = globalmatch.map_stems(scans[1])
    assert np.shares_memory(found.ground_samples, found.ground_samples)
    samples, support = found.ground_samples, found.points_on_stem(0)
    copies = samples.copy(), support.copy()
    assert samples.base is found and not samples.flags.writeable
    del found
    assert np.array_equal(samples, copies[0]) and np.array_equal(support, copies[1])
    assert samples.shape[1] == 3 and len(support) > 10
    assert np.ptp(scans[1][support][:, :2], axis=0).max() < 0.6  # they lie on one stem


def test_no_answer_has_a_reason_and_no_transform():
    result = globalmatch.match_stems(random_stems(30, 20, 5)[:, :3], random_stems(30, 20, 6)[:, :3])
    assert result.target_from_source is None and result.uncertainty is None
    assert result.outcome == "not_registered" and result.reason
    assert repr(result) == f"<Matching: not_registered, {result.reason}>"


def test_representations_say_what_matters(registration):
    assert repr(registration).startswith("<Registration: registered, ")
    assert repr(registration.target).endswith("points, ground seen>")
    assert "pairs, log10 NFA -" in repr(registration.hypotheses[0])
    assert "4 degrees of freedom" in repr(registration.uncertainty)
    assert repr(registration.vertical).startswith("<Vertical: level, height by ground")
    assert repr(registration.icp).startswith("<IcpResult: converged True, iterations ")
    assert repr(registration.matching.scale).startswith("<Scale: factor 1.")


def test_funnels_and_warnings_are_lists(registration):
    assert [step["step"] for step in registration.target.funnel][0] == "scan"
    assert registration.target.funnel[0]["output_count"] == registration.target.points
    empty = globalmatch.map_stems(np.zeros((0, 3)))
    assert dict(empty.warnings)["no_stems"].startswith("no stems were found: ")


def test_maps_are_kept_in_files_and_pickled(registration, tmp_path):
    globalmatch.write_stem_map(tmp_path / "map.gmap", registration.target)
    pickled = pickle.loads(pickle.dumps(registration.target))
    for other in (globalmatch.read_stem_map(tmp_path / "map.gmap"), pickled):
        for name in registration.target.stems.dtype.names:
            if name != "points":  # files have not which points lie on stems
                assert np.array_equal(other.stems[name], registration.target.stems[name])
        assert np.array_equal(other.stem_samples, registration.target.stem_samples)
    with pytest.raises(FileNotFoundError, match="absent.gmap"):
        globalmatch.read_stem_map(tmp_path / "absent.gmap")
    (tmp_path / "wrong.gmap").write_bytes(b"nothing")
    with pytest.raises(RuntimeError):
        globalmatch.read_stem_map(tmp_path / "wrong.gmap")


def test_files_of_maps_are_written_whole_or_not_at_all(registration, tmp_path):
    file = tmp_path / "map.gmap"
    file.write_bytes(b"what was there")
    cancelled = globalmatch.map_stems(np.zeros((10, 3)), progress=lambda *_: False)
    with pytest.raises(ValueError, match="map: it was cancelled"):
        globalmatch.write_stem_map(file, cancelled)
    assert file.read_bytes() == b"what was there"
    with pytest.raises(OSError, match="absent/map.gmap: "):
        globalmatch.write_stem_map(tmp_path / "absent" / "map.gmap", registration.target)
    globalmatch.write_stem_map(file, registration.target)
    assert len(globalmatch.read_stem_map(file)) == len(registration.target)
    assert os.listdir(tmp_path) == ["map.gmap"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_full_disk_is_an_error(registration):
    with pytest.raises(OSError, match="/dev/full: could not be written to its end"):
        globalmatch.write_stem_map("/dev/full", registration.target)


def test_match_stems_is_that_of_the_program(stems, true_transform, tmp_path):
    source = transformed(np.linalg.inv(true_transform), stems[5:, :3])
    tables = [pandas.DataFrame(rows, columns=list("xyz")) for rows in (source, stems[:30, :3])]
    for name, table in zip(("source", "target"), tables):
        table.to_csv(tmp_path / f"{name}.csv", index=False, float_format="%.17g")
    program("match_stems", tmp_path / "source.csv", tmp_path / "target.csv", "--out", tmp_path / "T.txt")
    result = globalmatch.match_stems(*tables)
    assert np.abs(result.target_from_source - np.loadtxt(tmp_path / "T.txt")).max() < 1e-9


def test_register_scans_is_that_of_the_program(registration, scans, tmp_path):
    for name, points in zip(("source", "target"), scans):
        write_ply(tmp_path / f"{name}.ply", points)
    program("register_scans", tmp_path / "source.ply", tmp_path / "target.ply", "--out", tmp_path / "T.txt")
    assert np.abs(registration.target_from_source - np.loadtxt(tmp_path / "T.txt")).max() < 1e-9
    program("map_stems", tmp_path / "target.ply", "--out", tmp_path / "stems.csv")
    written = pandas.read_csv(tmp_path / "stems.csv")
    assert len(written) == len(registration.target)
    for name in ("x", "y", "z", "radius", "quality"):
        assert np.abs(written[name] - registration.target.stems[name]).max() < 1e-9


def poses_of_survey():
    return [rigid(40 * k, [6 * k, 3 * k, 0.1 * k]) for k in range(4)]


def survey_maps():
    """Overlapping parts of a plot in the frames of four scans, and a plot elsewhere."""
    plot = random_stems(120, 25, seed=7)
    maps = []
    for pose in poses_of_survey():
        seen = plot[np.hypot(*(plot[:, :2] - pose[:2, 3]).T) < 16]
        maps.append(np.column_stack([transformed(np.linalg.inv(pose), seen[:, :3]), seen[:, 3]]))
    maps.append(random_stems(30, 15, seed=8))
    return [pandas.DataFrame(stems, columns=["x", "y", "z", "radius"]) for stems in maps]


def test_a_survey_places_scans_and_names_those_that_it_does_not():
    poses = poses_of_survey()
    result = globalmatch.register_survey(survey_maps(), reference=0)
    for scan, pose in zip(result.scans, poses):
        assert scan.status == "placed" and scan.reason == ""
        assert np.abs(scan.survey_from_scan - np.linalg.inv(poses[0]) @ pose).max() < 1e-6
        assert scan.uncertainty.covariance.shape == (4, 4)
    assert result.scans[4].status == "placed_alone" and result.scans[4].component == 1
    assert result.components == 2 and len(result.links) >= 3
    assert repr(result).startswith("<Survey: 4 of 5 scans placed, 2 components, ")
    assert len(result.observations) == result.trees["scans"].sum()
    assert set(result.trees["component"]) == {0} and set(result.observations["scan"]) == {0, 1, 2, 3}


def test_register_survey_is_that_of_the_program(tmp_path):
    maps = survey_maps()[:4]
    files = [tmp_path / f"map_{k}.csv" for k in range(len(maps))]
    for path, stems in zip(files, maps):
        stems.to_csv(path, index=False, float_format="%.17g")
    program("register_survey", "--stem-maps", *files, "--out-dir", tmp_path / "survey")
    written = [np.loadtxt(tmp_path / "survey" / f"T_{path.stem}.txt") for path in files]
    reference = [np.array_equal(pose, np.eye(4)) for pose in written].index(True)
    result = globalmatch.register_survey(maps, reference=reference)
    for scan, pose in zip(result.scans, written):
        assert np.abs(scan.survey_from_scan - pose).max() < 1e-9


def test_fixed_scans_give_the_frame_of_a_survey():
    pose = rigid(10, [100, 200, 5])
    result = globalmatch.register_survey(survey_maps(), fixed=[{"scan": 1, "survey_from_scan": pose}])
    assert np.allclose(result.scans[1].survey_from_scan, pose)
    assert result.frames[0] == ("fixed", 0)


def test_a_scan_that_is_not_placed_has_no_pose():
    result = globalmatch.register_survey([np.zeros((0, 3)), random_stems(30, 15, 1)[:, :3]])
    assert result.scans[0].status == "no_stems"
    assert result.scans[0].survey_from_scan is None and result.scans[0].reason
    assert result.scans[0].best_guess.shape == (4, 4)


def test_surveys_of_mapped_scans_are_refined(registration, true_transform):
    maps = [registration.source, registration.target]
    placed = globalmatch.register_survey(maps, reference=1)
    refined = globalmatch.refine_survey(placed, maps)
    assert placed.refined_pairs == [] and refined.refined_pairs[0].is_refined
    assert np.abs(refined.scans[0].survey_from_scan - true_transform).max() < 0.01
    with pytest.raises(ValueError, match="maps: expected those of the survey, 2, got 1"):
        globalmatch.refine_survey(placed, maps[:1])


def test_what_is_no_survey_is_refused_by_its_name(stems):
    with pytest.raises(TypeError, match="maps: expected a list"):
        globalmatch.register_survey(stems[:, :3])
    with pytest.raises(ValueError, match=r"maps\[1\]: expected an N x 2 or N x 3 array, got shape \(40, 4\)"):
        globalmatch.register_survey([stems[:, :3], stems])
    with pytest.raises(ValueError, match="map 1: position 0 is not finite"):
        globalmatch.register_survey([stems[:, :3], np.full((1, 3), np.nan)])
