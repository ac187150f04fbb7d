#!/usr/bin/env bash
# Headers may include only along the arrows of docs/architecture.md, and never in a circle. (points, execution and positions are
# the ground that the core stands on: one group with it.)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
python3 - <<'P'
import glob, re, sys
core, words, box, maps, match, verb = 'core vocabulary boxes mapping matching verbs'.split()
public = {'points': core, 'execution': core, 'positions': core, 'stem_map': words, 'matching': words, 'mapping_options': words, 'icp_options': words,
          'triangles': box, 'local_matching': box, 'global_matching': box, 'transform': box, 'icp': box, 'evaluation': box, 'matching_options': box, 'survey_matches': words, 'survey_options': box, 'refinement_options': box}
may = {core: [core], words: [core, words], box: [core, words, box, 'global_matching', 'icp'], maps: [core, words, box, maps], match: [core, words, box, 'global_matching', match],
       'published': [core, words, box, maps, 'published'], 'survey': [core, words, box, match, 'survey'],
       'global_matching': [core, words, box, 'global_matching'], 'icp': [core, words, 'icp'], 'stem_map_io': [core, words, 'stem_map_io'], verb: [core, words, box, maps, match, 'published', 'survey', 'global_matching', 'stem_map_io', verb]}
group = lambda h: h.split('/')[1] if h.startswith('detail/') else public.get(h[:-4], verb)  # detail/verbs/ is of the verbs
headers = {p[len('include/globalmatch/'):]: re.findall(r'#include "globalmatch/(.+)"', open(p).read())
           for p in glob.glob('include/globalmatch/**/*.hpp', recursive=True)}
bad = [f'{h} includes {i}: {group(h)} must not use {group(i)}' for h in headers for i in headers[h] if group(i) not in may[group(h)]]
left = dict(headers)
while free := [h for h in left if not any(i in left for i in left[h])]:
    for h in free: del left[h]
bad += [f'{h} is in a circle of includes, or includes one' for h in left]
print('\n'.join(sorted(bad)) or f'{len(headers)} headers, all arrows allowed')
sys.exit(bool(bad))
P
