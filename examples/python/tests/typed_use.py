"""A program that mypy must accept."""
from typing import Optional

import globalmatch
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def report(fraction: float, stage: str) -> None:
    print(f"{stage}: {100 * fraction:.0f} %")


def registered(source: Floats, target: Floats) -> Optional[globalmatch.Array]:
    result = globalmatch.register_scans(source, target, dof=4, tolerance=0.1, icp="none", progress=report)
    if result.target_from_source is None:
        print(result.outcome, result.reason, dict(result.warnings))
        return None
    if result.uncertainty is not None:
        print(result.uncertainty.expected_error((0, 0, 0)))
    return result.target_from_source


def poses(scans: list[Floats]) -> list[Optional[globalmatch.Array]]:
    maps = [globalmatch.map_stems(scan, ground={"resolution": 0.25}, up=(0, 1, 0)) for scan in scans]
    survey = globalmatch.refine_survey(globalmatch.register_survey(maps, reference=0), maps)
    return [scan.survey_from_scan for scan in survey.scans if scan.status == "placed"]
