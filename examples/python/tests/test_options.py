"""Keyword arguments: the names and defaults of C++, and what is said where they do not fit."""
import ast
import inspect
from pathlib import Path

import globalmatch
import numpy as np
import pytest

functions = list(globalmatch.defaults)
stub = ast.parse((Path(__file__).parents[1] / "globalmatch/__init__.pyi").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", functions)
def test_the_stub_has_the_arguments_and_defaults_of_the_function(name):
    (function,) = [node for node in stub.body if isinstance(node, ast.FunctionDef) and node.name == name]
    arguments = {
        argument.arg: ast.literal_eval(default)
        for argument, default in zip(function.args.kwonlyargs, function.args.kw_defaults)
    }
    known = globalmatch.defaults[name]
    assert list(arguments) == list(known)
    for argument, default in arguments.items():
        assert default is ... or default == known[argument], argument


def test_the_stub_has_the_classes_and_their_properties():
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    for name, node in classes.items():
        members = {member.name for member in node.body if isinstance(member, ast.FunctionDef)}
        there = {m for m, _ in inspect.getmembers(getattr(globalmatch, name)) if not m.startswith("_")}
        assert {m for m in members if not m.startswith("_")} == there, name
    assert set(classes) == {name for name in dir(globalmatch) if isinstance(getattr(globalmatch, name), type)}


def test_all_defaults_may_be_given(stems, scans):
    defaults = globalmatch.defaults
    arguments = {"map_stems": [scans[0][::20]], "match_stems": [stems[:, :3]] * 2, "register_survey": [[]]}
    for name, data in arguments.items():
        given = dict(defaults[name])
        for key in ("prior_sigma_position", "prior_sigma_yaw", "tolerance"):
            given.pop(key, None)
        assert repr(getattr(globalmatch, name)(*data, **given)) == repr(getattr(globalmatch, name)(*data))


def test_options_reach_the_library(stems, scans):
    positions = stems[:, :3]
    assert globalmatch.match_stems(positions, positions, tolerance=0.07).inlier_threshold == 0.07
    assert globalmatch.match_stems(positions, positions, inlier_threshold=0.07).inlier_threshold == 0.07
    assert globalmatch.match_stems(positions, positions, dof=6).uncertainty.covariance.shape == (6, 6)
    assert globalmatch.match_stems(positions, positions, dof=4).uncertainty.covariance.shape == (4, 4)
    assert not globalmatch.match_stems(positions, positions, horizontal=True).vertical.is_known
    scaled = globalmatch.match_stems(1.05 * positions, positions, scale=True)
    assert scaled.scale.is_applied and scaled.scale.factor == pytest.approx(1 / 1.05, rel=1e-6)
    demanding = globalmatch.match_stems(positions, positions, decision={"min_correspondences": 99})
    assert demanding.target_from_source is None
    assert len(globalmatch.map_stems(scans[1], stems={"cylinder": {"max_radius": 0.03}})) == 0
    assert globalmatch.map_stems(scans[1], ground={"filter": "normalized"}).ground == "normalised"
    assert np.allclose(globalmatch.map_stems(scans[1], up=(0, 0, 2), vertical="given").up, (0, 0, 1))


def test_icp_is_a_name_or_a_dictionary(scans):
    maps = [globalmatch.map_stems(scan) for scan in scans]
    assert globalmatch.register_maps(*maps).icp is not None
    assert globalmatch.register_maps(*maps, icp="none").icp is None
    assert globalmatch.register_maps(*maps, icp={"max_iterations": 1}).icp.iterations == 1


def test_a_prior_is_a_matrix_with_sigmas(stems):
    near, far = np.eye(4), np.eye(4)
    far[0, 3] = 300
    positions = stems[:, :3]
    assert globalmatch.match_stems(positions, positions, prior=near, prior_sigma_yaw=0.1).prior.sigmas < 0.1
    result = globalmatch.match_stems(positions, positions, prior=far, prior_sigma_position=1)
    assert result.prior is None or result.prior.is_contradicted


@pytest.mark.parametrize(
    "given, error, message",
    [
        ({"tolerence": 1}, TypeError, "there is no argument tolerence; is tolerance meant?"),
        ({"tolerance": 1, "inlier_threshold": 1}, ValueError, "tolerance: it is the inlier_threshold"),
        ({"tolerance": -1}, ValueError, "inlier_threshold must be positive"),
        ({"horizontal": None}, TypeError, "horizontal: expected True or False, got None"),
        ({"dof": 5}, TypeError, "dof: expected one of 4, 6, got 5"),
        ({"proposal": "best"}, TypeError, "proposal: expected one of 'triangle_index', 'algo.*', got 'best'"),
        ({"decision": 3}, TypeError, "decision: expected a dictionary of options, got 3"),
        ({"decision": {"max_nfa": "low"}}, TypeError, "decision.max_nfa: expected a number, got 'low'"),
        ({"decision": {"nfa": 1}}, TypeError, "no argument decision.nfa; is decision.max_nfa meant?"),
        ({"decision": {"max_nfa": 0}}, ValueError, "decision.max_nfa must be positive"),
        ({"prior": np.eye(3)}, ValueError, r"prior: expected a 4 x 4 matrix, got shape \(3, 3\)"),
        ({"prior": 2 * np.eye(4)}, ValueError, "prior: the last row"),
        ({"prior": np.diag([2, 1, 1, 1])}, ValueError, "prior.target_from_source"),
        ({"prior": "eye"}, TypeError, "prior: expected a 4 x 4 matrix"),
        ({"prior_sigma_yaw": 1}, ValueError, "prior_sigma_yaw: it needs a prior"),
        ({"up": (0, 1)}, TypeError, "up: expected three numbers"),
        ({"up": (0, 0, 0)}, ValueError, "up must be"),
        ({"threads": -1}, ValueError, "^threads: expected 0 .all. or more, got -1"),
        ({"threads": 1.5}, TypeError, "threads: expected an integer, got 1.5"),
        ({"progress": 1}, TypeError, "progress: expected a function, got 1"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_name(given, error, message):
    with pytest.raises(error, match=message):
        globalmatch.match_stems(np.zeros((4, 3)), np.zeros((4, 3)), **given)


def test_lists_of_options_name_the_one_that_is_wrong():
    with pytest.raises(ValueError, match=r"fixed\[1\].survey_from_scan: it must be given"):
        globalmatch.register_survey([], fixed=[{"scan": 0, "survey_from_scan": np.eye(4)}, {"scan": 1}])
    with pytest.raises(TypeError, match=r"levels: expected a list of dictionaries, got 3"):
        globalmatch.register_survey([], levels=3)
