"""Registers forest laser scans by the relative positions of their stems: docs/python.md."""
from ._globalmatch import (
    Hypothesis,
    IcpResult,
    Lattice,
    Matching,
    PriorDeviation,
    RefinedPair,
    Registration,
    Scale,
    StemMap,
    Survey,
    SurveyLink,
    SurveyScan,
    Uncertainty,
    Vertical,
    __version__,
    defaults,
    map_stems,
    match_stems,
    read_stem_map,
    refine_survey,
    register_maps,
    register_scans,
    register_survey,
    write_stem_map,
)

__all__ = [name for name in dir() if name[0].isalpha()] + ["__version__"]
