"""Each line marked so is one that mypy must refuse."""
import globalmatch
import numpy as np

points = np.zeros((0, 3))
globalmatch.map_stems(points, tolerence=0.1)  # wrong
globalmatch.match_stems(points, points, dof=5)  # wrong
globalmatch.register_scans(points, points, icp="plane")  # wrong
globalmatch.register_scans(points, points).target_from_source + 1  # wrong
globalmatch.register_maps(points, globalmatch.map_stems(points))  # wrong
globalmatch.Matching.outcom  # wrong
